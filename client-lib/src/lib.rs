//! The door for people and scripts: the world as a client sees it.
//!
//! ```no_run
//! use omnibus_client_lib::{Client, Spawn};
//!
//! let mut client = Client::connect(None, "hello")?;
//! client.synchronise(50_000_000)?;
//! let place = client.spawn_points()?[0];
//! let ego = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
//! for _ in 0..100 {
//!     client.tick()?;
//!     let car = client.world().actor(ego).expect("it was spawned");
//!     println!("{:?} at {:?}", car.actor_id, car.pose.position());
//! }
//! # Ok::<(), omnibus_client_lib::ClientError>(())
//! ```
//!
//! Metres, radians, seconds; right-handed, x forward, y left, z up. `carla_axes` alone knows
//! CARLA's left hand and degrees.

mod actors;
mod bones;
pub mod carla_axes;
mod client;
mod connection;
mod controller;
mod draw;
mod error;
mod event_camera;
mod event_fd;
mod events;
mod file;
mod hide;
mod lamps;
mod observer;
mod outcomes;
mod physics;
mod recorder;
mod sensor_bundle;
mod world;
mod worlds;

pub use actors::{Spawn, spawn_poses};
pub use bones::{bone, bone_commands};
pub use bus::{BusError, Instance, Interrupted, Strategy, Watch, clock};
pub use client::{Client, ConnectOptions};
pub use connection::Deadlines;
pub use controller::Controller;
pub use draw::Draw;
pub use error::ClientError;
pub use event_camera::{EventCamera, EventCameraSpec, PixelEvent};
pub use event_fd::EventFd;
pub use events::Event;
pub use file::{Profile, Replay, saved_folder, saved_path};
pub use hide::hide_objects;
pub use lamps::StreetLightCommand;
pub use observer::Observer;
pub use outcomes::Ticket;
pub use protocol::{
    AckermannControl, AckermannSettings, ActorId, ActorState, ApplyForce, Ask, Autopilot, BONES,
    BlendPose, BlueprintInfo, BundleId, CamReading, CamSpec, CollisionReading, Command, Curve,
    DEPTH_FAR_M, Episode, EraseShapes, Frame, Gear, GnssReading, GnssSpec, HideLayers, HideObjects,
    ImuReading, ImuSpec, JournalEntry, LaneInvasionReading, LoadMap, MessageReading, MessageSpec,
    Name, ObstacleReading, ObstacleSpec, OdometryReading, OdometrySpec, Pose, RadioSpec,
    RouteCommand, RouteStep, SHAPE_TEXT_BYTES, SHAPES_MAX, STRIDE, SensorSpec, SetBones, SetDoors,
    SetPhysics, SetStreetLights, SetTrafficLight, SetVehicleLights, SetVelocity,
    SetWeatherAffectsGrip, Settings, Shape, SnapshotHeader, Stamp, Switch, TEXT_BYTES, Teleport,
    TrafficParam, Transmit, VehicleBody, VehicleControl, VehicleEngine, VehicleGearbox,
    VehiclePhysics, VehicleSteering, VehicleTelemetry, VehicleWheel, WalkerLimbs, Weather,
    WheelTelemetry, flag, geodesy, kind, lamp, layer, light, output, param, part, point_attribute,
    radio, route_step, sensor, shape, street_light, tracer,
};
pub use sensor_bundle::{
    Measurement, SensorBundle, cam, camera, collision, gnss, imu, lane_invasion, lidar, message,
    obstacle, odometry,
};
pub use world::World;
