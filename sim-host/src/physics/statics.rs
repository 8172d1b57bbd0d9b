//! The static boxes of the map, and a tree that finds them.

use std::sync::Arc;

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
    /// Centre, in world space.
    pub center: Vec3,
    /// Half the edges, in box axes.
    pub half_extents_m: Vec3,
    /// Rotation about z.
    pub yaw_rad: f32,
}

impl StaticBox {
    pub(super) fn pose(&self) -> Pose {
        Pose::from_parts(self.center, Quat::from_rotation_z(self.yaw_rad))
    }
}

/// The static boxes of a map, in a bounding volume hierarchy. Clones share both.
#[derive(Clone)]
pub struct StaticBoxes {
    boxes: Arc<[(Pose, Cuboid)]>,
    tree: Arc<Bvh>,
    enabled: Vec<bool>,
}

impl StaticBoxes {
    /// Sorts boxes into a hierarchy.
    pub fn new(boxes: &[StaticBox]) -> StaticBoxes {
        let boxes: Arc<[_]> =
            boxes.iter().map(|b| (b.pose(), Cuboid::new(b.half_extents_m))).collect();
        let bounds: Vec<Aabb> = boxes.iter().map(|(pose, shape)| shape.aabb(pose)).collect();
        let enabled = vec![true; boxes.len()];
        let tree = Arc::new(Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds));
        StaticBoxes { boxes, tree, enabled }
    }

    /// Returns the pose and the shape of each box.
    pub(super) fn iter(&self) -> impl Iterator<Item = &(Pose, Cuboid)> {
        self.boxes.iter()
    }

    /// Enables or disables a box. Returns whether that is a change.
    pub(super) fn set_enabled(&mut self, index: usize, enabled: bool) -> bool {
        std::mem::replace(&mut self.enabled[index], enabled) != enabled
    }

    /// Returns the lowest index of a box that the shape touches.
    pub(super) fn touching(&self, pose: &Pose, shape: &dyn Shape) -> Option<usize> {
        let bounds = shape.compute_aabb(pose);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        near.filter(|&i| self.enabled[i] && touch(pose, shape, &self.boxes[i].0, &self.boxes[i].1))
            .min()
    }

    /// Returns the boxes that a shape may touch on its way from one pose to another, by index.
    pub(super) fn near_sweep(&self, shape: &dyn Shape, from: &Pose, to: &Pose) -> Vec<usize> {
        let bounds = shape.compute_swept_aabb(from, to);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        let mut near: Vec<usize> = near.filter(|&i| self.enabled[i]).collect();
        near.sort_unstable();
        near
    }

    /// Returns the pose and shape of a box.
    pub(super) fn shape(&self, index: usize) -> (&Pose, &dyn Shape) {
        let (pose, shape) = &self.boxes[index];
        (pose, shape)
    }

    /// Returns the description of a box for messages.
    pub(super) fn name(&self, index: usize) -> &'static str {
        let half = self.boxes[index].1.half_extents;
        if half.x.max(half.y) > 1.5 { "a building" } else { "a pole, trunk or wall" }
    }
}
