//! The whole planner at the wheel of simple vehicles.

mod course;
mod driving;
mod guide;
mod junctions;
mod lights;
pub(crate) mod maps;
mod params;
mod restart;
