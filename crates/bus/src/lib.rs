//! The bus: what is said, where, and by whom.
//!
//! This crate is the contract between processes. It holds plain data, the table of channels and
//! their ports, and the words of the tick barrier; it makes no decisions.
//!
//! Everything is SI and radians, right-handed, z up; names carry their units.

mod actor;
mod bones;
mod command;
mod drawing;
mod limbs;
mod motion;
mod name;
mod physics_sensor;
mod recording;
mod sensor_spec;
mod snapshot;
mod stamp;
mod street;
mod traffic;
mod v2x;
mod vehicle;

pub use actor::{
    ACTORS_MAX, ActorId, ActorState, Pose, STRIDE, VehicleControl, flag, kind, lamp, light, parts,
};
pub use bones::{BONES, BONES_PER_COMMAND, BlendPose, GivenPose, GivenPoses, SetBones};
pub use command::{
    Answer, Autopilot, BatchHeader, Command, CreateBundle, HideLayers, HideObjects, JournalEntry,
    JournalHeader, Nothing, Outcome, ROUTE_STEPS, RawCommand, RouteCommand, RouteStep, SetDoors,
    SetPhysics, SetTrafficLight, SetVehicleLights, SetVelocity, Settings, Spawn, Teleport,
    TrafficParam, Weather, guide, layer, param, status,
};
pub use drawing::{EraseShapes, SHAPE_TEXT_BYTES, SHAPES_MAX, Shape, ShapeReceipt, shape};
pub use limbs::LIMBS;
pub use motion::{
    AckermannControl, AckermannSettings, ApplyForce, Ask, SetWeatherAffectsGrip, Switch,
    VehicleTelemetry, WheelTelemetry, part,
};
pub use name::Name;
pub use physics_sensor::{
    CollisionReading, CollisionSpec, GnssReading, GnssSpec, ImuReading, ImuSpec,
    LaneInvasionReading, LaneInvasionSpec, ObstacleReading, ObstacleSpec, OdometryReading,
    OdometrySpec, PhysicsSensorSpec, Reading, geodesy,
};
pub use recording::{FilePath, StartRecorder, StartReplay, StopReplay};
pub use sensor_spec::{
    BundleHeader, BundleId, DEPTH_FAR_M, Plane, SENSORS_MAX, SensorSpec, element_bytes, layout,
    output, point_attribute, sensor, tracer,
};
pub use snapshot::{PIPELINE_MAX, SnapshotHeader};
pub use stamp::{Frame, Stamp};
pub use street::{SetStreetLights, shine};
pub use traffic::{LightState, TrafficHeader, TrafficLayout};
pub use v2x::{
    CamReading, CamSpec, MessageReading, MessageSpec, RadioSpec, TEXT_BYTES, Transmit, radio,
};
pub use vehicle::{
    CURVE_POINTS_MAX, Curve, GEARS_MAX, Gear, VehicleBody, VehicleEngine, VehicleGearbox,
    VehiclePhysics, VehicleSteering, VehicleWheel,
};

mod atoms;
mod channel;
pub mod clock;
mod control;
mod episode;
mod error;
pub mod fault;
mod instance;
mod journal;
mod map;
mod participant;
mod port;
mod ports;
pub mod process;
mod wait;

pub use channel::{CHANNELS, Channel, Loss, channel};
pub use control::{ControlPage, Ending, PROTOCOL, PageError, Role, SLOTS, Slot, SlotState};
pub use episode::{BlueprintInfo, Episode, LoadMap, load};
pub use error::BusError;
pub use instance::{Instance, OwnedInstance, free_bytes};
pub use journal::{Event, Journal};
pub use map::{CONTROL_LEN, Control};
pub use participant::{Interrupted, Participant, Watch};
pub use port::{Block, BusNode, Element, Header, Loan, OwnedService, Page, Reader, Sample, Writer};
pub use ports::{
    BundleSample, ClientPorts, HostPorts, RenderPorts, Snapshot, TrafficPorts, TrafficSample,
};
pub use wait::{Notify, SequenceEvent, Strategy};

#[cfg(test)]
mod loom_tests;
