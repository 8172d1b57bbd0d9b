//! The whole mind at the wheel of simple vehicles.

mod course;
mod dials;
mod driving;
mod guide;
mod junctions;
mod lights;
pub(crate) mod maps;
mod restart;
