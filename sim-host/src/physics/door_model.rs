//! A door that stands open, and the force of the air on it.

use glam::{Quat, Vec3};
use rapier3d::prelude::ColliderHandle;
use serde::{Deserialize, Serialize};

use super::{
    aerodynamics::AIR_DENSITY_KGPM3,
    motion::{Motion, Wrench},
};

/// Force of the air on a plate that faces it, as a share of pressure times area (Hoerner,
/// Fluid-Dynamic Drag, section 3-5).
const PLATE: f32 = 1.17;

/// A door as it stands when it is open, in vehicle space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DoorModel {
    /// Which: a bit of [`protocol::ActorState::doors`].
    pub number: u32,
    /// The box's middle.
    pub middle_m: Vec3,
    /// Half the edges, in the door's axes: along the shut door, across it, up.
    pub half_extents_m: Vec3,
    /// From the door's axes to the vehicle's.
    pub turn: Quat,
}

/// One that stands open, and its box in the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct OpenDoor {
    pub model: DoorModel,
    pub collider: ColliderHandle,
}

impl OpenDoor {
    /// Adds how the air presses on it. `com_m` is the centre of mass in vehicle space.
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
