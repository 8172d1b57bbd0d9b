//! The host: the world as it is, the tick, and the processes that take part in it.
//!
//! ```text
//! processes ──slots──▶ Host ──▶ Supervisor (start, watch, clean up)
//! commands ──▶ Inbox ──▶ Host::tick ──▶ World ──▶ Physics
//!                        │
//!                        └──▶ journal, snapshot ──▶ everybody
//! ```
//!
//! World space is right-handed, z up; metres, radians, seconds; f32 around the map's local origin.
//! Start reading at `tick.rs`.

mod tick;

mod barrier;
mod bundles;
mod drawings;
mod error;
mod hash;
mod host;
mod journal;
mod models;
pub mod physics;
mod physics_sensors;
mod saved;
mod standing;
mod supervisor;
mod world;

pub use drawings::SavedShape;
pub use error::HostError;
pub use host::{Host, HostConfig, Maps};
pub use saved::{Pending, SavedState, StateError, decision_hash, map_sum};
pub use supervisor::{Launcher, Stage};
pub use world::World;
