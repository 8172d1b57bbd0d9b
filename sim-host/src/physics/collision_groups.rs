//! Collision groups of the rigid-body world.

use rapier3d::prelude::{Group, InteractionGroups, InteractionTestMode};

/// Group of every solid collider except limbs and their floors.
pub(super) const SOLID: InteractionGroups =
    InteractionGroups::new(Group::GROUP_1, Group::ALL, InteractionTestMode::And);
