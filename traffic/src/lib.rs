//! The planner of traffic: vehicles and walkers on autopilot, and the signal plan of traffic lights.
//!
//! It reads snapshot N and returns controls that act in N + 1. It uses no bus and no clock: the
//! same map, seed and sequence of snapshots give the same bits.
//!
//! ```text
//! snapshot ─▶ agents ─▶ locate on routes ─▶ occupancy of tracks ─▶ junctions ─▶ leaders
//!                                                                                  │
//!          controls ◀─ pedals, steering ◀─ car following, recovery ◀─ passing, lane changes ◀┘
//! ```
//!
//! SI units and radians; world space is right-handed with z up. Distances along lanes are arc
//! lengths in driving direction; lateral offsets are positive to the left.

mod planner;
mod run;
mod state;
mod vehicle_plan;

mod approach;
mod beside;
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
mod drive;
mod drivers;
mod emergency;
mod junction;
mod lamps;
mod lane_change;
mod leader;
mod meeting;
mod merging;
mod neighbours;
mod obstacles;
mod occupancy;
mod params;
mod passing;
mod pedals;
mod prop_extent;
mod prop_waits;
mod random;
mod reaction;
mod recover;
mod route;
mod spread;
mod standstill;
mod steer;
mod vehicle_table;
mod walkers;

#[cfg(test)]
mod tests;

pub use constraint::WaitReason;
pub use planner::Planner;
pub use prop_waits::PropWait;
pub use run::{TrafficError, run};
pub use standstill::{QueueHead, Standstill, WaitCause};
pub use state::RestoreError;
pub use vehicle_plan::{IntendedMotion, VehiclePlan};
