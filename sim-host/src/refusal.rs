//! The refusals that errors of the physics engine become.

use protocol::Refusal;

use crate::physics::PhysicsError;

impl From<PhysicsError> for Refusal {
    fn from(error: PhysicsError) -> Refusal {
        let reason = error.to_string();
        match error {
            PhysicsError::Unknown(_) => Refusal::unknown_actor(reason),
            PhysicsError::Blocked { .. } => Refusal::spawn_collision(reason),
            PhysicsError::Bad { .. }
            | PhysicsError::Refused(..)
            | PhysicsError::WheelCount { .. } => Refusal::out_of_range(reason),
            PhysicsError::WrongKind(..) => Refusal::wrong_kind(reason),
            PhysicsError::Fallen(_) | PhysicsError::DoorBlocked { .. } => {
                Refusal::wrong_state(reason)
            }
            PhysicsError::NoWheel { .. } => Refusal::not_found(reason),
            PhysicsError::Taken(_) | PhysicsError::Damaged(_) => Refusal::other(reason),
        }
    }
}
