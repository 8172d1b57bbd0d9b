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
    surface: Option<&Surface>,
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
                let rings = [(-0.032, 0.006), (0.03, 0.0), (0.075, 0.022), (0.1, 0.06)];
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
            let hit = surface.and_then(|skin| {
                let from = vec3(x, 0.0, z);
                skin.cast(from, Vec3::Y * side)
            });
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

/// A rectangle with round corners across the vehicle at `x`, between y and z on the left (1) or right (−1) side.
fn oval(y: [f32; 2], z: [f32; 2], x: f32, shrink: f32, side: f32) -> Vec<Vec3> {
    let middle = vec3(x, (y[0] + y[1]) * 0.5, (z[0] + z[1]) * 0.5);
    let (wide, high) = ((y[1] - y[0]) * 0.5 - shrink, (z[1] - z[0]) * 0.5 - shrink);
    let corner = |step: u32| {
        let (sin, cos) = (std::f32::consts::TAU * step as f32 / 8.0).sin_cos();
        // A superellipse of fourth degree.
        let round = |c: f32| c.abs().sqrt().copysign(c);
        let at = middle + vec3(0.0, round(cos) * wide.max(0.005), round(sin) * high.max(0.005));
        vec3(at.x, at.y * side, at.z)
    };
    (0..8).map(corner).collect()
}

/// Adds a light bar whose upper edge is at `top`.
pub(super) fn beacons(builder: &mut MeshBuilder, top: Vec3, half_width: f32, height: f32) {
    let lens = height * 0.62;
    for (from, to, rgb) in
        [(-1.0, -0.25, [200, 24, 24]), (-0.25, 0.25, [230, 230, 230]), (0.25, 1.0, [26, 60, 200])]
    {
        builder.tinted(Material::Beacon, rgb);
        builder.block(
            vec3(top.x - 0.13, from * half_width, top.z - lens),
            vec3(top.x + 0.13, to * half_width, top.z),
        );
    }
    builder.material(Material::Plastic);
    builder.block(
        vec3(top.x - 0.09, -half_width * 0.7, top.z - height - 0.03),
        vec3(top.x + 0.09, half_width * 0.7, top.z - lens),
    );
}

/// Adds a taxi sign whose upper edge is at `top`.
pub(super) fn taxi_sign(builder: &mut MeshBuilder, top: Vec3, height: f32) {
    builder.tinted(Material::LampWhite, [226, 226, 216]);
    builder
        .block(vec3(top.x - 0.09, -0.25, top.z - height * 0.75), vec3(top.x + 0.09, 0.25, top.z));
    builder.material(Material::Plastic);
    builder.block(
        vec3(top.x - 0.11, -0.2, top.z - height - 0.02),
        vec3(top.x + 0.11, 0.2, top.z - height * 0.75),
    );
}
