//! The whole planner at the wheel of simple vehicles.

mod client_route;
mod course;
mod driving;
mod junctions;
mod lights;
pub(crate) mod maps;
mod params;
mod restart;
