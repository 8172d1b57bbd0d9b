//! The wood of broad-leaved trees: a trunk that forks into limbs, and tubes along all branches.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

use super::branching::Joint;
use super::species::Shape;

/// The radius below which a branch has no geometry of its own, near and far. Metres.
const TWIG_M: [f32; 2] = [0.017, 0.04];
/// Heights of the lowest rings of a trunk in metres, and how much wider its roots are there.
const ROOTS: [(f32, f32); 6] =
    [(-0.3, 1.0), (0.03, 0.8), (0.13, 0.38), (0.3, 0.16), (0.6, 0.05), (1.1, 0.0)];
/// The number of main roots.
const ROOT_COUNT: f32 = 5.0;
/// The distance between joints of a trunk. Metres.
const TRUNK_STEP_M: f32 = 0.8;

/// Returns the trunk, slightly bent, and its limbs: positions, each with the index of the one before it.
pub(super) fn stem(shape: &Shape, step_m: f32, random: &mut RandomStream) -> Vec<(Vec3, usize)> {
    if shape.trunk_radius_m == 0.0 {
        return vec![(Vec3::Z * -0.05, 0), (Vec3::Z * 0.08, 0)];
    }
    let (turn, bend) = (random.between(0.0, TAU), random.between(0.02, 0.09));
    let long = shape.height_m - shape.crown_from_m;
    let top = shape.crown_from_m * random.between(0.86, 1.0);
    let lean = Vec2::from_angle(turn) * bend;
    let on_trunk = |z: f32| (lean * z.max(0.0) * (z / top * 2.6 + turn).sin()).extend(z);
    let mut all = Vec::new();
    let mut rise = |z: f32| all.push((on_trunk(z), all.len().max(1) - 1));
    ROOTS.iter().filter(|(z, _)| *z < top - 0.2).for_each(|(z, _)| rise(*z));
    let from = ROOTS.last().map_or(0.0, |(z, _)| *z);
    let steps = ((top - from) / TRUNK_STEP_M).ceil().max(1.0) as u32;
    (1..=steps).for_each(|step| rise(from + (top - from) * step as f32 / steps as f32));
    let fork = all.len() - 1;
    for limb in 0..shape.limbs {
        // The first limb continues the trunk; others leave it on all sides, some a little lower.
        let leads = limb == 0;
        let share = limb as f32 / (shape.limbs - 1).max(1) as f32;
        let angle = turn + TAU * (share + random.between(-0.08, 0.08));
        let first = if leads || fork < 8 { fork } else { fork - random.below(2) };
        let foot = all[first].0;
        let (out, up) = match leads {
            true => (random.between(0.05, 0.2), random.between(0.62, 0.75)),
            false => (random.between(0.45, 0.65), random.between(0.34, 0.6)),
        };
        let out = (Vec2::from_angle(angle) * out * shape.crown_radius_m).extend(0.0);
        let end = Vec3::Z * (shape.crown_from_m + up * long - foot.z) + out;
        // Limbs leave the trunk aside and then turn upwards.
        let middle = out * 0.62 + Vec3::Z * end.z * 0.36;
        let steps = (end.length() / step_m).ceil().max(2.0) as u32;
        for step in 1..=steps {
            let t = step as f32 / steps as f32;
            let parent = if step == 1 { first } else { all.len() - 1 };
            let sway = if leads { 0.03 } else { 0.1 } * step_m;
            let sway = vec3(random.between(-sway, sway), random.between(-sway, sway), 0.0);
            let at = middle * (2.0 * t * (1.0 - t)) + end * (t * t) + sway;
            all.push((foot + at, parent));
        }
    }
    all
}

/// Adds the branches as tubes, each from where it leaves a thicker one to its end.
pub(super) fn tubes(builder: &mut MeshBuilder, shape: &Shape, joints: &[Joint], is_near: bool) {
    let is_tree = shape.trunk_radius_m > 0.0;
    let base_m = if is_tree { shape.trunk_radius_m } else { 0.03 };
    let thinnest = TWIG_M[usize::from(!is_near)].max(base_m * 0.06);
    let radius = |index: usize| {
        let slim = 1.08 - 0.42 * (joints[index].at.z / shape.height_m).clamp(0.0, 1.0);
        joints[index].radius * base_m * slim
    };
    let mut thickest = vec![0usize; joints.len()];
    for (index, joint) in joints.iter().enumerate().skip(1) {
        let other = thickest[joint.parent];
        if other == 0 || joint.radius > joints[other].radius {
            thickest[joint.parent] = index;
        }
    }
    builder.tinted(Material::Bark, shape.bark);
    for (index, joint) in joints.iter().enumerate().skip(1) {
        let is_first = joint.parent == 0 || thickest[joint.parent] != index;
        if !is_first || radius(index) < thinnest {
            continue;
        }
        let own = radius(index);
        let is_trunk = joint.parent == 0;
        let mut line = vec![(joints[joint.parent].at, radius(joint.parent).min(own * 1.3))];
        let mut at = index;
        while at != 0 && radius(at) >= thinnest {
            line.push((joints[at].at, radius(at)));
            at = thickest[at];
        }
        if at != 0 {
            line.push((joints[at].at, radius(at) * 0.5));
        }
        let sides = match own {
            _ if !is_near => 4,
            // Faces that meet at less than a crease have smooth edges.
            _ if is_trunk && is_tree => 15,
            own if own > 0.05 => 8,
            own if own > 0.03 => 5,
            _ => 3,
        };
        let roots = is_trunk && is_tree && is_near;
        tube(builder, &line, sides, |ring, angle| match ROOTS.get(ring) {
            Some((_, wide)) if roots => {
                1.0 + wide * (0.35 + 0.65 * (angle * ROOT_COUNT).cos().max(0.0))
            }
            _ => 1.0,
        });
    }
}

/// Adds an open tube along positions with radii, `wider` by the ring and the angle around it.
fn tube(
    builder: &mut MeshBuilder,
    line: &[(Vec3, f32)],
    sides: u32,
    wider: impl Fn(usize, f32) -> f32,
) {
    let first = builder.mesh.positions.len() as u32;
    let mut aside = Vec3::X;
    for (ring, (at, radius)) in line.iter().enumerate() {
        let (before, after) = (line[ring.max(1) - 1].0, line[(ring + 1).min(line.len() - 1)].0);
        let along = (after - before).normalize_or(Vec3::Z);
        aside = aside.reject_from_normalized(along);
        aside = aside.normalize_or(along.any_orthonormal_vector());
        let across = along.cross(aside);
        for side in 0..sides {
            let angle = TAU * side as f32 / sides as f32;
            let around = aside * angle.cos() + across * angle.sin();
            builder.vertex(*at + around * *radius * wider(ring, angle));
        }
    }
    for ring in 0..line.len() as u32 - 1 {
        for side in 0..sides {
            let low = first + ring * sides;
            let [own, next] = [low + side, low + (side + 1) % sides];
            builder.triangle([own, next, next + sides]);
            builder.triangle([own, next + sides, own + sides]);
        }
    }
}
