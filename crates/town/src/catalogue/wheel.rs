use std::f32::consts::TAU;

use glam::{Quat, Vec3, vec3};
use mesh::Material;

use crate::{catalogue::blueprint::Wheel, mesh_builder::MeshBuilder};

/// Adds a car's wheel: a tyre with rounded shoulders and a dished rim on both sides.
pub(super) fn car_wheel(builder: &mut MeshBuilder, wheel: &Wheel, sides: u32) {
    let (radius, half) = (wheel.radius_m, wheel.width_m * 0.5);
    // (distance along the axle, radius, material of the band that starts here)
    let profile = [
        (-half * 0.55, 0.0, Material::Metal),
        (-half * 0.75, radius * 0.60, Material::Metal),
        (-half, radius * 0.66, Material::Rubber),
        (-half, radius * 0.90, Material::Rubber),
        (-half * 0.7, radius, Material::Rubber),
        (half * 0.7, radius, Material::Rubber),
        (half, radius * 0.90, Material::Rubber),
        (half, radius * 0.66, Material::Metal),
        (half * 0.75, radius * 0.60, Material::Metal),
        (half * 0.55, 0.0, Material::Metal),
    ];
    let rings: Vec<Vec<Vec3>> = profile
        .iter()
        .map(|(along, reach, _)| {
            (0..sides)
                .map(|side| {
                    let angle = -TAU * side as f32 / sides as f32;
                    let around = vec3(angle.cos(), 0.0, angle.sin()) * *reach;
                    wheel.position_m + vec3(0.0, *along, 0.0) + around
                })
                .collect()
        })
        .collect();
    builder.material(Material::Metal);
    builder.loft(&rings, |band, _| profile.get(band).map(|point| point.2));
    // Holes between the spokes on the outer side make rotation visible.
    let out = if wheel.position_m.y < 0.0 { -1.0 } else { 1.0 };
    builder.material(Material::Rubber);
    for hole in 0..5 {
        let angle = TAU * hole as f32 / 5.0;
        let turn = Quat::from_rotation_y(angle);
        let at = |along: f32, up: f32, deep: f32| {
            wheel.position_m + turn * vec3(along * radius, out * half * deep, up * radius)
        };
        let face = [
            at(-0.06, 0.20, 0.66),
            at(0.06, 0.20, 0.66),
            at(0.17, 0.54, 0.80),
            at(-0.17, 0.54, 0.80),
        ];
        let [a, b, c, d] = face;
        builder.quad(if out < 0.0 { [a, b, c, d] } else { [d, c, b, a] });
    }
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
