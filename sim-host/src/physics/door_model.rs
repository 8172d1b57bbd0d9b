//! An open door, and the aerodynamic force on it.

use glam::{Quat, Vec3};
use rapier3d::prelude::ColliderHandle;
use serde::{Deserialize, Serialize};

use super::{
    aerodynamics::AIR_DENSITY_KGPM3,
    motion::{Motion, Wrench},
};

/// Normal-force coefficient of a plate that faces the flow (Hoerner, Fluid-Dynamic Drag, section
/// 3-5).
const PLATE: f32 = 1.17;

/// An open door, in vehicle space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DoorModel {
    /// Index of the door: a bit of [`protocol::ActorState::doors`].
    pub number: u32,
    /// Centre of the door's box.
    pub middle_m: Vec3,
    /// Half the edges, in door axes: along the closed door, across it, up.
    pub half_extents_m: Vec3,
    /// Rotation from door axes to vehicle axes.
    pub turn: Quat,
}

/// An open door and its collider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct OpenDoor {
    pub model: DoorModel,
    pub collider: ColliderHandle,
}

impl OpenDoor {
    /// Adds the aerodynamic force. `com_m` is the centre of mass in vehicle space.
    pub(super) fn add_drag(&self, com_m: Vec3, motion: &Motion, wrench: &mut Wrench) {
        let DoorModel { middle_m, half_extents_m: half, turn, .. } = self.model;
        let arm = motion.axes * (middle_m - com_m);
        let normal = motion.axes * (turn * Vec3::Y);
        let against_mps = motion.velocity_at(arm).dot(normal);
        let area_m2 = 4.0 * half.x * half.z;
        let force = 0.5 * AIR_DENSITY_KGPM3 * PLATE * area_m2 * against_mps * against_mps.abs();
        wrench.add(normal * -force, arm);
    }
}
