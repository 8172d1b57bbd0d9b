//! The motion of a rigid body inside one substep of the rigid-body world.
//!
//! Tyres and suspensions are too stiff for a substep of 10 ms. So each substep is divided into
//! sub-iterations in which a copy of the body moves under the forces on it; the rigid-body world
//! then gets the mean force, and both reach the same velocity.

use glam::{Mat3, Vec3};
use protocol::SPEED_MAX_MPS;
use serde::{Deserialize, Serialize};

use super::limits::SPIN_MAX_RADPS;

/// The state of a rigid body, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Centre of mass.
    pub com_m: Vec3,
    /// `world_from_body`, rotation only.
    pub axes: Mat3,
    pub velocity_mps: Vec3,
    pub spin_radps: Vec3,
    /// Gravity downwards; 0 for a body without gravity.
    pub gravity_mps2: f32,
}

/// A linear and an angular velocity, in world space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Twist {
    pub linear_mps: Vec3,
    pub angular_radps: Vec3,
}

impl Twist {
    pub(super) const ZERO: Twist = Twist { linear_mps: Vec3::ZERO, angular_radps: Vec3::ZERO };
}

/// A force that acts at the centre of mass, and a torque, in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Wrench {
    pub force_n: Vec3,
    pub torque_nm: Vec3,
}

impl Wrench {
    /// Adds a force that acts at `arm_m` from the centre of mass.
    #[inline]
    pub(super) fn add(&mut self, force_n: Vec3, arm_m: Vec3) {
        self.force_n += force_n;
        self.torque_nm += arm_m.cross(force_n);
    }
}

impl Motion {
    /// Returns the velocity of the body's point at `arm_m` from the centre of mass.
    #[inline]
    pub(super) fn velocity_at(&self, arm_m: Vec3) -> Vec3 {
        self.velocity_mps + self.spin_radps.cross(arm_m)
    }

    /// Advances by `dt` seconds under a force and gravity: semi-implicit Euler, as the rigid-body
    /// world does, with the same limits of speed.
    #[inline]
    pub(super) fn advance(&mut self, wrench: &Wrench, mass_kg: f32, inertia_kgm2: Vec3, dt: f32) {
        self.velocity_mps += (wrench.force_n / mass_kg - Vec3::Z * self.gravity_mps2) * dt;
        self.velocity_mps = self.velocity_mps.clamp_length_max(SPEED_MAX_MPS);
        let to_body = self.axes.transpose();
        let spin = to_body * self.spin_radps;
        let torque = to_body * wrench.torque_nm - spin.cross(spin * inertia_kgm2);
        self.spin_radps += self.axes * (torque / inertia_kgm2) * dt;
        self.spin_radps = self.spin_radps.clamp_length_max(SPIN_MAX_RADPS);
        self.com_m += self.velocity_mps * dt;
        let turn = self.spin_radps * dt;
        self.axes.x_axis += turn.cross(self.axes.x_axis);
        self.axes.y_axis += turn.cross(self.axes.y_axis);
        self.axes.z_axis += turn.cross(self.axes.z_axis);
    }
}
