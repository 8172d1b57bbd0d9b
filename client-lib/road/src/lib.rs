//! The road network: OpenDRIVE text in; lanes, waypoints and meshes out.
//!
//! Right-handed, z up, metres and radians, f64 around the map's own local origin; meshes are f32.
//! No disk, no bus, no clock.

mod surface;

pub use surface::{Face, Material, Mesh, Tag};
