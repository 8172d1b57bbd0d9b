//! A driving environment in one process: the simulation core and traffic without the bus, an ego
//! vehicle on a route, observations and rewards.
//!
//! SI units, radians, right-handed: x forward, y left, z up.

mod course;
mod environment;
mod error;
mod lidar;
mod simulation;
#[cfg(test)]
mod tests;

pub use bake::Cache;
pub use environment::{Config, Ending, Environment, EnvironmentMap, Reward, STATE, Step};
pub use error::EnvironmentError;
pub use simulation::Simulation;
