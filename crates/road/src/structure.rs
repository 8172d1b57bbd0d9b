//! Structures on and over roads that the file describes.

use glam::DVec3;
use mesh::{Mesh, Tag};

/// A structure: a piece of a guard rail, a wall, a building of the file. World space.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// Its semantic tag.
    pub tag: Tag,
    /// Whether it is part of the ground, such as a bridge's deck, and cannot be hidden.
    pub is_ground: bool,
    /// Closed bodies; all faces are of object 0.
    pub mesh: Mesh,
    /// Boxes that collide.
    pub solids: Vec<Solid>,
}

/// A solid box. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Centre of the box.
    pub center: DVec3,
    /// Half of its size along its own x, y and z.
    pub half_extents_m: DVec3,
    /// Rotation about z.
    pub yaw_rad: f64,
}
