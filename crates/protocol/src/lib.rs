//! The messages of the bus: layouts, ids and enums, without a transport.
//!
//! Every message is plain old data (`#[repr(C)]`, [`bytemuck::Pod`]) and is read in the memory in
//! which it was written. Values are SI units and radians, right-handed, z up; the names of fields
//! carry their units. [`Command`] is what changes a world, [`ActorState`] what a snapshot holds,
//! [`SensorSpec`] what a sensor measures.

mod actor;
mod bones;
mod command;
mod debug_shapes;
mod drawing;
mod episode;
mod hidden_objects;
mod limbs;
mod motion;
mod name;
mod payload;
mod physics_sensor;
mod query;
mod recording;
mod sensor_spec;
mod snapshot;
mod stamp;
mod standing_state;
mod street;
mod street_lights;
mod traffic;
mod v2x;
mod vehicle;

pub use actor::{
    ACTORS_MAX, ActorId, ActorState, Pose, STRIDE, VehicleControl, flag, kind, lamp, light, parts,
};
pub use bones::{BONES, BONES_PER_COMMAND, BlendPose, GivenPose, GivenPoses, SetBones};
pub use command::{
    Answer, Autopilot, BatchHeader, Command, CommandGroup, CreateBundle, HideLayers, HideObjects,
    JournalEntry, JournalHeader, Nothing, Outcome, ROUTE_STEPS, RawCommand, RouteCommand,
    RouteStep, SensorCommand, ServiceCommand, SetDoors, SetPhysics, SetTrafficLight,
    SetVehicleLights, SetVelocity, Settings, Spawn, StandingCommand, Teleport, TrafficParam,
    Weather, WorldCommand, layer, param, route_step, status,
};
pub use debug_shapes::DebugShapes;
pub use drawing::{EraseShapes, SHAPE_TEXT_BYTES, SHAPES_MAX, Shape, ShapeReceipt, shape};
pub use episode::{BlueprintInfo, Episode, LoadMap, load};
pub use hidden_objects::{BLOCK_OBJECTS, HiddenObjects};
pub use limbs::{LIMBS, WalkerLimbs};
pub use motion::{
    AckermannControl, AckermannSettings, ApplyForce, SetWeatherAffectsGrip, Switch,
    VehicleTelemetry, WheelTelemetry,
};
pub use name::Name;
pub use payload::{Block, Page};
pub use physics_sensor::{
    CollisionReading, CollisionSpec, GnssReading, GnssSpec, ImuReading, ImuSpec,
    LaneInvasionReading, LaneInvasionSpec, ObstacleReading, ObstacleSpec, OdometryReading,
    OdometrySpec, PhysicsSensorSpec, Reading, geodesy,
};
pub use query::{Query, QueryHeader, QueryKind, Response, ResponseBody};
pub use recording::{FilePath, StartRecorder, StartReplay, StopReplay};
pub use sensor_spec::{
    BundleHeader, BundleId, DEPTH_FAR_M, Plane, SENSORS_MAX, SensorSpec, element_bytes, layout,
    output, point_attribute, sensor, tracer,
};
pub use snapshot::{PIPELINE_MAX, SnapshotHeader};
pub use stamp::{Frame, Stamp};
pub use standing_state::StandingState;
pub use street::{SetStreetLights, street_light};
pub use street_lights::{StreetLightState, StreetLights};
pub use traffic::{LightState, TrafficHeader, TrafficLayout};
pub use v2x::{
    CamReading, CamSpec, MessageReading, MessageSpec, RadioSpec, TEXT_BYTES, Transmit, radio,
};
pub use vehicle::{
    CURVE_POINTS_MAX, Curve, GEARS_MAX, Gear, VehicleBody, VehicleEngine, VehicleGearbox,
    VehiclePhysics, VehicleSteering, VehicleWheel,
};
