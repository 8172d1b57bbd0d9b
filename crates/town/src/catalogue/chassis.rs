//! The chassis of trucks: frame, tank, guards, mudguards and tail lamps.

use std::f32::consts::PI;

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{catalogue::profile::Measure, mesh_builder::MeshBuilder};

/// The lower and the upper corner of the space behind the cab, up to this fraction of the height.
pub(super) fn load_space(measure: &Measure, cab_rear: f32, fraction: f32) -> [Vec3; 2] {
    let half = measure.body_m * 0.5;
    let floor = measure.wheels[2].radius_m * 2.0 + 0.10;
    let tail = measure.nose_m - measure.size_m.x;
    [vec3(tail + 0.02, -half, floor), vec3(cab_rear - 0.12, half, measure.size_m.z * fraction)]
}

/// Adds the frame, a fuel tank, an air tank, a battery box, side guards and mudguards.
pub(super) fn build(builder: &mut MeshBuilder, measure: &Measure, cab_rear: f32) {
    let tail = measure.nose_m - measure.size_m.x;
    let hub = measure.wheels[2].position_m.x;
    let (radius, half) = (measure.wheels[2].radius_m, measure.body_m * 0.5);
    let top = radius * 2.0 + 0.11;
    builder.tinted(Material::Metal, [38, 39, 42]);
    for side in [1.0f32, -1.0] {
        let (a, b) = (side * 0.36, side * 0.44);
        builder.block(
            vec3(tail + 0.05, a.min(b), radius * 1.2),
            vec3(cab_rear + 0.3, a.max(b), top - 0.04),
        );
    }
    let length = cab_rear - tail;
    let beams = (length / 0.8) as u32;
    for beam in 0..=beams {
        let x = tail + 0.1 + (length - 0.2) * beam as f32 / beams.max(1) as f32;
        builder.block(
            vec3(x - 0.04, -half * 0.94, top - 0.10),
            vec3(x + 0.04, half * 0.94, top - 0.005),
        );
    }
    // The axle with its differential.
    builder.rod(vec3(hub, -half * 0.7, radius), vec3(hub, half * 0.7, radius), 0.09, 10);
    builder.ball(vec3(hub, 0.0, radius), Vec3::splat(0.22), 8, 12);
    let (from, to) = (hub + radius * 1.45, cab_rear - 0.06);
    let low = radius * 0.75;
    if to - from > 0.7 {
        let middle = (from + to) * 0.5;
        builder.tinted(Material::Metal, [168, 172, 176]);
        let tank = (top - low) * 0.40;
        let at = |x: f32| vec3(x, half * 0.72, low + tank + 0.05);
        builder.rod(at(from + 0.06), at(middle + 0.1), tank, 16);
        builder.tinted(Material::Plastic, [30, 31, 33]);
        builder.rod(at(middle - 0.1), at(middle - 0.06), tank + 0.012, 16);
        builder.rod(at(from + 0.2), at(from + 0.24), tank + 0.012, 16);
        builder.block(
            vec3(from + 0.05, -half * 0.9, low + 0.08),
            vec3(middle, -half * 0.55, top - 0.12),
        );
        builder.tinted(Material::Metal, [92, 95, 98]);
        let air = |x: f32| vec3(x, -half * 0.75, low + 0.22);
        builder.rod(air(middle + 0.06), air(to - 0.06), 0.13, 12);
    }
    for side in [1.0f32, -1.0] {
        let (a, b) = (side * half * 0.94, side * half * 0.97);
        builder.tinted(Material::Metal, [150, 153, 156]);
        for (from, to) in [(hub + radius * 1.4, cab_rear - 0.08), (tail + 0.1, hub - radius * 1.4)]
        {
            if to - from < 0.3 {
                continue;
            }
            for rail in [0.25, 0.65] {
                let z = low + (top - low) * rail;
                builder.block(vec3(from, a.min(b), z), vec3(to, a.max(b), z + 0.10));
            }
            for post in [from + 0.08, to - 0.08] {
                builder.block(
                    vec3(post - 0.03, a.min(side * half * 0.90), low + 0.1),
                    vec3(post + 0.03, a.max(side * half * 0.90), top - 0.05),
                );
            }
        }
        mudguard(builder, measure, side);
    }
    // The bar against underrun.
    builder.tinted(Material::Metal, [60, 62, 66]);
    builder.rod(vec3(tail + 0.09, -half * 0.9, 0.5), vec3(tail + 0.09, half * 0.9, 0.5), 0.06, 10);
    for y in [-0.5, 0.5] {
        builder.block(vec3(tail + 0.05, y - 0.03, 0.5), vec3(tail + 0.12, y + 0.03, top - 0.05));
    }
}

/// A curved guard over a rear wheel, with a flap behind it.
fn mudguard(builder: &mut MeshBuilder, measure: &Measure, side: f32) {
    let wheel = &measure.wheels[2];
    let (hub, half) = (wheel.position_m, measure.body_m * 0.5);
    let most = measure.wheels[2].radius_m * 2.0 + 0.09 - hub.z;
    let (outer, inner) = (half * 0.985 * side, (hub.y - wheel.width_m * 0.7) * side);
    builder.tinted(Material::Plastic, [34, 35, 37]);
    let ring = |step: u32| -> Vec<Vec3> {
        let angle = PI * (0.04 + 0.92 * step as f32 / 12.0);
        let at = |reach: f32, y: f32| {
            vec3(hub.x + angle.cos() * (reach + 0.06), y, hub.z + angle.sin() * reach)
        };
        vec![at(most, inner), at(most, outer), at(most - 0.03, outer), at(most - 0.03, inner)]
    };
    let rings: Vec<_> = (0..=12).map(ring).collect();
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
    builder.tinted(Material::Rubber, [26, 26, 27]);
    let x = hub.x - most - 0.05;
    builder.block(
        vec3(x - 0.015, inner.min(outer), 0.22),
        vec3(x + 0.015, inner.max(outer), hub.z + 0.02),
    );
}

/// Adds the lamps and the plate below the load space.
pub(super) fn tail_lamps(builder: &mut MeshBuilder, measure: &Measure) {
    let tail = measure.nose_m - measure.size_m.x;
    let half = measure.body_m * 0.5;
    let top = measure.wheels[2].radius_m * 2.0 + 0.10;
    for (side, indicator) in [(1.0f32, Material::IndicatorLeft), (-1.0, Material::IndicatorRight)] {
        let (a, b) = (side * half * 0.45, side * half * 0.93);
        builder.tinted(Material::Plastic, [24, 24, 26]);
        builder.block(
            vec3(tail + 0.02, a.min(b), top - 0.22),
            vec3(tail + 0.09, a.max(b), top - 0.01),
        );
        for (at, material) in
            [(0.84, Material::LampRed), (0.69, indicator), (0.54, Material::LampReverse)]
        {
            builder.material(material);
            let from = vec3(tail + 0.06, side * half * at, top - 0.115);
            builder.cone(from, from - Vec3::X * 0.06, [0.078, 0.070], 16);
        }
    }
    builder.material(Material::Sign);
    builder.block(vec3(tail, -0.26, top - 0.17), vec3(tail + 0.08, 0.26, top - 0.06));
}
