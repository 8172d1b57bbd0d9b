//! The solid boxes of the map, and the tree that finds them.

use glam::{Quat, Vec3};
use rapier3d::{
    parry::{
        partitioning::{Bvh, BvhBuildStrategy},
        shape::{Cuboid, Shape},
    },
    prelude::{Aabb, Pose},
};

use super::overlap::touch;

/// A solid box that never moves: a building, a pole, a trunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticBox {
    /// In world space.
    pub center: Vec3,
    /// Half the edges, in the box's axes.
    pub half_extents_m: Vec3,
    /// About z.
    pub yaw_rad: f32,
}

impl StaticBox {
    pub(super) fn pose(&self) -> Pose {
        Pose::from_parts(self.center, Quat::from_rotation_z(self.yaw_rad))
    }
}

/// The boxes that never move, sorted in a tree.
pub(super) struct StaticBoxes {
    boxes: Vec<(Pose, Cuboid)>,
    tree: Bvh,
    enabled: Vec<bool>,
}

impl StaticBoxes {
    pub(super) fn new(boxes: &[StaticBox]) -> StaticBoxes {
        let boxes: Vec<_> =
            boxes.iter().map(|b| (b.pose(), Cuboid::new(b.half_extents_m))).collect();
        let bounds: Vec<Aabb> = boxes.iter().map(|(pose, shape)| shape.aabb(pose)).collect();
        let enabled = vec![true; boxes.len()];
        StaticBoxes { boxes, tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds), enabled }
    }

    /// Says whether that is news.
    pub(super) fn set_enabled(&mut self, index: usize, enabled: bool) -> bool {
        std::mem::replace(&mut self.enabled[index], enabled) != enabled
    }

    /// A box that the shape touches: the one with the lowest index.
    pub(super) fn touching(&self, pose: &Pose, shape: &dyn Shape) -> Option<usize> {
        let bounds = shape.compute_aabb(pose);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        near.filter(|&i| self.enabled[i] && touch(pose, shape, &self.boxes[i].0, &self.boxes[i].1))
            .min()
    }

    /// Those that a shape may touch on its way from one pose to another, by index.
    pub(super) fn near_sweep(&self, shape: &dyn Shape, from: &Pose, to: &Pose) -> Vec<usize> {
        let bounds = shape.compute_swept_aabb(from, to);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        let mut near: Vec<usize> = near.filter(|&i| self.enabled[i]).collect();
        near.sort_unstable();
        near
    }

    /// One of them.
    pub(super) fn shape(&self, index: usize) -> (&Pose, &dyn Shape) {
        let (pose, shape) = &self.boxes[index];
        (pose, shape)
    }

    /// What to call it.
    pub(super) fn name(&self, index: usize) -> &'static str {
        let half = self.boxes[index].1.half_extents;
        if half.x.max(half.y) > 1.5 { "a building" } else { "a pole, trunk or wall" }
    }
}
