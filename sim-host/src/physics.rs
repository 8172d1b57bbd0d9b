//! The physics of actors: rigid bodies, vehicles, walkers and the ground.
//!
//! [`Physics`] owns a rapier world for rigid bodies and the contacts between them, a [`Ground`] for
//! the contact with wheels, feet and corners, and a vehicle model between the two. One
//! [`Physics::step`] advances a frame in equal substeps:
//!
//! ```text
//! for each vehicle that nothing is near, on any thread
//!   all substeps of the frame, alone
//! for each substep
//!   for each other actor, by id
//!     query the ground under its wheels, feet or corners
//!     move a copy through sub-iterations of 2.5 ms: suspension, tyres, drivetrain, air
//!     set the mean force and torque on its body
//!   rapier: contacts between bodies, velocities, poses
//!   add up the contact impulses of each pair
//! ```
//!
//! Vehicle and world space are those of messages: right-handed, z up, x forward, y left, SI,
//! radians. Nothing here reads a clock or draws a random number: equal calls give equal bits.

mod ackermann;
mod actor;
mod actor_list;
mod aerodynamics;
mod blueprint;
mod body_state;
mod bound;
mod classes;
mod collision;
mod collision_groups;
mod commands;
mod contact;
mod digest;
mod door_model;
mod doors;
mod dormant;
mod drivetrain;
mod error;
mod fleet;
mod forces;
mod ground;
mod hits;
mod kinematic;
mod lanes;
mod limits;
mod mark;
mod model;
mod motion;
mod obstacles;
mod overlap;
mod parallel;
mod pedals;
mod powertrain;
mod prop;
mod published;
mod queries;
mod ragdoll;
mod rigid_body;
mod save;
mod solo;
mod spawn;
mod stability;
mod statics;
mod suspension;
mod synthetic_load;
mod telemetry;
mod tuning;
mod tyre;
mod vehicle;
mod vehicle_settings;
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
pub use statics::{StaticBox, StaticBoxes};
pub use synthetic_load::SyntheticLoad;
pub use tyre::TyreModel;
pub use walker_model::WalkerModel;
pub use world::Physics;
