//! The static world round the roads, what can be spawned into it, and maps out of a seed.
//!
//! [`furnish`] turns a road network into a whole town, [`catalogue`] lists every blueprint with
//! its mesh, [`generate`] writes the OpenDRIVE text of a town that nobody has drawn.
//!
//! Right-handed, z up, x forward, y left; metres and radians. No bus, no clock: the same
//! (map, seed) gives the same bytes. Only [`cache`] knows of a disk.

pub mod cache;
mod catalogue;
mod clay;
mod furnish;
mod generate;
mod random;

pub use catalogue::{
    Attribute, AttributeType, Blueprint, Bone, Given, Joint, Kind, LIMB_BONES, Looks, MeshFault,
    Motion, Posture, Rig, Skeleton, Wheel, blueprint, catalogue, replaced, stride_m,
};
pub use furnish::{
    BAKE_VERSION, BLOCK_OBJECTS, BakeError, Collider, Detail, Head, Lamp, Layer, Lighting, Object,
    Parked, StreetLightState, Town, Visibility, furnish, furnish_with,
};
pub use generate::{Character, Plan, about, alike, default_map, generate, named, names};
