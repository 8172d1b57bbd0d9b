//! Broad-leaved trees and bushes: branches, and a leaf of two triangles for every leaf or spray.

use glam::{Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

use super::branching::{Envelope, Joint, grow, unit};
use super::species::Shape;

/// The radius below which a branch has no geometry of its own. Metres.
const TWIG_M: [f32; 2] = [0.016, 0.03];
/// How many times larger and fewer the sprays of a far tree are than leaves.
const SPRAY: f32 = 3.1;
/// The number of leaves of a near tree that grow from one twig.
const CLUSTER: usize = 5;
/// The number of leaves for one of those that close the middle of a crown.
const INNER: u32 = 4;

/// Builds a plant with leaves, or with sprays of leaves.
pub(super) fn build(
    builder: &mut MeshBuilder,
    shape: &Shape,
    is_near: bool,
    random: &mut RandomStream,
) {
    let (center, radii) = shape.crown();
    let leaf_m = if is_near { shape.leaf_m } else { shape.leaf_m * SPRAY };
    let inset = radii - leaf_m.min(0.3 * radii.x) * 0.55;
    let envelope = Envelope {
        center,
        radii: inset,
        taper: shape.taper,
        rise: shape.rise,
        points: if is_near { 420 } else { 160 },
        step_m: (inset.element_product()).cbrt() * if is_near { 0.13 } else { 0.2 },
        trunk: trunk(shape, random),
    };
    let joints = grow(&envelope, random);
    wood(builder, shape, &joints, is_near);
    let lobes = lobes(random);
    let crown = Crown { center, radii, shape, leaf_m, lobes };
    let count = if is_near { shape.leaves } else { (shape.leaves as f32 / (SPRAY * SPRAY)) as u32 };
    let ends: Vec<Vec3> = joints
        .iter()
        .filter(|joint| joint.to_tip <= 2 && joint.parent != 0)
        .map(|j| j.at)
        .collect();
    builder.material(Material::Leaves);
    let cluster = if is_near { CLUSTER } else { 1 };
    let (mut twig, mut shade) = (Vec3::ZERO, Shade { bright: 1.0, warm: 0.0 });
    for leaf in 0..count as usize {
        if leaf % cluster == 0 {
            let near = ends[leaf / cluster % ends.len()];
            twig = near + unit(random) * random.between(0.1, 1.45) * envelope.step_m;
            shade = Shade::of_twig(random);
        }
        // Leaves surround their twig, and leave gaps to those of the next.
        let out = if is_near { leaf_m * random.between(0.3, 1.3) } else { 0.0 };
        crown.leaf(builder, twig + unit(random) * out, 1.0, shade, random);
    }
    // Large leaves in the shade close the middle of the crown.
    for _ in 0..count / INNER {
        let end = ends[random.below(ends.len())];
        let at = center + (end - center) * random.between(0.2, 0.8);
        let shade = Shade::of_twig(random);
        crown.leaf(builder, at, if is_near { 2.9 } else { 2.4 }, shade, random);
    }
}

/// The trunk from below the ground to the foot of the crown, slightly bent.
fn trunk(shape: &Shape, random: &mut RandomStream) -> Vec<Vec3> {
    if shape.trunk_radius_m == 0.0 {
        return vec![Vec3::Z * -0.05, Vec3::Z * 0.08];
    }
    let (turn, bend) = (random.between(0.0, std::f32::consts::TAU), random.between(0.02, 0.09));
    let top = shape.crown_from_m * 0.95;
    let segments = 4;
    let mut all = vec![Vec3::Z * -0.4, Vec3::Z * 0.05, Vec3::Z * 0.4];
    for segment in 1..=segments {
        let z = top * segment as f32 / segments as f32;
        let aside = bend * z * (z / top * 2.6 + turn).sin();
        all.push(vec3(turn.cos() * aside, turn.sin() * aside, z));
    }
    all
}

/// Adds the branches as tubes.
fn wood(builder: &mut MeshBuilder, shape: &Shape, joints: &[Joint], is_near: bool) {
    let base_m = if shape.trunk_radius_m > 0.0 { shape.trunk_radius_m } else { 0.03 };
    let thinnest = TWIG_M[usize::from(!is_near)].max(base_m * 0.09);
    let radius = |index: usize| {
        // The trunk widens at its foot and grows thinner upwards.
        let flare = if shape.trunk_radius_m > 0.0 { [1.45, 1.45, 1.12].get(index) } else { None };
        let flare = flare.copied().unwrap_or(1.0);
        let slim = 1.0 - 0.35 * (joints[index].at.z / shape.height_m).clamp(0.0, 1.0);
        joints[index].radius * base_m * flare * slim
    };
    builder.tinted(Material::Bark, shape.bark);
    for (index, joint) in joints.iter().enumerate().skip(1) {
        let own = radius(index);
        if own < thinnest {
            continue;
        }
        // Along the thickest branch the tube continues, others start with their own radius.
        let from = radius(joint.parent).min(own * if index == 2 { 1.45 } else { 1.25 });
        let sides = match own {
            _ if !is_near => 4,
            // Faces that meet at less than a crease have smooth edges.
            own if own > 0.09 => 10,
            own if own > 0.05 => 7,
            own if own > 0.03 => 5,
            _ => 3,
        };
        let (from_m, to_m) = (joints[joint.parent].at, joint.at);
        tube(builder, [from_m, to_m + (to_m - from_m) * 0.04], [from, own], sides);
    }
}

/// Adds an open tube.
pub(super) fn tube(builder: &mut MeshBuilder, ends: [Vec3; 2], radii: [f32; 2], sides: u32) {
    let turn = glam::Quat::from_rotation_arc(Vec3::Z, (ends[1] - ends[0]).normalize_or(Vec3::Z));
    let first = builder.mesh.positions.len() as u32;
    for side in 0..sides {
        let angle = std::f32::consts::TAU * side as f32 / sides as f32;
        let around = turn * vec3(angle.cos(), angle.sin(), 0.0);
        builder.vertex(ends[0] + around * radii[0]);
        builder.vertex(ends[1] + around * radii[1]);
    }
    for side in 0..sides {
        let (own, next) = (first + side * 2, first + (side + 1) % sides * 2);
        builder.triangle([own, next, next + 1]);
        builder.triangle([own, next + 1, own + 1]);
    }
}

/// The directions of the lobes of a crown, each the leaves of one large branch.
const LOBES: usize = 13;
/// How far the surface of a crown lies between its lobes, as a fraction of its radii.
const VALLEY: f32 = 0.70;
/// The cosine of the angle from the middle of a lobe to its edge.
const LOBE_EDGE: f32 = 0.86;

/// Returns directions that are spread over the sphere and differ between plants: a Fibonacci lattice, each point
/// displaced.
fn lobes(random: &mut RandomStream) -> [Vec3; LOBES] {
    let turn = random.between(0.0, std::f32::consts::TAU);
    std::array::from_fn(|lobe| {
        let z = 1.0 - 2.0 * (lobe as f32 + 0.5) / LOBES as f32;
        // The golden angle.
        let around = glam::Vec2::from_angle(turn + lobe as f32 * 2.399_963_2);
        let even = (around * (1.0 - z * z).sqrt()).extend(z);
        (even + unit(random) * 0.25).normalize_or(even)
    })
}

/// The light and the hue of the leaves of one twig.
#[derive(Clone, Copy)]
struct Shade {
    bright: f32,
    warm: f32,
}

impl Shade {
    fn of_twig(random: &mut RandomStream) -> Shade {
        Shade { bright: random.between(0.84, 1.14), warm: random.between(-0.10, 0.16) }
    }
}

/// The crown that leaves belong to.
struct Crown<'a> {
    center: Vec3,
    radii: Vec3,
    shape: &'a Shape,
    leaf_m: f32,
    lobes: [Vec3; LOBES],
}

impl Crown<'_> {
    /// Adds a leaf about a point, `large` times the usual size: widest near its foot, folded along its middle, with a
    /// tip that hangs. Leaves mostly face out of the crown and upwards.
    fn leaf(
        &self,
        builder: &mut MeshBuilder,
        at: Vec3,
        large: f32,
        shade: Shade,
        random: &mut RandomStream,
    ) {
        let offset = (at - self.center) / self.radii;
        let far = offset.length().max(1e-3);
        let surface = self.surface(offset / far);
        // A point outside of the crown moves to its surface.
        let at = if far > surface { self.center + offset / far * surface * self.radii } else { at };
        // A valley between lobes sees little of the sky.
        let far = far.min(surface) * (0.70 + 0.30 * surface);
        let out = (offset / self.radii).normalize_or(Vec3::Z);
        let normal = (out * 0.7 + Vec3::Z * 0.45 + unit(random) * 1.1).normalize_or(Vec3::Z);
        let along = (unit(random) - Vec3::Z * 0.5).reject_from_normalized(normal);
        let along = along.normalize_or(normal.any_orthonormal_vector());
        // Most leaves are small; a few are as large as the species allows.
        let young = random.unit();
        let size = self.leaf_m * (0.62 + 0.75 * young * young) * large;
        builder.tinted(Material::Leaves, self.green(far.min(1.0), offset.z, shade, random));
        // Two blades from one stalk, each turned about it.
        let across = normal.cross(along);
        for side in [-1.0, 1.0] {
            let spread = random.between(0.25, 0.75) * side;
            let blade = along * spread.cos() + across * spread.sin();
            let wide = normal.cross(blade) * size * random.between(0.38, 0.52)
                + normal * size * random.between(-0.12, 0.12);
            let foot = at + (blade * random.between(0.02, 0.14) - along * 0.35) * size;
            let tip = foot + (blade * random.between(0.60, 0.80) - Vec3::Z * 0.1) * size;
            let [a, b, c] = [foot + wide * 0.5, foot - wide * 0.5, tip].map(|p| builder.vertex(p));
            builder.triangle([a, b, c]);
        }
    }

    /// The distance of the surface from the middle in a direction, as a fraction of the radii.
    fn surface(&self, direction: Vec3) -> f32 {
        let near = self.lobes.iter().map(|lobe| lobe.dot(direction)).fold(-1.0, f32::max);
        let inside = ((near - LOBE_EDGE) / (1.0 - LOBE_EDGE)).clamp(0.0, 1.0);
        // A lobe is round: steep at its edge, flat in its middle.
        VALLEY + (1.0 - VALLEY) * (inside * (2.0 - inside)).sqrt()
    }

    /// The colour of a leaf: darker deep in the crown and at its foot, where less of the sky is seen,
    /// and some leaves are paler or yellower.
    fn green(&self, far: f32, up: f32, shade: Shade, random: &mut RandomStream) -> [u8; 3] {
        let open = 0.40 + 0.60 * far * far * (0.82 + 0.18 * up.clamp(-1.0, 1.0));
        let bright = open * shade.bright * random.between(0.86, 1.12);
        let warm = shade.warm + random.between(-0.06, 0.08);
        let [r, g, b] = self.shape.green.map(f32::from);
        [r * (1.0 + warm), g, b * (1.0 - warm)].map(|c| (c * bright).clamp(8.0, 255.0) as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plants::species::SHAPES;

    #[test]
    fn crowns_have_lobes_and_valleys_that_differ_between_plants() {
        let of = |seed: u64| {
            let lobes = lobes(&mut RandomStream::from_state(seed));
            let (center, radii) = SHAPES[0].crown();
            let crown = Crown { center, radii, shape: &SHAPES[0], leaf_m: 0.2, lobes };
            let mut random = RandomStream::from_state(9);
            (0..2000).map(|_| crown.surface(unit(&mut random))).collect::<Vec<f32>>()
        };
        let one = of(1);
        assert!(one.iter().all(|far| (VALLEY..=1.0).contains(far)));
        let share = |deep: f32| one.iter().filter(|far| **far < deep).count() as f32 / 2000.0;
        // Lobes cover most of a crown, and valleys are lines between them.
        assert!((0.03..0.4).contains(&share(0.8)), "{}", share(0.8));
        assert!(share(0.95) < 0.7, "{}", share(0.95));
        assert!(one != of(2));
    }

    #[test]
    fn leaves_of_a_twig_have_one_hue_and_twigs_differ() {
        let mut random = RandomStream::from_state(4);
        let warm: Vec<f32> = (0..50).map(|_| Shade::of_twig(&mut random).warm).collect();
        let (low, high) = warm.iter().fold((1.0f32, -1.0f32), |(a, b), w| (a.min(*w), b.max(*w)));
        assert!(high - low > 0.15, "{low} to {high}");
    }
}
