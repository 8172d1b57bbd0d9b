//! What stands on and over roads by the file's word.

use glam::DVec3;
use mesh::{Mesh, Tag};

/// A thing: a piece of a guard rail, a wall, a building of the file. World space.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// What it is.
    pub tag: Tag,
    /// It is part of the ground and no thing that can be switched off: a bridge's deck.
    pub is_ground: bool,
    /// Closed bodies; all faces are of object 0.
    pub mesh: Mesh,
    /// What nobody passes through.
    pub solids: Vec<Solid>,
}

/// A solid box. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Its middle.
    pub center: DVec3,
    /// Half its size along its own x, y and z.
    pub half_extents_m: DVec3,
    /// Its turn about z.
    pub yaw_rad: f64,
}
