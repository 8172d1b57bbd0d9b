//! Overlap tests between shapes.

use rapier3d::{
    parry::{
        query::intersection_test,
        shape::{Shape, SharedShape},
    },
    prelude::Pose,
};

/// Whether two shapes touch. Every pair of boxes, capsules and spheres is supported.
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

/// Returns a slightly smaller shape, so that touching without overlap is no obstacle.
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
