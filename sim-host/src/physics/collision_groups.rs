//! Collision groups of the rigid-body world.

use rapier3d::prelude::{Group, InteractionGroups, InteractionTestMode};

/// All that is solid, but for limbs and their floors.
pub(super) const SOLID: InteractionGroups =
    InteractionGroups::new(Group::GROUP_1, Group::ALL, InteractionTestMode::And);
