//! OpenDRIVE towns out of a seed.
//!
//! [`generate`] writes the OpenDRIVE text of a [`Plan`]; [`named`] writes the text of a town that
//! ships under a name. A layout of streets is drawn first, its crossings become junctions, and both
//! are write_plan as OpenDRIVE 1.4. The same plan gives the same text on every machine.
//!
//! The text is right-handed, z up; metres, radians and, where OpenDRIVE says so, kilometres per hour.

mod curve;
mod generate;
mod junction;
mod lattice;
mod layout;
mod layouts;
mod names;
mod plan;
mod relief;
mod street;
mod write;

#[cfg(test)]
mod tests;

pub use generate::generate;
pub use names::{carla_names, default_map, description, named, names};
pub use plan::{Character, Plan};
