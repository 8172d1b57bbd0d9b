//! Lamps with depth: bowls of reflectors, and ribbed lenses.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};
use mesh::Material;

use crate::{catalogue::end::End, mesh_builder::MeshBuilder};

/// Facets round a bowl.
const SIDES: u32 = 16;
/// The profile of a bowl from the back of its rim to the tip of its bulb: fraction of the radius, and distance along
/// the axis in metres.
const BOWL: [(f32, f32); 6] =
    [(1.08, -0.04), (1.04, 0.020), (0.96, 0.016), (0.62, 0.005), (0.24, 0.006), (0.0, 0.016)];
/// The distance by which ribs stand out of the body, and their height. Metres.
const RIB_OUT_M: f32 = 0.010;
const RIB_M: f32 = 0.006;

/// The satin inside of a head lamp, sRGB.
const HOUSING: [u8; 3] = [82, 85, 90];
/// Tint of the clear cover of a head lamp: renderers give it a part of the lamp's light.
const CLEAR: [u8; 3] = [0, 0, 8];
/// The profile of the domed cover of a round lamp, as that of a bowl.
const DOME: [(f32, f32); 4] = [(0.97, 0.012), (0.80, 0.026), (0.45, 0.034), (0.0, 0.037)];
/// The distance by which the cover stands out of the body. Metres.
const LENS_OUT_M: f32 = 0.036;

/// Adds a chrome ring with a bowl in it that faces along `axis`, and a bulb; both shine with their material.
pub(super) fn bowl(
    builder: &mut MeshBuilder,
    at: Vec3,
    axis: Vec3,
    radius: f32,
    [reflector, bulb]: [Material; 2],
) {
    let rings = BOWL.map(|point| ring(at, axis, radius, point));
    builder.material(bulb);
    builder.solid(|builder| {
        builder.loft(&rings, |band, _| match band {
            0..2 => Some(Material::Metal),
            2..4 => Some(reflector),
            _ => None,
        });
    });
}

/// Adds a domed clear cover over a bowl.
pub(super) fn dome(builder: &mut MeshBuilder, at: Vec3, axis: Vec3, radius: f32) {
    let rings = DOME.map(|point| ring(at, axis, radius, point));
    builder.tinted(Material::Glass, CLEAR);
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
}

/// Returns the points around an axis at a point of a profile.
fn ring(at: Vec3, axis: Vec3, radius: f32, (reach, along): (f32, f32)) -> Vec<Vec3> {
    let turn = Quat::from_rotation_arc(Vec3::X, axis);
    let around = |side: u32| {
        let (sin, cos) = (TAU * side as f32 / SIDES as f32).sin_cos();
        at + turn * (Vec3::X * along + Vec3::new(0.0, cos, sin) * (reach * radius))
    };
    (0..SIDES).map(around).collect()
}

/// Adds a lamp of horizontal ribs on a dark ground, round the end on one side.
pub(super) fn ribs(
    builder: &mut MeshBuilder,
    end: &End,
    side: f32,
    u: [f32; 2],
    z: [f32; 2],
    material: Material,
) {
    builder.tinted(Material::CarPaint, [34, 8, 9]);
    end.wrap(builder, side, u, z);
    builder.material(material);
    let tall = z[1] - z[0];
    let count = (tall / 0.06).round().clamp(1.0, 3.0) as u32;
    let pitch = tall / count as f32;
    for rib in 0..count {
        let low = z[0] + pitch * (rib as f32 + 0.10);
        rounded(builder, end, side, [u[0] + 0.008, u[1] - 0.008], [low, low + pitch * 0.80]);
    }
}

/// Adds a band round the end that bulges in its middle.
fn rounded(builder: &mut MeshBuilder, end: &End, side: f32, u: [f32; 2], z: [f32; 2]) {
    const STEPS: u32 = 3;
    const ROWS: u32 = 2;
    let line = |step: u32| -> Option<Vec<Vec3>> {
        let fraction = u[0] + (u[1] - u[0]) * step as f32 / STEPS as f32;
        let lift = end.rise(fraction);
        let row = |row: u32| {
            let t = row as f32 / ROWS as f32;
            let (at, normal) = end.round(side, fraction, z[0] + (z[1] - z[0]) * t + lift)?;
            Some(at + normal * (RIB_OUT_M + RIB_M * 4.0 * t * (1.0 - t)))
        };
        let mut points: Vec<Vec3> = (0..=ROWS).map(row).collect::<Option<_>>()?;
        for t in [1.0, 0.0] {
            let (at, normal) = end.round(side, fraction, z[0] + (z[1] - z[0]) * t + lift)?;
            points.push(at - normal * 0.02);
        }
        Some(points)
    };
    if let Some(rings) = (0..=STEPS).map(line).collect::<Option<Vec<_>>>() {
        builder.solid(|builder| builder.loft(&rings, |_, _| None));
    }
}

/// Adds a head lamp under a clear cover: two projectors in a satin housing, and a band of light that is the indicator
/// at the corner.
pub(super) fn cluster(
    builder: &mut MeshBuilder,
    end: &End,
    side: f32,
    inner: f32,
    [from, to]: [f32; 2],
    indicator: Material,
) {
    let tall = to - from;
    builder.tinted(Material::Metal, HOUSING);
    end.cover(builder, side, [inner, 1.14], [from, to], 0.004);
    builder.material(Material::LampWhite);
    end.cover(builder, side, [inner + 0.04, 0.96], [to - tall * 0.24, to - tall * 0.10], 0.010);
    builder.material(indicator);
    end.cover(builder, side, [0.97, 1.10], [to - tall * 0.24, to - tall * 0.10], 0.010);
    let middle = from + tall * 0.40;
    // The inner one is smaller: the lamp narrows towards the middle of the car.
    for (u, part, material) in [(0.64, 0.72, Material::LampHigh), (0.86, 1.0, Material::LampWhite)]
    {
        let u = u + (inner - 0.48) * 0.7;
        let radius = (tall * 0.32).min(0.056) * part;
        let up = middle + tall * 0.30 * (1.0 - part);
        let Some((at, normal)) = end.round(side, u, up + end.rise(u)) else { continue };
        let ahead = Vec3::X * end.forward();
        let axis = (ahead * 1.5 + normal).try_normalize().unwrap_or(ahead);
        bowl(builder, at - normal * 0.003, axis, radius, [material; 2]);
    }
    builder.tinted(Material::Glass, CLEAR);
    end.framed(builder, side, [inner, 1.14], [from, to], LENS_OUT_M);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bowl_is_hollow_within_its_ring() {
        let mut builder = MeshBuilder::new(mesh::Tag::Car, Material::CarPaint, 0);
        bowl(&mut builder, Vec3::ZERO, -Vec3::X, 0.1, [Material::LampWhite, Material::LampHigh]);
        let mesh = &builder.mesh;
        let farthest = |material: Material| {
            let of = mesh.triangles.iter().zip(&mesh.faces);
            let of = of.filter(|(_, face)| face.material == material as u8);
            let points = of.flat_map(|(corners, _)| corners.map(|at| mesh.positions[at as usize]));
            points.map(|[x, ..]| -x).fold(f32::MIN, f32::max)
        };
        let [rim, inside] = [Material::Metal, Material::LampWhite].map(farthest);
        assert!((rim - 0.020).abs() < 1e-4 && inside < rim, "{rim} {inside}");
        assert!(farthest(Material::LampHigh) < rim);
        // The reflector faces ahead.
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            let [a, b, c] = corners.map(|at| Vec3::from_array(mesh.positions[at as usize]));
            if face.material == Material::LampWhite as u8 {
                assert!((b - a).cross(c - a).x < 0.0);
            }
        }
    }
}
