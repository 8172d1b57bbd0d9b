//! Contacts between bodies as they are reported and remembered.

use glam::Vec3;
use protocol::ActorId;
use serde::{Deserialize, Serialize};

/// The contact of two actors, or of an actor and a static box, during one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// The actor with the lower id.
    pub actor: ActorId,
    /// The other actor; [`ActorId::NONE`] if it is a static box.
    pub other: ActorId,
    /// Index of the static box.
    pub static_box: Option<u32>,
    /// Impulse on `actor` over the frame, in world space. Newton seconds.
    pub impulse_ns: Vec3,
    /// Whether they did not touch at the end of the previous frame.
    pub began: bool,
}

/// A walker that a slow actor pushes aside. The actor is kept at a distance, so that the rigid-body
/// world does not know this contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Push {
    pub walker: u32,
    /// The actor that pushes.
    pub by: u32,
    /// Impulse of the walker on that actor, in world space. Newton seconds.
    pub impulse_ns: Vec3,
}

/// A pair in contact: an actor, and an actor or a static box.
pub(super) type Pair = (u32, Touched);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum Touched {
    Actor(u32),
    Static(u32),
}
