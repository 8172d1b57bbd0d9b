//! The messages of the bus: layouts, ids and enums, without a transport.
//!
//! Every message is plain old data (`#[repr(C)]`, [`bytemuck::Pod`]) and is read in the memory in
//! which it was written. Values are SI units and radians, right-handed, z up; the names of fields
//! carry their units. [`Command`] is what changes a world, [`ActorState`] what a snapshot holds,
//! [`SensorSpec`] what a sensor measures.

mod actor;
mod actor_command;
mod bones;
mod build;
mod bundle_receipt;
mod check;
mod command;
mod debug_shapes;
mod drawing;
mod effects;
mod episode;
mod given_poses;
mod hidden_objects;
mod journal;
mod lens;
mod lidar_spec;
mod limbs;
mod map_layer;
mod motion;
mod name;
mod outcome;
mod payload;
mod physics_sensor;
mod projection;
mod query;
mod range;
mod recording;
mod refusal;
mod route;
mod sensor_code;
mod sensor_spec;
mod settings;
mod snapshot;
mod stamp;
mod standing_state;
mod street;
mod street_lights;
mod traffic;
mod traffic_param;
mod v2x;
mod vehicle;
mod vehicle_physics;
mod weather;

pub use actor::{
    ACTORS_MAX, ActorId, ActorState, Pose, STRIDE, VehicleControl, flag, kind, lamp, light, parts,
};
pub use actor_command::{
    Autopilot, BODY_LIFE_NANOS, LIE_NANOS, SetDead, SetDoors, SetPhysics, SetTrafficLight,
    SetVehicleLights, SetVelocity, Spawn, Teleport,
};
pub use bones::{BONES, BONES_PER_COMMAND, BlendPose, SetBones};
pub use build::{BUILD, VERSION};
pub use bundle_receipt::BundleReceipt;
pub use check::{PLACE_MAX_M, SPEED_MAX_MPS};
pub use command::{
    BATCH_MAX, BatchHeader, Command, CommandGroup, Nothing, RawCommand, SensorCommand,
    ServiceCommand, StandingCommand, WorldCommand,
};
pub use debug_shapes::DebugShapes;
pub use drawing::{EraseShapes, SHAPE_TEXT_BYTES, SHAPES_MAX, Shape, ShapeReceipt, shape};
pub use effects::{EffectsSpec, exposure};
pub use episode::{BlueprintInfo, Episode, LoadMap, load};
pub use given_poses::{GivenPose, GivenPoses};
pub use hidden_objects::{BLOCK_OBJECTS, HiddenObjects};
pub use journal::{JOURNAL_PART_MAX, JournalEntry, JournalHeader};
pub use lens::{LensSpec, lens_model};
pub use lidar_spec::{ELEVATION_STEP_RAD, ELEVATIONS_MAX, LidarSpec, lidar_flag};
pub use limbs::{LIMBS, WalkerLimbs};
pub use map_layer::{HideLayers, HideObjects, layer};
pub use motion::{
    AckermannControl, AckermannSettings, ApplyForce, SetWeatherAffectsGrip, Switch,
    VehicleTelemetry, WheelTelemetry,
};
pub use name::Name;
pub use outcome::{Answer, Outcome, status};
pub use payload::{Block, Page};
pub use physics_sensor::{
    CollisionReading, CollisionSpec, GnssReading, GnssSpec, ImuReading, ImuSpec,
    LaneInvasionReading, LaneInvasionSpec, ObstacleReading, ObstacleSpec, OdometryReading,
    OdometrySpec, PhysicsSensorSpec, Reading, geodesy,
};
pub use projection::{LENS_STEPS, Projection};
pub use query::{Query, QueryHeader, QueryKind, Response, ResponseBody};
pub use recording::{FilePath, StartRecorder, StartReplay, StopReplay};
pub use refusal::{Refusal, RefusalCode};
pub use route::{ROUTE_STEPS, RouteCommand, RouteStep, route_step};
pub use sensor_code::{
    BundleId, CreateBundle, DEPTH_FAR_M, SENSORS_MAX, output, point_attribute, quality, sensor,
    tracer,
};
pub use sensor_spec::{BundleHeader, Plane, SensorSpec, element_bytes, layout};
pub use settings::Settings;
pub use snapshot::{PIPELINE_MAX, SnapshotHeader};
pub use stamp::{Frame, Stamp};
pub use standing_state::StandingState;
pub use street::{SetStreetLights, street_light};
pub use street_lights::{StreetLightState, StreetLights};
pub use traffic::{LightState, TrafficHeader, TrafficLayout, TrafficParts, WalkerControl};
pub use traffic_param::{HYBRID_RADIUS_M, TrafficParam, param};
pub use v2x::{
    CamReading, CamSpec, MessageReading, MessageSpec, RadioSpec, TEXT_BYTES, Transmit, radio,
};
pub use vehicle::{
    CURVE_POINTS_MAX, Curve, GEARS_MAX, Gear, VehicleBody, VehicleEngine, VehicleGearbox,
    VehicleSteering, VehicleWheel,
};
pub use vehicle_physics::VehiclePhysics;
pub use weather::Weather;
