//! The static world round the roads, and what can be spawned into it.
//!
//! [`furnish`] turns a road network into a whole town, [`catalogue`] lists every blueprint with
//! its mesh.
//!
//! Right-handed, z up, x forward, y left; metres and radians. No bus, no clock: the same
//! (map, seed) gives the same bytes.

mod assembled;
mod catalogue;
mod furnish;
mod lighting;
mod mesh_builder;
mod static_world;
mod visibility;

pub use catalogue::{
    Attribute, AttributeType, Blueprint, Bone, Given, Joint, Kind, LIMB_BONES, Looks, MeshFault,
    Motion, Posture, Rig, Skeleton, Wheel, blueprint, catalogue, replaced, stride_m,
};
pub use furnish::{furnish, furnish_with};
pub use lighting::{Lighting, StreetLightState};
pub use static_world::{Collider, Detail, Head, Lamp, Layer, Object, Parked, Town};
pub use visibility::Visibility;
