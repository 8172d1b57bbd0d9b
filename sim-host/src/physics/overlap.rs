//! Who would be in the way: the test before a spawn.

use rapier3d::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d::parry::query::intersection_test;
use rapier3d::parry::shape::{Cuboid, Shape, SharedShape};
use rapier3d::prelude::{Aabb, Pose};

use super::StaticBox;

/// The boxes that never move, sorted in a tree.
pub(super) struct Statics {
    boxes: Vec<(Pose, Cuboid)>,
    tree: Bvh,
    is_there: Vec<bool>,
}

impl Statics {
    pub(super) fn new(boxes: &[StaticBox]) -> Statics {
        let boxes: Vec<_> =
            boxes.iter().map(|b| (b.pose(), Cuboid::new(b.half_extents_m))).collect();
        let bounds: Vec<Aabb> = boxes.iter().map(|(pose, shape)| shape.aabb(pose)).collect();
        let is_there = vec![true; boxes.len()];
        Statics { boxes, tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds), is_there }
    }

    /// Says whether that is news.
    pub(super) fn set(&mut self, index: usize, is_there: bool) -> bool {
        std::mem::replace(&mut self.is_there[index], is_there) != is_there
    }

    /// A box that the shape touches: the one with the lowest index.
    pub(super) fn touching(&self, pose: &Pose, shape: &dyn Shape) -> Option<usize> {
        let bounds = shape.compute_aabb(pose);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        near.filter(|&i| self.is_there[i] && touch(pose, shape, &self.boxes[i].0, &self.boxes[i].1))
            .min()
    }

    /// Those that a shape may touch on its way from one pose to another, by index.
    pub(super) fn between(&self, shape: &dyn Shape, from: &Pose, to: &Pose) -> Vec<usize> {
        let bounds = shape.compute_swept_aabb(from, to);
        let near = self.tree.intersect_aabb(&bounds).map(|leaf| leaf as usize);
        let mut near: Vec<usize> = near.filter(|&i| self.is_there[i]).collect();
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

/// Whether two shapes touch. Boxes, capsules: all pairs that we build are supported.
pub(super) fn touch(pose: &Pose, shape: &dyn Shape, other_pose: &Pose, other: &dyn Shape) -> bool {
    let apart = (pose.translation - other_pose.translation).length();
    let reach = shape.compute_local_bounding_sphere();
    let other_reach = other.compute_local_bounding_sphere();
    if apart
        > reach.center.length() + reach.radius + other_reach.center.length() + other_reach.radius
    {
        return false;
    }
    intersection_test(pose, shape, other_pose, other).is_ok_and(|found| found.intersecting)
}

/// The same shape a little smaller, so that what merely touches is not refused.
pub(super) fn shrunk(shape: &SharedShape) -> SharedShape {
    const SKIN_M: f32 = 0.01;
    match (shape.as_cuboid(), shape.as_capsule()) {
        (Some(cuboid), _) => {
            let half = (cuboid.half_extents - SKIN_M).max(cuboid.half_extents * 0.5);
            SharedShape::cuboid(half.x, half.y, half.z)
        }
        (_, Some(capsule)) => {
            let radius = (capsule.radius - SKIN_M).max(capsule.radius * 0.5);
            SharedShape::capsule(capsule.segment.a, capsule.segment.b, radius)
        }
        _ => shape.clone(),
    }
}
