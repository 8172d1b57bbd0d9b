//! Roofs.

use glam::{Vec3, vec3};
use mesh::{Material, RandomStream};

use crate::{mesh_builder::MeshBuilder, static_world::Detail};

/// Adds a flat roof with a parapet and equipment.
pub(super) fn flat(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    top: f32,
    random: &mut RandomStream,
    detail: Detail,
) {
    builder.material(Material::RoofFlat);
    builder.block(vec3(-x, -y, top - 0.02), vec3(x, y, top + 0.06));
    // The cornice protrudes, and the parapet stands on it.
    builder.material(Material::Concrete);
    let (out, thick, high) = (0.22, 0.30, top + 0.95);
    for side in [-1.0f32, 1.0] {
        let (a, b) = (side * (x + out), side * (x - thick));
        builder.block(vec3(a.min(b), -y - out, top - 0.35), vec3(a.max(b), y + out, high));
        let (a, b) = (side * (y + out), side * (y - thick));
        builder.block(vec3(-x + thick, a.min(b), top - 0.35), vec3(x - thick, a.max(b), high));
    }
    let room = (x.min(y) - 2.2).max(0.0);
    if room < 1.0 {
        return;
    }
    let at = |random: &mut RandomStream, margin: f32| {
        let (x, y) = ((x - margin).max(0.0), (y - margin).max(0.0));
        vec3(random.between(-x, x), random.between(-y, y), top)
    };
    let house = at(random, 3.0);
    builder.block(house + vec3(-1.6, -1.6, 0.0), house + vec3(1.6, 1.6, 2.7));
    let units = 2 + random.remainder(if detail == Detail::High { 8 } else { 4 });
    for _ in 0..units {
        let (unit, half) = (at(random, 1.8), random.between(0.45, 0.95));
        if (unit - house).abs().max_element() < 2.7 {
            continue;
        }
        builder.material(Material::Metal);
        builder.block(unit + vec3(-half, -0.6, 0.15), unit + vec3(half, 0.6, 1.25));
        builder.rod(unit + Vec3::Z * 1.25, unit + Vec3::Z * 1.40, 0.42, 8);
    }
    builder.material(Material::Metal);
    let vent = at(random, 1.2);
    builder.rod(vent, vent + Vec3::Z * 1.1, 0.16, 6);
}

/// Adds an antenna in the middle.
pub(super) fn mast(builder: &mut MeshBuilder, top: f32, height: f32) {
    builder.material(Material::Metal);
    builder.cone(Vec3::Z * top, Vec3::Z * (top + height), [0.28, 0.06], 6);
}

/// Adds a gable roof with the ridge along the street, or a hip roof; `pitch` is height over half
/// the depth.
pub(super) fn pitched(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    eaves: f32,
    pitch: f32,
    gable: Material,
    hipped: bool,
) {
    let (over, thick) = (0.45, 0.22);
    let ridge = eaves + y * pitch;
    let drop = over * pitch;
    let inset = if hipped { y.min(x * 0.8) } else { 0.0 };
    if !hipped {
        // Gable walls.
        builder.material(gable);
        for side in [-1.0f32, 1.0] {
            let corners = [
                vec3(side * x, -side * y, eaves),
                vec3(side * x, side * y, eaves),
                vec3(side * x, 0.0, ridge),
            ];
            let [a, b, c] = corners.map(|corner| builder.vertex(corner));
            builder.triangle([a, b, c]);
        }
    }
    builder.material(Material::RoofTiles);
    let (ex, ey) = (x + over, y + over);
    let rx = ex - inset;
    let eave = |sx: f32, sy: f32, up: f32| vec3(sx * ex, sy * ey, eaves - drop + up);
    let top = |sx: f32, up: f32| vec3(sx * rx, 0.0, ridge + up);
    for up in [thick, 0.0] {
        let face = |builder: &mut MeshBuilder, mut corners: [Vec3; 4]| {
            if up == 0.0 {
                corners.reverse();
            }
            builder.quad(corners);
        };
        face(builder, [eave(-1.0, -1.0, up), eave(1.0, -1.0, up), top(1.0, up), top(-1.0, up)]);
        face(builder, [eave(1.0, 1.0, up), eave(-1.0, 1.0, up), top(-1.0, up), top(1.0, up)]);
        if hipped {
            face(builder, [eave(1.0, -1.0, up), eave(1.0, 1.0, up), top(1.0, up), top(1.0, up)]);
            face(
                builder,
                [eave(-1.0, 1.0, up), eave(-1.0, -1.0, up), top(-1.0, up), top(-1.0, up)],
            );
        }
    }
    // The edge of the covering, with its gutter.
    builder.material(Material::Wood);
    for side in [-1.0f32, 1.0] {
        builder.quad([
            eave(-side, -side, 0.0),
            eave(side, -side, 0.0),
            eave(side, -side, thick),
            eave(-side, -side, thick),
        ]);
        if hipped {
            builder.quad([
                eave(side, -side, 0.0),
                eave(side, side, 0.0),
                eave(side, side, thick),
                eave(side, -side, thick),
            ]);
        } else {
            for (a, b) in
                [(eave(side, -side, 0.0), top(side, 0.0)), (top(side, 0.0), eave(side, side, 0.0))]
            {
                builder.quad([a, b, b + Vec3::Z * thick, a + Vec3::Z * thick]);
            }
        }
    }
    builder.material(Material::Metal);
    for side in [-1.0f32, 1.0] {
        let gutter = vec3(0.0, side * (ey + 0.05), eaves - drop + 0.05);
        builder.rod(gutter - Vec3::X * ex, gutter + Vec3::X * ex, 0.07, 5);
    }
}

/// Adds a gable roof over a wing, with the ridge along y.
pub(super) fn prism(builder: &mut MeshBuilder, x: [f32; 2], y: [f32; 2], eaves: f32, ridge: f32) {
    let middle = (x[0] + x[1]) * 0.5;
    let rings = [y[1], y[0]]
        .map(|y| vec![vec3(x[0], y, eaves), vec3(x[1], y, eaves), vec3(middle, y, ridge)]);
    builder.loft(&rings, |_, _| None);
}

/// Adds chimneys on the ridge.
pub(super) fn chimneys(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    eaves: f32,
    random: &mut RandomStream,
    count: u32,
) {
    for _ in 0..count {
        let foot = vec3(random.between(-0.7, 0.7) * x, random.between(-0.3, 0.3) * y, eaves);
        let top = foot + Vec3::Z * (y * 0.9 + 1.2);
        builder.material(Material::FacadeBrick);
        builder.block(foot - vec3(0.38, 0.32, 0.0), top + vec3(0.38, 0.32, 0.0));
        builder.material(Material::Concrete);
        builder.block(top - vec3(0.46, 0.40, 0.0), top + vec3(0.46, 0.40, 0.14));
    }
}

/// Adds dormer windows on the street side.
pub(super) fn dormers(
    builder: &mut MeshBuilder,
    [x, y]: [f32; 2],
    eaves: f32,
    random: &mut RandomStream,
) {
    let count = ((x * 2.0 / 4.5) as u32).clamp(1, 3);
    let z = eaves + random.between(0.3, 0.7);
    for dormer in 0..count {
        let at = -x + x * 2.0 * (dormer as f32 + 0.5) / count as f32;
        builder.material(Material::FacadePlaster);
        builder.block(vec3(at - 0.75, 0.15 * y, z), vec3(at + 0.75, y * 0.78, z + 1.35));
        builder.material(Material::Glass);
        builder.block(vec3(at - 0.5, y * 0.7, z + 0.3), vec3(at + 0.5, y * 0.78 + 0.04, z + 1.15));
        builder.material(Material::RoofTiles);
        prism(builder, [at - 0.95, at + 0.95], [0.1 * y, y * 0.78 + 0.2], z + 1.35, z + 1.95);
    }
}
