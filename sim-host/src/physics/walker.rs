//! People on foot: upright capsules that go where they are told, on the ground.

use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::ground::Ground;
use super::model::GRAVITY_MPS2;

/// The highest step that a walker takes without falling or being stopped.
const STEP_M: f32 = 0.4;
/// Nobody falls faster.
const FALL_MAX_MPS: f32 = 50.0;

/// A walker's size. The origin is on the ground between the feet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WalkerModel {
    /// Half the width.
    pub radius_m: f32,
    /// From the soles to the top of the head.
    pub height_m: f32,
    /// Body mass.
    pub mass_kg: f32,
}

impl WalkerModel {
    /// Half the length of the capsule's straight part.
    pub(super) fn half_segment_m(&self) -> f32 {
        (self.height_m / 2.0 - self.radius_m).max(0.01)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Walker {
    pub model: WalkerModel,
    /// Where to, over ground: metres per second.
    pub wish_mps: Vec2,
    pub fall_mps: f32,
    pub yaw_rad: f32,
}

impl Walker {
    /// Where the feet will be after `dt` seconds, and how the body is turned. `free` says whether a
    /// walker may stand at a place.
    pub(super) fn substep(
        &mut self,
        ground: &Ground,
        feet_m: Vec3,
        dt: f32,
        free: impl Fn(Vec3) -> bool,
    ) -> (Vec3, Quat) {
        let mut next = feet_m;
        if self.wish_mps != Vec2::ZERO {
            self.yaw_rad = self.wish_mps.y.atan2(self.wish_mps.x);
            let stepped = feet_m + (self.wish_mps * dt).extend(0.0);
            if free(stepped) {
                next = stepped;
            }
        }
        let hit = ground.below(next.x, next.y, next.z + STEP_M);
        if next.z - hit.height_m > STEP_M {
            self.fall_mps = (self.fall_mps + GRAVITY_MPS2 * dt).min(FALL_MAX_MPS);
            next.z = (next.z - self.fall_mps * dt).max(hit.height_m);
        } else {
            self.fall_mps = 0.0;
            next.z = hit.height_m;
        }
        (next, Quat::from_rotation_z(self.yaw_rad))
    }
}
