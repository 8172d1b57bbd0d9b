//! Checks of poses and vectors that clients give, and the greatest speeds of bodies.

use glam::Vec3;
use protocol::{ActorId, PLACE_MAX_M, Pose};

use super::error::PhysicsError;

/// Largest angular speed of a body. Beyond it, the sub-iterations of a substep do not converge.
pub(super) const SPIN_MAX_RADPS: f32 = 1000.0;

pub(super) fn check_pose(id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
    let bad =
        |why| Err(PhysicsError::Bad { actor: id, what: "pose", value: format!("{pose:?}"), why });
    if !pose.is_valid() {
        return bad("not finite, or its quaternion is not of unit length");
    }
    if pose.position().abs().max_element() > PLACE_MAX_M {
        return bad("more than 50 km from the map's origin");
    }
    Ok(())
}

pub(super) fn check_length(
    id: ActorId,
    what: &'static str,
    v: Vec3,
    most: f32,
    why: &'static str,
) -> Result<(), PhysicsError> {
    // A length that is not finite fails this comparison.
    if v.length() <= most {
        return Ok(());
    }
    Err(PhysicsError::Bad { actor: id, what, value: v.to_string(), why })
}
