//! Conifers: whorls of drooping branches with sprays of needles.

use glam::{Vec2, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

use super::broadleaf::tube;
use super::species::Shape;

/// Builds a conifer.
pub(super) fn build(
    builder: &mut MeshBuilder,
    shape: &Shape,
    is_near: bool,
    random: &mut RandomStream,
) {
    let (height, trunk_m) = (shape.height_m, shape.trunk_radius_m);
    builder.tinted(Material::Bark, shape.bark);
    let sides = if is_near { 10 } else { 4 };
    tube(builder, [Vec3::Z * -0.4, Vec3::Z * 0.4], [trunk_m * 1.4, trunk_m], sides);
    tube(builder, [Vec3::Z * 0.4, Vec3::Z * height * 0.97], [trunk_m, 0.02], sides);
    let (whorls, sprays, leaf_m) =
        if is_near { (30, 13.0, shape.leaf_m) } else { (17, 5.0, shape.leaf_m * 2.1) };
    let gap = (height - shape.crown_from_m) / whorls as f32;
    for whorl in 0..whorls {
        // Whorls are denser towards the top, where branches are short.
        let level = ((whorl as f32 + random.between(0.0, 0.6)) / whorls as f32).powf(0.9);
        let z = shape.crown_from_m + (height - shape.crown_from_m) * level;
        let reach = shape.crown_radius_m * (1.0 - level).max(0.05) * random.between(0.86, 1.0);
        let branches = if is_near { 5 + (4.0 * (1.0 - level)) as u32 } else { 7 };
        let turn = random.between(0.0, std::f32::consts::TAU);
        for branch in 0..branches {
            let angle = turn
                + std::f32::consts::TAU * branch as f32 / branches as f32
                + random.between(-0.25, 0.25);
            let out = Vec2::from_angle(angle);
            // Without this the whorls would be tiers.
            let z = z + gap * random.between(-0.8, 0.5) * (1.0 - level);
            let long = reach * random.between(0.75, 1.0);
            let count = (sprays * (0.25 + long / shape.crown_radius_m)) as u32;
            for spray in 0..count.max(2) {
                let along = (spray as f32 + random.unit()) / count.max(2) as f32;
                let aside = random.between(-0.3, 0.3) * long * (0.4 + along);
                // Branches droop in the middle and rise at their ends.
                let droop = (-0.62 * along + 0.26 * along * along) * long;
                let center = (out * long * along + out.perp() * aside).extend(z + droop);
                let open = along * (1.0 - level * 0.4);
                // Sprays are long on long branches.
                let size = leaf_m * (0.75 + 0.75 * long / shape.crown_radius_m);
                needles(builder, shape, (center, out, open), size, random);
            }
        }
    }
    let top = Vec3::Z * (height - 0.35 * leaf_m);
    for side in 0..4 {
        let out = Vec2::from_angle(1.6 * side as f32);
        needles(builder, shape, (top, out, 1.0), leaf_m * 0.7, random);
    }
}

/// Adds a spray of needles that points outwards: two narrow triangles, folded along the twig.
fn needles(
    builder: &mut MeshBuilder,
    shape: &Shape,
    (at, out, open): (Vec3, Vec2, f32),
    leaf_m: f32,
    random: &mut RandomStream,
) {
    let size = leaf_m * random.between(0.75, 1.25);
    let turned = out.rotate(Vec2::from_angle(random.between(-0.8, 0.8)));
    // Twigs hang from the branches.
    let along = turned.extend(random.between(-1.1, 0.0)).normalize_or(Vec3::X);
    let side = vec3(-turned.y, turned.x, random.between(-0.5, 0.5)).normalize_or(Vec3::Y);
    let bright = (0.5 + 0.5 * open) * random.between(0.8, 1.2);
    let [r, g, b] = shape.green.map(|c| (f32::from(c) * bright).clamp(8.0, 255.0) as u8);
    builder.tinted(Material::Needles, [r, g, b]);
    let (tip, back) = (at + along * size * 0.6, at - along * size * 0.5);
    let hang = Vec3::Z * size * 0.12;
    let [a, b, c, d] = [back, at + side * size * 0.4 - hang, tip, at - side * size * 0.4 - hang]
        .map(|p| builder.vertex(p));
    builder.triangle([a, c, b]);
    builder.triangle([a, d, c]);
}
