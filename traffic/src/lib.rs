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

mod planner;
mod run;
mod state;
mod vehicle_plan;

mod approach;
mod body;
mod conflict;
mod grid;
mod map;
mod roundabout;
mod signals;
mod swept_path;
mod tracks;

mod agents;
mod car_following;
mod client_route;
mod constraint;
mod demand;
mod detectors;
mod junction;
mod lamps;
mod lane_change;
mod leader;
mod obstacles;
mod occupancy;
mod params;
mod pedals;
mod random;
mod recover;
mod route;
mod steer;
mod vehicle_table;

#[cfg(test)]
mod tests;

pub use constraint::WaitReason;
pub use planner::Planner;
pub use run::{TrafficError, run};
pub use state::RestoreError;
pub use vehicle_plan::VehiclePlan;
