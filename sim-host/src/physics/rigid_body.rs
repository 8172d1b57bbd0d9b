//! The motion of a rapier body in the terms of [`Motion`] and of snapshots.

use glam::{Mat3, Quat, Vec3};
use protocol::{Pose as BusPose, SPEED_MAX_MPS, parts};
use rapier3d::prelude::{Pose, RigidBody};

use super::{
    limits::SPIN_MAX_RADPS,
    motion::{Motion, Twist, Wrench},
};

/// Returns the velocity of the body's origin. Rapier's is that of the centre of mass.
pub(super) fn origin_mps(body: &RigidBody) -> Vec3 {
    body.velocity_at_point(body.translation())
}

pub(super) fn motion_of(body: &RigidBody, gravity_mps2: f32) -> Motion {
    Motion {
        com_m: body.center_of_mass(),
        axes: Mat3::from_quat(*body.rotation()),
        velocity_mps: body.linvel(),
        spin_radps: body.angvel(),
        gravity_mps2,
    }
}

/// Sets the force of one substep. Rapier keeps forces, so those of the previous substep are
/// cleared.
pub(super) fn apply(body: &mut RigidBody, wrench: &Wrench) {
    body.reset_forces(false);
    body.reset_torques(false);
    body.add_force(wrench.force_n, true);
    body.add_torque(wrench.torque_nm, true);
}

/// Limits the speeds of a body, which impulses and contacts have changed.
pub(super) fn limit_speeds(body: &mut RigidBody) {
    let (velocity, spin) = (body.linvel(), body.angvel());
    if velocity.length_squared() > SPEED_MAX_MPS * SPEED_MAX_MPS {
        body.set_linvel(velocity.clamp_length_max(SPEED_MAX_MPS), true);
    }
    if spin.length_squared() > SPIN_MAX_RADPS * SPIN_MAX_RADPS {
        body.set_angvel(spin.clamp_length_max(SPIN_MAX_RADPS), true);
    }
}

/// Returns the pose of a kinematic body after `dt` at a velocity.
pub(super) fn moved(from: &Pose, velocity: Twist, dt: f32) -> Pose {
    let turn = Quat::from_scaled_axis(velocity.angular_radps * dt) * from.rotation;
    let place = from.translation + velocity.linear_mps * dt;
    Pose::from_parts(place, turn.normalize())
}

/// Returns the velocity of a body's origin as snapshots hold it.
pub(super) fn published_velocity_mps(body: &RigidBody) -> Vec3 {
    rounded_mps(origin_mps(body))
}

/// Returns a velocity as snapshots hold it.
pub(super) fn rounded_mps(velocity: Vec3) -> Vec3 {
    Vec3::from_array(velocity.to_array().map(|v| rounded(v, parts::MOTION)))
}

/// Rounds to multiples of 1/`parts`; the result is never −0.
pub(super) fn rounded(value: f32, parts: u32) -> f32 {
    /// Numbers from here on have no fraction, so adding this rounds.
    const WHOLE: f32 = 8_388_608.0;
    let parts = parts as f32;
    let scaled = (value * parts).abs();
    // Larger numbers are multiples already, unless they are not finite.
    if scaled < WHOLE {
        let whole = (scaled + WHOLE) - WHOLE;
        (whole / parts).copysign(value) + 0.0
    } else {
        value
    }
}

/// Returns a pose of a message as a pose of rapier.
pub(super) fn body_pose(pose: &BusPose) -> Pose {
    Pose::from_parts(pose.position(), pose.rotation().normalize())
}
