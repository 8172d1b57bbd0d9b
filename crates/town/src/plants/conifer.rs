//! Conifers: whorls of drooping branches with sprays of needles.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

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
    let (whorls, twig_m) = if is_near { (30, TWIG_M[0]) } else { (22, TWIG_M[1]) };
    let gap = (height - shape.crown_from_m) / whorls as f32;
    for whorl in 0..whorls {
        // Whorls are denser towards the top, where branches are short.
        let level = ((whorl as f32 + random.between(0.0, 0.6)) / whorls as f32).powf(0.9);
        let z = shape.crown_from_m + (height - shape.crown_from_m) * level;
        let reach = shape.crown_radius_m * (1.0 - level).max(0.05) * random.between(0.86, 1.0);
        let branches = if is_near { 5 + (3.0 * (1.0 - level)) as u32 } else { 5 };
        let turn = random.between(0.0, TAU);
        for branch in 0..branches {
            let angle = turn + TAU * branch as f32 / branches as f32 + random.between(-0.25, 0.25);
            // Without this the whorls would be tiers.
            let z = z + gap * random.between(-0.8, 0.5) * (1.0 - level);
            let long = reach * random.between(0.75, 1.0);
            let branch = Branch { foot: Vec3::Z * z, out: Vec2::from_angle(angle), long, level };
            branch.twigs(builder, shape, twig_m, random);
        }
    }
    let top = Branch { foot: Vec3::Z * (height - 0.5), out: Vec2::X, long: 0.3, level: 1.0 };
    for side in 0..5 {
        let lean = Vec2::from_angle(TAU * 0.2 * side as f32) * random.between(0.05, 0.25);
        top.needles(builder, shape, (top.foot, lean.extend(0.5), 0.07), 1.0, random);
    }
}

/// The distance between twigs on one side of a branch, near and far. Metres.
const TWIG_M: [f32; 2] = [0.13, 0.34];

/// A branch of a conifer.
struct Branch {
    foot: Vec3,
    out: Vec2,
    long: f32,
    /// Its height, from 0 at the foot of the crown to 1 at its top.
    level: f32,
}

impl Branch {
    /// Adds twigs on both sides, which are short near its end, and the end itself.
    fn twigs(&self, b: &mut MeshBuilder, shape: &Shape, twig_m: f32, random: &mut RandomStream) {
        let Branch { foot, out, long, level } = *self;
        // Branches droop in the middle and rise at their ends.
        let at = |t: f32| foot + (out * t).extend(-0.62 * t + 0.26 * t * t) * long;
        let count = (long / twig_m).ceil().max(2.0) as u32;
        let wide = twig_m * 0.36 + 0.025;
        for twig in 0..count * 2 {
            let t = ((twig / 2) as f32 + random.unit()) / count as f32;
            let side = if twig % 2 == 0 { 1.0 } else { -1.0 };
            let ahead = Vec2::from_angle(side * random.between(0.45, 1.15));
            let size = (0.2 + 0.34 * (1.0 - t) * long) * random.between(0.7, 1.25);
            let hang = -random.between(0.05, 0.75);
            let along = out.rotate(ahead).extend(hang) * size;
            let open = t * (1.0 - level * 0.4);
            self.needles(b, shape, (at(t * 0.96), along, wide), open, random);
        }
        let along = at(1.0) - at(0.8);
        let end = along.normalize_or(Vec3::Z) * (0.2 + 0.1 * long);
        self.needles(b, shape, (at(0.94), end, wide), 1.0, random);
    }

    /// Adds a twig with its needles: a narrow triangle, turned about the twig.
    fn needles(
        &self,
        builder: &mut MeshBuilder,
        shape: &Shape,
        (foot, along, wide): (Vec3, Vec3, f32),
        open: f32,
        random: &mut RandomStream,
    ) {
        let level = along.cross(Vec3::Z).normalize_or(Vec3::X);
        let over = level.cross(along).normalize_or(Vec3::Z);
        let roll = Vec2::from_angle(random.between(-0.9, 0.9));
        let side = (level * roll.x + over * roll.y) * wide * random.between(0.8, 1.3);
        let bright = (0.45 + 0.55 * open) * random.between(0.8, 1.2);
        let rgb = shape.green.map(|c| (f32::from(c) * bright).clamp(8.0, 255.0) as u8);
        builder.tinted(Material::Needles, rgb);
        let foot = foot + along * 0.08;
        let [a, b, c] = [foot - side, foot + side, foot + along].map(|p| builder.vertex(p));
        builder.triangle([a, b, c]);
    }
}

/// Adds an open tube.
fn tube(builder: &mut MeshBuilder, ends: [Vec3; 2], radii: [f32; 2], sides: u32) {
    let turn = glam::Quat::from_rotation_arc(Vec3::Z, (ends[1] - ends[0]).normalize_or(Vec3::Z));
    let first = builder.mesh.positions.len() as u32;
    for side in 0..sides {
        let angle = TAU * side as f32 / sides as f32;
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
