//! Parts that several kinds of vehicles have: mirrors, door handles, light bars, taxi signs.

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{
        cage::Surface,
        profile::{Measure, SHELL, Silhouette},
    },
    mesh_builder::MeshBuilder,
};

/// Adds mirrors and handles. They belong to their doors, where doors open.
pub(super) fn mirrors_and_handles(
    builder: &mut MeshBuilder,
    shape: &Silhouette,
    measure: &Measure,
    surface: &Surface,
) {
    let belt = |fraction: f32| shape.belt(fraction) * measure.size_m.z;
    let (half, full) = (measure.body_m * 0.5, measure.size_m.y * 0.5);
    let cuts = shape.door_cuts();
    for (right, side) in [(0, 1.0f32), (1, -1.0)] {
        let across = |inner: f32, outer: f32| {
            let (a, b) = (inner * side, outer * side);
            (a.min(b), a.max(b))
        };
        let object =
            |door: usize| if cuts.len() > door { SHELL + 1 + 2 * door as u32 + right } else { 0 };
        let (x, z) = (measure.at(shape.mirror), belt(shape.mirror));
        // Mirrors of tall vehicles are tall.
        let tall = (measure.size_m.z * 0.09).clamp(0.16, 0.30);
        builder.object(object(0));
        if full > half + 0.02 {
            let (y0, y1) = across(half * 0.9, full - 0.02);
            builder.material(Material::Plastic);
            builder.block(vec3(x - 0.03, y0, z + 0.01), vec3(x + 0.03, y1, z + 0.05));
            let inner = (full - 0.22).max(half * 0.93);
            builder.material(Material::CarPaint);
            let shell = |x: f32, shrink: f32| {
                oval([inner, full], [z + 0.01, z + tall + 0.01], x, shrink, side)
            };
            builder.solid(|builder| {
                let rings = [
                    (-0.032, 0.008),
                    (-0.022, 0.0),
                    (0.03, 0.002),
                    (0.06, 0.014),
                    (0.085, 0.034),
                    (0.1, 0.062),
                ];
                let rings = rings.map(|(ahead, shrink)| shell(x + ahead, shrink));
                builder.loft(&rings, |_, _| None);
            });
            // The mirror itself, in its frame.
            builder.material(Material::Glass);
            let pane = shell(x - 0.0335, 0.02).into_iter().map(|at| builder.vertex(at));
            let pane: Vec<u32> = pane.collect();
            for pair in pane[1..].windows(2) {
                let order = if side > 0.0 { [pair[1], pair[0]] } else { [pair[0], pair[1]] };
                builder.triangle([pane[0], order[0], order[1]]);
            }
        }
        let (y0, y1) = across(half * 0.94, half * 0.998);
        for (door, (_, to)) in cuts.iter().enumerate() {
            builder.object(object(door)).material(Material::Metal);
            let (x, z) = (measure.at(to - 0.035), belt(*to) - 0.10);
            let hit = surface.cast(vec3(x, 0.0, z), Vec3::Y * side);
            let Some((at, _)) = hit else {
                builder.block(vec3(x - 0.09, y0, z), vec3(x + 0.09, y1, z + 0.03));
                continue;
            };
            // A bow handle: a bar with both ends in the door.
            let out = Vec3::Y * side;
            let bow = [(-0.095, -0.02), (-0.08, 0.022), (0.08, 0.022), (0.095, -0.02)];
            builder.pipe(&bow.map(|(dx, dy)| at + Vec3::X * dx + out * dy), 0.012, 6);
        }
    }
    builder.object(if cuts.is_empty() { 0 } else { SHELL });
}

/// Corners of the section of a mirror.
const OVAL: u32 = 14;

/// A rectangle with round corners across the vehicle at `x`, between y and z on the left (1) or right (−1) side.
fn oval(y: [f32; 2], z: [f32; 2], x: f32, shrink: f32, side: f32) -> Vec<Vec3> {
    let middle = vec3(x, (y[0] + y[1]) * 0.5, (z[0] + z[1]) * 0.5);
    let (wide, high) = ((y[1] - y[0]) * 0.5 - shrink, (z[1] - z[0]) * 0.5 - shrink);
    let corner = |step: u32| {
        let (sin, cos) = (std::f32::consts::TAU * step as f32 / OVAL as f32).sin_cos();
        // A superellipse of fourth degree.
        let round = |c: f32| c.abs().sqrt().copysign(c);
        let at = middle + vec3(0.0, round(cos) * wide.max(0.005), round(sin) * high.max(0.005));
        vec3(at.x, at.y * side, at.z)
    };
    (0..OVAL).map(corner).collect()
}

/// Albedos of the lenses of a light bar, sRGB: dark, as they are by day while nothing shines behind them.
const RED_LENS: [u8; 3] = [128, 12, 14];
const CLEAR_LENS: [u8; 3] = [142, 146, 150];
const BLUE_LENS: [u8; 3] = [14, 34, 128];
/// The gap between two modules of a light bar. Metres.
const MODULE_GAP_M: f32 = 0.014;

/// Adds a light bar with its upper edge at `top`: modules with sloped ends on a dark base with two mounts.
pub(super) fn beacons(builder: &mut MeshBuilder, top: Vec3, half_width: f32, height: f32) {
    let lens = height * 0.62;
    let floor = top.z - lens;
    for (from, to, rgb) in [
        (-1.0, -0.66, RED_LENS),
        (-0.66, -0.22, RED_LENS),
        (-0.22, 0.22, CLEAR_LENS),
        (0.22, 0.66, BLUE_LENS),
        (0.66, 1.0, BLUE_LENS),
    ] {
        builder.tinted(Material::Beacon, rgb);
        let y = [from * half_width + MODULE_GAP_M, to * half_width - MODULE_GAP_M];
        // Outer modules slope down to the sides.
        let ends = [from, to].map(|end: f32| if end.abs() == 1.0 { 0.45 } else { 0.0 });
        let ring = |side: usize, inset: f32| -> Vec<Vec3> {
            let y = y[side] + inset * lens * if side == 0 { 1.0 } else { -1.0 };
            let upper = top.z - ends[side] * lens * (1.0 - inset);
            [(-0.15, floor), (0.15, floor), (0.11, upper), (-0.11, upper)]
                .map(|(x, z)| vec3(top.x + x, y, z))
                .to_vec()
        };
        let rings = [ring(0, 0.0), ring(0, 0.6), ring(1, 0.6), ring(1, 0.0)];
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }
    builder.tinted(Material::Plastic, [14, 14, 15]);
    let base = (height - lens) * 0.5;
    builder.block(
        vec3(top.x - 0.16, -half_width, floor - base),
        vec3(top.x + 0.16, half_width, floor),
    );
    for y in [-half_width * 0.7, half_width * 0.7] {
        builder.block(
            vec3(top.x - 0.06, y - 0.05, top.z - height - 0.03),
            vec3(top.x + 0.06, y + 0.05, floor - base),
        );
    }
}

/// Adds a taxi sign with its upper edge at `top`: a lit housing that is narrower at its top, with dark letters, on a
/// dark base.
pub(super) fn taxi_sign(builder: &mut MeshBuilder, top: Vec3, height: f32) {
    let foot = top.z - height * 0.78;
    let ring = |z: f32, deep: f32, half: f32| -> Vec<Vec3> {
        [(-deep, -half), (deep, -half), (deep, half), (-deep, half)]
            .map(|(x, y)| vec3(top.x + x, y, z))
            .to_vec()
    };
    let hood = [
        ring(foot, 0.095, 0.24),
        ring(foot + (top.z - foot) * 0.75, 0.060, 0.215),
        ring(top.z, 0.035, 0.185),
    ];
    builder.tinted(Material::LampWhite, [214, 208, 188]);
    builder.solid(|builder| builder.loft(&hood, |_, _| None));
    builder.tinted(Material::Plastic, [14, 14, 15]);
    // The letters, which are a band from a few metres on.
    let at = |up: f32| foot + (top.z - foot) * up;
    for side in [1.0f32, -1.0] {
        for letter in 0..4 {
            let y = -0.135 + 0.09 * letter as f32;
            let x = |up: f32| top.x + side * (0.095 - 0.035 * up / 0.75 + 0.002);
            let quad = [(y - 0.03, 0.16), (y + 0.03, 0.16), (y + 0.03, 0.66), (y - 0.03, 0.66)]
                .map(|(y, up)| vec3(x(up), y * side, at(up)));
            builder.quad(quad);
        }
    }
    builder.block(vec3(top.x - 0.12, -0.26, top.z - height - 0.02), vec3(top.x + 0.12, 0.26, foot));
}
