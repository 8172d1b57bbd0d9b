//! The bus: what is said, where, and by whom.
//!
//! This crate is the contract between processes. It holds plain data, the table of channels and
//! their ports, and the words of the tick barrier; it makes no decisions.
//!
//! Everything is SI and radians, right-handed, z up; names carry their units.

mod actor;
mod bones;
mod born;
mod command;
mod drawing;
mod limbs;
mod motion;
mod name;
mod recording;
mod rig;
mod snapshot;
mod stamp;
mod street;
mod traffic;
mod v2x;
mod vehicle;

pub use actor::{
    ACTORS_MAX, ActorId, ActorState, Pose, STRIDE, VehicleControl, flag, kind, lamp, light, parts,
};
pub use bones::{BONES, BlendPose, GivenPose, GivenPoses, SetBones, WISH_BONES};
pub use born::{
    BornSpec, CollisionReading, CollisionSpec, GnssReading, GnssSpec, ImuReading, ImuSpec,
    LaneInvasionReading, LaneInvasionSpec, ObstacleReading, ObstacleSpec, OdometryReading,
    OdometrySpec, Reading, geodesy,
};
pub use command::{
    Answer, Autopilot, BatchHeader, Command, CreateRig, GUIDE_STEPS, Guide, GuideStep, HideLayers,
    HideObjects, HoldLight, JournalEntry, JournalHeader, Nothing, Outcome, SetDoors, SetLamps,
    SetPhysics, SetVelocity, Settings, Spawn, Teleport, TrafficDial, Weather, Wish, dial, guide,
    layer, status,
};
pub use drawing::{Drawn, Erase, SHAPE_TEXT_BYTES, SHAPES_MAX, Shape, shape};
pub use limbs::LIMBS;
pub use motion::{
    AckermannControl, AckermannSettings, Ask, FeelWeather, Push, Switch, VehicleTelemetry,
    WheelTelemetry, part,
};
pub use name::Name;
pub use recording::{FilePath, StartRecorder, StartReplay, StopReplay};
pub use rig::{
    BundleHeader, DEPTH_FAR_M, Plane, RigId, SENSORS_MAX, SensorSpec, element_bytes, fourth,
    layout, output, sensor, tracer,
};
pub use snapshot::{PIPELINE_MAX, SnapshotHeader};
pub use stamp::{Frame, Stamp};
pub use street::{SwitchLamps, shine};
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
pub use instance::{Founding, Instance, free_bytes};
pub use journal::{Event, Journal};
pub use map::{CONTROL_LEN, Control};
pub use participant::{Interrupted, Participant, Watch};
pub use port::{Block, Element, Founded, Header, Hub, Loan, Page, Reader, Sample, Writer};
pub use ports::{
    Bundle, ClientPorts, HostPorts, RenderPorts, Snapshot, TrafficPorts, TrafficSample,
};
pub use wait::{Bell, Gate, Strategy};

#[cfg(test)]
mod loom_tests;
