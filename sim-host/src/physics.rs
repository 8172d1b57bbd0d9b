//! Physics: where everything is, and how it moves.
//!
//! [`Physics`] owns a rapier world for rigid bodies and their contacts with each other, a
//! [`Ground`] that wheels, feet and corners stand on, and our own vehicle model in between. One
//! [`Physics::step`] advances a frame in equal substeps:
//!
//! ```text
//! for each substep
//!   for each actor, by id
//!     look at the ground under its wheels, feet or corners
//!     move a copy through sub-iterations of 2.5 ms: suspension, tyres, drivetrain, air
//!     hand the mean force and torque to its body
//!   rapier: contacts between bodies, velocities, poses
//!   note who touched whom, how hard
//! ```
//!
//! Vehicle and world space are as on the bus: right-handed, z up, x forward, y left, SI, radians.
//! Nothing here reads a clock or draws a random number: the same calls give the same bits.

mod ackermann;
mod actor;
mod actor_list;
mod aerodynamics;
mod blueprint;
mod classes;
mod collision;
mod collision_groups;
mod commands;
mod contact;
mod digest;
mod door_model;
mod doors;
mod drivetrain;
mod error;
mod ground;
mod lanes;
mod limits;
mod model;
mod motion;
mod outside;
mod overlap;
mod pedals;
mod prop;
mod published;
mod queries;
mod ragdoll;
mod rigid_body;
mod save;
mod spawn;
mod statics;
mod suspension;
mod synthetic_load;
mod telemetry;
mod tuning;
mod tyre;
mod vehicle;
mod walker;
mod walker_model;
mod wheels;
mod world;

#[cfg(test)]
mod tests;

pub use collision::Collision;
pub use door_model::DoorModel;
pub use error::PhysicsError;
pub use ground::{Ground, Hit};
pub use model::{
    Class, EngineModel, GRAVITY_MPS2, GearModel, GearboxModel, LeanModel, VehicleModel, WHEELS_MAX,
    WheelModel, WheelPlace,
};
pub use prop::PropModel;
pub use queries::{BodyMotion, CastHit};
pub use statics::StaticBox;
pub use synthetic_load::SyntheticLoad;
pub use tyre::TyreModel;
pub use walker_model::WalkerModel;
pub use world::Physics;
