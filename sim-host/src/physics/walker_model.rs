//! The size and mass of a walker.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Feet are this far above the capsule's lower end.
const CLEAR_M: f32 = 0.05;

/// A walker's size. The origin is on the ground between the feet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkerModel {
    /// Half the width.
    pub radius_m: f32,
    /// From the soles to the top of the head.
    pub height_m: f32,
    /// Body mass.
    pub mass_kg: f32,
    /// Falls when it is hit.
    pub is_ragdoll_on_hit: bool,
}

impl WalkerModel {
    /// Half the length of the capsule's straight part.
    pub(super) fn half_segment_m(&self) -> f32 {
        (self.height_m / 2.0 - self.radius_m).max(0.01)
    }

    /// The capsule's middle, and the centre of mass.
    pub(super) fn middle_m(&self) -> Vec3 {
        Vec3::Z * (self.height_m / 2.0 + CLEAR_M)
    }

    /// About that middle, while it stands.
    pub(super) fn inertia_kgm2(&self) -> Vec3 {
        let half = Vec3::new(0.4 * self.radius_m, 0.4 * self.radius_m, self.height_m / 2.0);
        let square = half * half;
        Vec3::new(square.y + square.z, square.x + square.z, square.x + square.y)
            * (self.mass_kg / 3.0)
    }
}
