//! Broad-leaved trees and bushes: branches, and a leaf of two triangles for every leaf or spray.

use glam::Vec3;
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

use super::branching::{Envelope, grow};
use super::lobes::{Lobes, unit};
use super::species::Shape;
use super::wood::{stem, tubes};

/// How many times larger and fewer the sprays of a far tree are than leaves.
const SPRAY: f32 = 2.4;
/// How much wider for their length they are.
const SPRAY_WIDE: f32 = 1.9;
/// The number of leaves of a near tree that grow along one shoot.
const CLUSTER: usize = 7;
/// The number of leaves for one of those that close the middle of a crown.
const INNER: u32 = 4;

/// Builds a plant with leaves, or with sprays of leaves.
pub(super) fn build(
    builder: &mut MeshBuilder,
    shape: &Shape,
    is_near: bool,
    random: &mut RandomStream,
) {
    let shape = &shape.varied(random);
    let (center, radii) = shape.crown();
    let leaf_m = if is_near { shape.leaf_m } else { shape.leaf_m * SPRAY };
    let inset = radii - leaf_m.min(0.3 * radii.x) * 0.9;
    let step_m = (inset.element_product()).cbrt() * if is_near { 0.11 } else { 0.17 };
    let envelope = Envelope {
        center,
        radii: inset,
        taper: shape.taper,
        rise: shape.rise,
        points: if is_near { 600 } else { 300 },
        step_m,
        lobes: Lobes::new(random),
        stem: stem(shape, step_m, random),
    };
    let joints = grow(&envelope, random);
    tubes(builder, shape, &joints, is_near);
    let wide = if is_near { 1.0 } else { SPRAY_WIDE };
    let crown = Crown { center, radii, shape, leaf_m, wide, lobes: &envelope.lobes };
    let count = if is_near { shape.leaves } else { (shape.leaves as f32 / (SPRAY * SPRAY)) as u32 };
    // Ends of branches, and their directions.
    let ends: Vec<(Vec3, Vec3)> = joints
        .iter()
        .filter(|joint| joint.to_tip <= 2 && joint.parent != 0)
        .map(|joint| (joint.at, (joint.at - joints[joint.parent].at).normalize_or(Vec3::Z)))
        .collect();
    builder.material(Material::Leaves);
    let cluster = if is_near { CLUSTER } else { 1 };
    let mut shoot = (Vec3::ZERO, Vec3::Z);
    let mut shade = Shade { bright: 1.0, warm: 0.0 };
    for leaf in 0..count as usize {
        if leaf % cluster == 0 {
            let (end, along) = ends[leaf / cluster % ends.len()];
            let out = ((end - center) / radii).normalize_or(Vec3::Z);
            let along = (along + out * 0.5 + unit(random) * 0.9).normalize_or(out);
            let foot = end + unit(random) * random.between(0.0, 0.9) * step_m;
            shoot = (foot, along * random.between(1.2, 2.4) * leaf_m);
            shade = Shade::of_twig(random);
        }
        // Leaves grow along their shoot, and leave gaps to those of the next.
        let along = (leaf % cluster) as f32 / cluster as f32 - 0.3;
        let aside = if is_near { leaf_m * random.between(0.2, 0.8) } else { 0.0 };
        crown.leaf(builder, shoot.0 + shoot.1 * along + unit(random) * aside, 1.0, shade, random);
    }
    // Large leaves in the shade close the middle of the crown.
    for _ in 0..count / INNER {
        let (end, _) = ends[random.below(ends.len())];
        let out = random.between(0.1, 0.85);
        let at = center + (end - center) * out;
        let shade = Shade { bright: 0.8, ..Shade::of_twig(random) };
        let large = if is_near { 3.0 - 1.5 * out } else { 1.9 };
        crown.leaf(builder, at, large, shade, random);
    }
}

/// The light and the hue of the leaves of one twig.
#[derive(Clone, Copy)]
struct Shade {
    bright: f32,
    warm: f32,
}

impl Shade {
    fn of_twig(random: &mut RandomStream) -> Shade {
        Shade { bright: random.between(0.84, 1.14), warm: random.between(-0.07, 0.12) }
    }
}

/// The crown that leaves belong to.
struct Crown<'a> {
    center: Vec3,
    radii: Vec3,
    shape: &'a Shape,
    leaf_m: f32,
    /// The width of leaves over that of single ones.
    wide: f32,
    lobes: &'a Lobes,
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
        let surface = self.lobes.surface(offset / far);
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
        let size = self.leaf_m * (0.62 + 0.6 * young * young) * large;
        builder.tinted(Material::Leaves, self.green(far.min(1.0), offset.z, shade, random));
        let wide = self.wide * random.between(0.26, 0.36);
        let side = normal.cross(along) * size * wide;
        let curl = normal * size * random.between(-0.12, 0.12);
        let foot = at - along * size * 0.45;
        let tip = at + (along * 0.5 - Vec3::Z * 0.08) * size;
        let [a, b, c] = [foot + side + curl, foot - side, tip].map(|p| builder.vertex(p));
        builder.triangle([a, b, c]);
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

    #[test]
    fn leaves_of_a_twig_have_one_hue_and_twigs_differ() {
        let mut random = RandomStream::from_state(4);
        let warm: Vec<f32> = (0..50).map(|_| Shade::of_twig(&mut random).warm).collect();
        let (low, high) = warm.iter().fold((1.0f32, -1.0f32), |(a, b), w| (a.min(*w), b.max(*w)));
        assert!(high - low > 0.15, "{low} to {high}");
    }
}
