//! The minds of the other road users: vehicles on autopilot, and the plan of the traffic lights.
//!
//! Snapshot N in, controls that act in N + 1 out. No bus, no clock: the same map, seed and
//! sequence of snapshots give the same bits.
//!
//! ```text
//! snapshot ─▶ read ─▶ locate on routes ─▶ lay onto tracks ─▶ junctions ─▶ look ahead
//!                                                                            │
//!             controls ◀─ pedals, wheel ◀─ follow, steer, recover ◀─ change lanes
//! ```
//!
//! SI and radians; world space is right-handed with z up. Distances along lanes are arc lengths in
//! driving direction, lateral offsets are positive to the left.

mod agents;
mod approach;
mod body;
mod change;
mod conflict;
mod constraint;
mod demand;
mod detectors;
mod follow;
mod grid;
mod guide;
mod junction;
mod lamps;
mod leader;
mod map;
mod memory;
mod occupancy;
mod outlook;
mod params;
mod pedals;
mod planner;
mod random;
mod recover;
mod roundabout;
mod route;
mod rows;
mod run;
mod signals;
mod steer;
mod swath;
mod sweep;
#[cfg(test)]
mod tests;
mod tracks;

pub use constraint::Wait;
pub use memory::MindError;
pub use outlook::Outlook;
pub use planner::Planner;
pub use run::{TrafficError, run};
