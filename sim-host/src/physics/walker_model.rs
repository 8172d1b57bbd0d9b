//! The size and mass of a walker.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Height of the capsule's lower end above the feet.
const CLEAR_M: f32 = 0.05;

/// The size of a walker. The origin is on the ground between the feet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkerModel {
    /// Half the width.
    pub radius_m: f32,
    /// Height from the soles to the top of the head.
    pub height_m: f32,
    /// Body mass.
    pub mass_kg: f32,
    /// Whether the walker falls when it is hit.
    pub is_ragdoll_on_hit: bool,
    /// Whether the walker stands up [`protocol::LIE_NANOS`] after a fall.
    pub gets_up_after_fall: bool,
}

impl WalkerModel {
    /// Returns half the length of the cylindrical part of the capsule.
    pub(super) fn half_segment_m(&self) -> f32 {
        (self.height_m / 2.0 - self.radius_m).max(0.01)
    }

    /// Returns the centre of the capsule, which is the centre of mass.
    pub(super) fn middle_m(&self) -> Vec3 {
        Vec3::Z * (self.height_m / 2.0 + CLEAR_M)
    }

    /// Returns the principal moments of inertia about the centre of mass of a standing walker.
    pub(super) fn inertia_kgm2(&self) -> Vec3 {
        let half = Vec3::new(0.4 * self.radius_m, 0.4 * self.radius_m, self.height_m / 2.0);
        let square = half * half;
        Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y)
            * (self.mass_kg / 3.0)
    }
}
