//! The host: the world, the tick, and the processes that take part in it.
//!
//! ```text
//! processes ──slots──▶ Shell ──▶ Supervisor (start, watch, clean up)
//! commands ──▶ Inbox ──▶ Host::tick ──▶ Sim::step ──▶ World ──▶ Physics
//!                        │
//!                        └──▶ journal, snapshot ──▶ participants
//! ```
//!
//! World space is right-handed, z up; metres, radians, seconds; f32 around the map's local origin.
//! Start reading at `tick.rs`.

// The tests of this crate run over simulated processes.
#[cfg(test)]
extern crate simulated_bus as bus;

mod tick;

mod barrier;
mod bundles;
mod decision;
mod error;
mod flow;
mod host;
mod journal;
mod keyframes;
mod maps;
mod models;
pub mod physics;
mod physics_sensors;
mod processes;
mod progress;
mod recording;
mod refusal;
mod replay;
mod request;
mod saved;
#[cfg(test)]
mod schedules;
mod shell;
mod sim;
mod supervisor;
mod world;

pub use error::HostError;
pub use host::Host;
pub use maps::Maps;
pub use request::{Pending, Request};
pub use saved::{SavedState, StateError, decision_hash, map_sum};
pub use shell::{HostConfig, OnStall};
pub use sim::{Decision, Inputs, NoServices, Outputs, Services, Sim};
pub use supervisor::{Launcher, Stage};
pub use world::World;
