use std::f32::consts::TAU;

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{catalogue::blueprint::Wheel, mesh_builder::MeshBuilder};

/// Colours of a brake disc and of alloy rims, sRGB: metal is bright where it mirrors the sky, and has brake dust.
const DISC: [u8; 3] = [58, 56, 54];
const ALLOY: [u8; 3] = [94, 95, 97];
const DARK_ALLOY: [u8; 3] = [38, 39, 41];

/// Adds the wheel of a car: a tyre with rounded shoulders, a rim with a deep barrel, a brake disc, and
/// spokes; `style` decides how many.
pub(super) fn car_wheel(builder: &mut MeshBuilder, wheel: &Wheel, sides: u32, style: usize) {
    let (radius, half) = (wheel.radius_m, wheel.width_m * 0.5);
    // (distance along the axle from the inner side, radius, material of the band that starts here)
    let profile = [
        (-0.5, 0.0, Material::Plastic),
        (-0.9, 0.60, Material::Rubber),
        (-1.0, 0.74, Material::Rubber),
        (-0.95, 0.92, Material::Rubber),
        (-0.70, 1.0, Material::Rubber),
        (0.70, 1.0, Material::Rubber),
        (0.95, 0.92, Material::Rubber),
        (1.0, 0.78, Material::Rubber),
        (0.93, 0.70, Material::Metal),
        (0.90, 0.66, Material::Plastic),
        (0.20, 0.60, Material::Plastic),
        (0.18, 0.0, Material::Plastic),
    ];
    let out = if wheel.position_m.y < 0.0 { -1.0 } else { 1.0 };
    let at = |angle: f32, reach: f32, along: f32| {
        let (sin, cos) = angle.sin_cos();
        wheel.position_m + vec3(cos * reach * radius, out * along * half, sin * reach * radius)
    };
    let rings: Vec<Vec<Vec3>> = profile
        .iter()
        .map(|(along, reach, _)| {
            let angle = |side: u32| -out * TAU * side as f32 / sides as f32;
            (0..sides).map(|side| at(angle(side), *reach, *along)).collect()
        })
        .collect();
    builder.material(Material::Plastic);
    builder.solid(|builder| builder.loft(&rings, |band, _| profile.get(band).map(|p| p.2)));
    builder.tinted(Material::Metal, DISC);
    builder.solid(|builder| builder.rod(at(0.0, 0.0, 0.2), at(0.0, 0.0, 0.36), radius * 0.42, 16));
    let (spokes, wide): (u32, f32) = [(5, 0.15), (10, 0.065), (7, 0.10), (5, 0.10)][style % 4];
    let dark = matches!(style % 5, 2 | 4);
    for spoke in 0..spokes {
        let middle = TAU * spoke as f32 / spokes as f32;
        builder.tinted(Material::Metal, if dark { DARK_ALLOY } else { ALLOY });
        // Rings across the spoke, from the hub to the rim.
        let ring = |reach: f32, wide: f32, face: f32| -> Vec<Vec3> {
            let turn = (wide / reach).atan();
            vec![
                at(middle - turn, reach, face - 0.28),
                at(middle - turn * 0.8, reach, face),
                at(middle + turn * 0.8, reach, face),
                at(middle + turn, reach, face - 0.28),
            ]
        };
        builder.solid(|builder| {
            let rings = [
                ring(0.12, wide.min(0.07), 0.72),
                ring(0.40, wide * 0.8, 0.82),
                ring(0.68, wide, 0.90),
            ];
            builder.loft(&rings, |_, _| None);
        });
    }
    builder.solid(|builder| builder.rod(at(0.0, 0.0, 0.2), at(0.0, 0.0, 0.76), radius * 0.15, 12));
}

/// Adds the wheel of a two-wheeler: a tyre as a ring, and crossed spokes.
pub(super) fn spoked_wheel(builder: &mut MeshBuilder, wheel: &Wheel, sides: u32, spokes: u32) {
    let (outer, half) = (wheel.radius_m, wheel.width_m * 0.5);
    let inner = outer - wheel.width_m.max(0.03) * 1.1;
    let ring = |angle: f32| -> Vec<Vec3> {
        let out = vec3(angle.cos(), 0.0, -angle.sin());
        let across = Vec3::Y * half;
        let center = wheel.position_m;
        vec![
            center + out * inner - across,
            center + out * inner + across,
            center + out * (outer - half * 0.4) + across,
            center + out * outer,
            center + out * (outer - half * 0.4) - across,
        ]
    };
    builder.material(Material::Rubber);
    for side in 0..sides {
        let [here, there] = [side, (side + 1) % sides].map(|s| ring(TAU * s as f32 / sides as f32));
        for corner in 0..here.len() {
            let next = (corner + 1) % here.len();
            builder.quad([here[corner], here[next], there[next], there[corner]]);
        }
    }
    builder.material(Material::Metal);
    builder.rod(
        wheel.position_m - Vec3::Y * half * 1.5,
        wheel.position_m + Vec3::Y * half * 1.5,
        outer * 0.13,
        6,
    );
    for spoke in 0..spokes {
        let angle = TAU * spoke as f32 / spokes as f32;
        let out = vec3(angle.cos(), 0.0, angle.sin());
        builder.rod(
            wheel.position_m + out * outer * 0.08,
            wheel.position_m + out * (inner + 0.01),
            outer * 0.035,
            3,
        );
    }
}
