//! Contacts between bodies as they are reported and remembered.

use glam::Vec3;
use protocol::ActorId;
use serde::{Deserialize, Serialize};

/// Two that touched during a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// The one with the lower id.
    pub actor: ActorId,
    /// The other; [`ActorId::NONE`] if it is a static box.
    pub other: ActorId,
    /// Which static box.
    pub static_box: Option<u32>,
    /// What `actor` was given over the frame, in world space. Newton seconds.
    pub impulse_ns: Vec3,
    /// They did not touch at the end of the frame before.
    pub began: bool,
}

/// Who touches whom: an actor, and an actor or a static box.
pub(super) type Pair = (u32, Touched);

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum Touched {
    Actor(u32),
    Static(u32),
}
