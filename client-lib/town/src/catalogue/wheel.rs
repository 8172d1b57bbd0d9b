use std::f32::consts::TAU;

use glam::{Vec3, vec3};
use road::Material;

use super::Wheel;
use crate::clay::Clay;

/// A car's wheel: a tyre with rounded shoulders and a dished rim on both sides.
pub(super) fn tyre(clay: &mut Clay, wheel: &Wheel, sides: u32) {
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
    clay.loft(&rings, |band, _| profile.get(band).map(|point| point.2));
}

/// A two-wheeler's wheel: a tyre as a ring, and crossed spokes.
pub(super) fn hoop(clay: &mut Clay, wheel: &Wheel, sides: u32, spokes: u32) {
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
    clay.material(Material::Rubber);
    for side in 0..sides {
        let [here, there] = [side, (side + 1) % sides].map(|s| ring(TAU * s as f32 / sides as f32));
        for corner in 0..here.len() {
            let next = (corner + 1) % here.len();
            clay.quad([here[corner], here[next], there[next], there[corner]]);
        }
    }
    clay.material(Material::Metal);
    clay.rod(
        wheel.position_m - Vec3::Y * half * 1.5,
        wheel.position_m + Vec3::Y * half * 1.5,
        outer * 0.13,
        6,
    );
    for spoke in 0..spokes {
        let angle = TAU * spoke as f32 / spokes as f32;
        let out = vec3(angle.cos(), 0.0, angle.sin());
        clay.rod(
            wheel.position_m + out * outer * 0.08,
            wheel.position_m + out * (inner + 0.01),
            outer * 0.035,
            3,
        );
    }
}
