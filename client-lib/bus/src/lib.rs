//! The bus: what is said, where, and by whom.
//!
//! This crate is the contract between processes. It holds plain data, the table of channels and
//! their ports, and the words of the tick barrier; it makes no decisions.
//!
//! Everything is SI and radians, right-handed, z up; names carry their units.

mod actor;
mod command;
mod name;
mod rig;
mod snapshot;
mod stamp;
mod traffic;

pub use actor::{ACTORS_MAX, ActorId, ActorState, Pose, VehicleControl, flag, kind, light};
pub use command::{
    Autopilot, BatchHeader, Command, CreateRig, JournalEntry, JournalHeader, Outcome, SetVelocity,
    Settings, Spawn, Teleport, TrafficDial, Weather, Wish, dial, status,
};
pub use name::Name;
pub use rig::{
    BundleHeader, DEPTH_FAR_M, Plane, RigId, SENSORS_MAX, SensorSpec, element_bytes, layout,
    output, sensor, tracer,
};
pub use snapshot::{PIPELINE_MAX, SnapshotHeader};
pub use stamp::{Frame, Stamp};
pub use traffic::{LightState, TrafficHeader};
