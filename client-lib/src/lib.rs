//! The typed interface of the simulator for programs: connect, spawn, tick, measure, drive.
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use omnibus_client_lib::{Client, Spawn};
//!
//! let mut client = Client::connect(None, "hello")?;
//! client.synchronise(Duration::from_millis(50))?;
//! let place = client.spawn_points()?[0];
//! let ego = client.spawn(Spawn::new("vehicle.tesla.model3", place).autopilot())?;
//! for _ in 0..100 {
//!     client.tick()?;
//!     let car = client.world().actor(ego).expect("it was spawned");
//!     println!("{} at {}, {:.1} m/s", car.id(), car.position(), car.speed_mps());
//! }
//! # Ok::<(), omnibus_client_lib::ClientError>(())
//! ```
//!
//! Metres, radians, seconds; right-handed, x forward, y left, z up. Left-handed axes and degrees exist
//! in [`carla_axes`] only.
//!
//! [`Client`], its halves [`Observer`] and [`Controller`], [`SensorBundle`], [`Measurement`] and
//! [`World`] are `Send`; the last two are `Sync`.

mod actor_view;
mod actors;
mod bones;
mod bundles;
pub mod carla_axes;
mod client;
mod command;
mod connection;
mod control;
mod controller;
mod draw;
mod effects;
mod elevations;
mod error;
mod event_camera;
mod event_fd;
mod event_stream;
mod events;
mod file;
mod flags;
mod image;
mod inbox;
mod keypoints;
mod lens;
mod lidar_model;
mod map_objects;
mod measurement;
mod observer;
mod options;
mod outcome;
mod pending_tick;
mod queries;
mod radar;
mod radar_rays;
mod radar_receiver;
mod radar_walls;
mod rays;
mod readings;
mod recorder;
mod sensor;
mod sensor_bundle;
mod sensor_kind;
mod sensor_options;
mod settings;
mod static_world;
mod street_lights;
mod ticket;
mod traffic;
mod traffic_param;
mod v2x_options;
mod v2x_readings;
mod vehicle_physics;
mod vehicles;
mod visibility;
mod waiter;
pub mod wire;
mod wire_requests;
mod world;
mod worlds;

pub use actor_view::{Actor, TrafficLightState, VehicleState};
pub use actors::{Spawn, spawn_poses};
pub use bake::MapError;
pub use bones::{BoneTransform, animation_pose, bone, bone_commands, bone_transforms, posture_of};
pub use bundles::bundle_commands;
pub use bus::{
    BusError, Instance, Interrupted, SequenceEvent, Spin, StageClock, Strategy, Watch, clock,
    prefer_latency,
};
pub use client::{Client, ConnectOptions};
pub use command::Command;
pub use connection::Deadlines;
pub use control::VehicleControl;
pub use controller::Controller;
pub use draw::Draw;
pub use effects::{CameraEffects, Exposure, ToneCurve};
pub use elevations::Elevations;
pub use error::{ClientError, Incompleteness};
pub use event_camera::{EventCamera, EventCameraSpec, PixelEvent};
pub use event_fd::EventFd;
pub use events::Event;
pub use file::{Profile, Replay, saved_folder, saved_path};
pub use flags::{
    ActorFlags, ActorKind, CameraOutputs, Doors, Layers, LidarOutputs, LightPhase, VehicleLights,
};
pub use glam;
pub use image::{Image, Intrinsics, PointCloud};
pub use keypoints::{
    ImageKeypoint, KEYPOINT_COUNT, KEYPOINT_LINKS, KEYPOINTS, KeypointView, KeypointVisibility,
    Keypoints, keypoints,
};
pub use lens::Lens;
pub use lidar_model::{LidarModel, UnknownLidarModel};
pub use measurement::Measurement;
pub use mesh::Tag;
pub use observer::Observer;
pub use outcome::Outcome;
pub use pending_tick::PendingTick;
/// Plain records of numbers and ids, the same in this interface and in the protocol.
pub use protocol::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, BONES, BlueprintInfo, BundleId,
    Curve, DEPTH_FAR_M, Frame, Gear, Pose, Projection, Refusal, RefusalCode, SHAPE_TEXT_BYTES,
    SHAPES_MAX, TEXT_BYTES, VERSION, VehicleBody, VehicleEngine, VehicleGearbox, VehiclePhysics,
    VehicleSteering, VehicleTelemetry, VehicleWheel, Weather, WheelTelemetry,
};
pub use queries::Queries;
pub use radar::{Radar, RadarDetection};
pub use radar_rays::RadarRays;
pub use radar_receiver::{RadarReceiver, RadarTarget};
pub use rays::{RayGrid, RayHit};
pub use readings::{
    Collision, Corner, DetectedObject, Gnss, Imu, LaneInvasion, LaneSide, Obstacle, Odometry,
};
pub use road;
pub use sensor::Sensor;
pub use sensor_bundle::SensorBundle;
pub use sensor_kind::SensorKind;
pub use sensor_options::{
    CameraOptions, Geodesy, GnssOptions, ImuOptions, LidarOptions, ObstacleOptions,
    OdometryOptions, PointAttribute, Quality,
};
pub use settings::{Pace, Settings};
pub use static_world::{MapObject, StreetLight};
pub use street_lights::StreetLightCommand;
pub use ticket::Ticket;
pub use traffic_param::{RouteStep, TrafficParam};
pub use v2x_options::{V2xAwarenessOptions, V2xRadioFlags, V2xRadioOptions, V2xScenario};
pub use v2x_readings::{
    V2xAwarenessMessage, V2xLowFrequency, V2xStationType, V2xTextMessage, V2xVehicleRole,
};
pub use visibility::hide_objects;
pub use waiter::Waiter;
pub use world::World;
