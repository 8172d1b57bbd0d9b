//! Tests of the whole planner, which drives vehicles of a simple model.

mod client_route;
pub(crate) mod course;
mod driving;
mod flow;
mod junctions;
mod lights;
pub(crate) mod maps;
mod params;
mod passing;
mod restart;
mod walkers;
