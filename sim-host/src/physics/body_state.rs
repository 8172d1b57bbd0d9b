//! The state of a body as a value.

use glam::Vec3;
use rapier3d::prelude::{Pose, RigidBody};

use super::motion::Twist;

/// The pose and velocity of a body at one moment, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BodyState {
    pub pose: Pose,
    /// Velocity of the centre of mass, and angular velocity.
    pub velocity: Twist,
}

impl BodyState {
    pub(super) fn of(body: &RigidBody) -> BodyState {
        let velocity = Twist { linear_mps: body.linvel(), angular_radps: body.angvel() };
        BodyState { pose: *body.position(), velocity }
    }

    /// Returns the velocity of the origin of a body whose centre of mass is at `com_m` in body
    /// axes.
    pub(super) fn origin_mps(&self, com_m: Vec3) -> Vec3 {
        let arm = self.pose.rotation * com_m;
        self.velocity.linear_mps - self.velocity.angular_radps.cross(arm)
    }

    /// Writes the state into a body, without waking it.
    pub(super) fn write(&self, body: &mut RigidBody) {
        body.set_position(self.pose, false);
        body.set_linvel(self.velocity.linear_mps, false);
        body.set_angvel(self.velocity.angular_radps, false);
    }
}
