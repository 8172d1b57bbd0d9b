//! A driving environment in one process: the simulation core and traffic without the bus, ego
//! vehicles on routes, observations and rewards.
//!
//! SI units, radians, right-handed: x forward, y left, z up.

mod birds_eye;
mod camera;
mod config;
mod course;
mod ego;
mod environment;
mod error;
mod kinematic;
mod lidar;
mod road_raster;
mod simulation;
#[cfg(test)]
mod tests;

pub use bake::Cache;
pub use birds_eye::{BIRDS_EYE_CHANNELS, BirdsEye};
pub use camera::{Camera, CameraOutput, CameraView};
pub use config::{Config, Physics, Reward};
pub use ego::{Action, Ego, Ending, STATE, Step};
pub use environment::{Environment, EnvironmentMap};
pub use error::EnvironmentError;
pub use simulation::Simulation;
