//! Collision groups of the rigid-body world.

use rapier3d::prelude::{Group, InteractionGroups, InteractionTestMode};

/// Groups of a prop that vehicles drive over: it collides with static boxes only, which are in every
/// group.
pub(super) const PASSABLE: InteractionGroups =
    InteractionGroups::new(Group::GROUP_3, Group::GROUP_4, InteractionTestMode::And);

/// Group of every solid collider except limbs and their floors.
pub(super) const SOLID: InteractionGroups =
    InteractionGroups::new(Group::GROUP_1, Group::ALL, InteractionTestMode::And);
