//! The furnished world round a road network, and the catalogue of blueprints.
//!
//! [`furnish`] turns a road network into a whole town; [`catalogue`] lists every blueprint with its
//! mesh.
//!
//! Right-handed, z up, x forward, y left; metres and radians. No disk, bus or clock: the same map
//! and seed give the same bytes.

mod assembled;
mod catalogue;
mod furnish;
mod mesh_builder;
mod plants;
mod static_world;
mod subdivision;
mod visible;

pub use catalogue::{
    Attribute, AttributeType, Blueprint, Bone, Geometry, GivenPose, Joint, Kind, LIMB_BONES,
    MeshError, Motion, Posture, Rig, Skeleton, Wheel, blueprint, catalogue, replaced, stride_m,
};
pub use furnish::{furnish, furnish_with};
pub use plants::{plant_count, plant_mesh};
pub use static_world::{Collider, Detail, Head, Lamp, Layer, Object, Parked, Plant, Town};
