//! Traffic demand: which vehicle departs when and where, and which way it takes.
//!
//! ```text
//! .rou.xml ──elements──▶ flows, trips, vehicles ──by time──▶ departures
//!                                 network ──edges──▶ ways over lanes ──┘
//! ```
//!
//! The route files are those of SUMO on a net that netconvert made from the OpenDRIVE file of the
//! map: see [`edge`](crate::Edge) for the names of edges. SI units; world space, z up.

mod departure;
mod edge;
mod elements;
mod error;
mod expand;
mod way;

#[cfg(test)]
mod tests;

pub use departure::{Demand, DepartPosition, DepartSpeed, Departure, VehicleClass, VehicleType};
pub use edge::Edge;
pub use error::DemandError;
