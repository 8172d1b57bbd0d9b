//! What trucks have behind their cabs: a container, a patient compartment, a fire engine's body.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec3, vec3};
use mesh::Material;

use crate::{
    catalogue::{fittings, profile::Measure},
    mesh_builder::MeshBuilder,
};

/// Adds a box with rounded edges of this radius along the vehicle and bevelled ends.
fn rounded(builder: &mut MeshBuilder, [low, high]: [Vec3; 2], radius: f32) {
    let ring = |x: f32, cut: f32| -> Vec<Vec3> {
        let (y, z, r) = (high.y - cut, high.z - cut, radius);
        let arc: Vec<(f32, f32)> = (0..=4)
            .map(|step| {
                let (sin, cos) = (FRAC_PI_2 * step as f32 / 4.0).sin_cos();
                (y - r + r * cos, z - r + r * sin)
            })
            .collect();
        let left = [(y, low.z + cut)].into_iter().chain(arc).map(|(y, z)| vec3(x, y, z));
        let left: Vec<Vec3> = left.collect();
        let right = left.iter().rev().map(|p| vec3(p.x, -p.y, p.z));
        left.iter().copied().chain(right).collect()
    };
    let bevel = radius * 0.5;
    let rings: Vec<_> = [(0.0, 1.0), (0.3, 0.3), (1.0, 0.0)]
        .map(|(x, cut)| ring(low.x + x * bevel, cut * bevel))
        .into_iter()
        .chain(
            [(1.0, 0.0), (0.3, 0.3), (0.0, 1.0)]
                .map(|(x, cut)| ring(high.x - x * bevel, cut * bevel)),
        )
        .collect();
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
}

/// Adds a panel on the side of the load space: `side` is 1 left and −1 right, `out` the distance by
/// which it protrudes.
fn panel(builder: &mut MeshBuilder, half: f32, side: f32, x: [f32; 2], z: [f32; 2], out: f32) {
    let (a, b) = (side * (half - 0.03), side * (half + out));
    builder.block(vec3(x[0], a.min(b), z[0]), vec3(x[1], a.max(b), z[1]));
}

/// Adds a closed cargo box with ribs, corner posts, rear doors and marker lamps.
pub(super) fn container(builder: &mut MeshBuilder, [low, high]: [Vec3; 2], material: Material) {
    let inset = 0.02;
    let (low, high) = (low, vec3(high.x, high.y - inset, high.z));
    let half = high.y;
    let is_plain = material == Material::Metal;
    builder.material(material);
    rounded(builder, [vec3(low.x + 0.03, -half, low.z), high], 0.05);
    let length = high.x - low.x;
    for side in [1.0, -1.0] {
        if is_plain {
            // Ribs of trapezoidal section, as of a sheet-steel wall.
            let ribs = (length / 0.28) as u32;
            builder.material(material);
            for rib in 1..ribs {
                let x = low.x + length * rib as f32 / ribs as f32;
                let ring = |z: f32| -> Vec<Vec3> {
                    [(-0.07, 0.0), (-0.045, 0.018), (0.045, 0.018), (0.07, 0.0)]
                        .map(|(dx, out)| vec3(x + dx, side * (half + out - 0.002), z))
                        .to_vec()
                };
                builder.solid(|builder| {
                    builder.loft(&[ring(low.z + 0.14), ring(high.z - 0.14)], |_, _| None);
                });
            }
        }
        builder.tinted(Material::Metal, [176, 178, 180]);
        for x in [[low.x, low.x + 0.10], [high.x - 0.09, high.x - 0.005]] {
            panel(builder, half, side, x, [low.z, high.z - 0.03], 0.02);
        }
        for z in [[low.z - 0.01, low.z + 0.12], [high.z - 0.11, high.z - 0.03]] {
            panel(builder, half, side, [low.x + 0.02, high.x - 0.01], z, 0.02);
        }
        let lamps = (length / 1.1) as u32;
        for lamp in 0..lamps {
            let x = low.x + length * (lamp as f32 + 0.5) / lamps as f32;
            builder.material(Material::LampAmber);
            let z = [low.z + 0.03, low.z + 0.08];
            panel(builder, half, side, [x - 0.05, x + 0.05], z, 0.03);
            builder.tinted(Material::Sign, [232, 226, 90]);
            panel(builder, half, side, [x + 0.12, x + 0.42], [low.z + 0.02, low.z + 0.07], 0.024);
        }
        if !is_plain {
            wave(builder, low, high, side * (half + 0.004));
        }
    }
    rear_doors(builder, low, high);
}

/// The wave of a soft drink's logo.
fn wave(builder: &mut MeshBuilder, low: Vec3, high: Vec3, y: f32) {
    builder.tinted(Material::Sign, [240, 238, 234]);
    let mut before = None;
    for step in 0..=48 {
        let fraction = step as f32 / 48.0;
        let x = low.x + 0.15 + (high.x - low.x - 0.3) * fraction;
        let z = low.z + (high.z - low.z) * (0.48 + 0.16 * (fraction * 7.0).sin());
        let wide = 0.07 + 0.10 * fraction;
        let here = (vec3(x, y, z - wide), vec3(x, y, z + wide));
        if let Some((a, b)) = before.replace(here) {
            let [p, q, r, s]: [Vec3; 4] = [a, here.0, here.1, b];
            builder.quad(if y < 0.0 { [p, q, r, s] } else { [s, r, q, p] });
        }
    }
}

/// Two doors in a frame, with hinges and locking bars.
fn rear_doors(builder: &mut MeshBuilder, low: Vec3, high: Vec3) {
    let (x, half, tall) = (low.x + 0.03, high.y, high.z - low.z);
    let back = |from: f32, to: f32, out: f32, z: [f32; 2]| {
        (vec3(x - out, from.min(to), z[0]), vec3(x + 0.02, from.max(to), z[1]))
    };
    builder.tinted(Material::Metal, [176, 178, 180]);
    for side in [1.0f32, -1.0] {
        let (a, b) = back(side * half * 0.93, side * half, 0.02, [low.z, high.z - 0.02]);
        builder.block(a, b);
    }
    for z in [[low.z, low.z + 0.10], [high.z - 0.12, high.z - 0.02]] {
        let (a, b) = back(-half, half, 0.02, z);
        builder.block(a, b);
    }
    builder.tinted(Material::Plastic, [26, 26, 28]);
    let (a, b) = back(-0.012, 0.012, 0.004, [low.z + 0.1, high.z - 0.12]);
    builder.block(a, b);
    for side in [1.0f32, -1.0] {
        builder.tinted(Material::Metal, [150, 153, 156]);
        for y in [0.12, half * 0.55] {
            let at = |z: f32| vec3(x - 0.024, side * y, z);
            builder.rod(at(low.z + 0.02), at(high.z - 0.03), 0.014, 8);
            for height in [0.06, 0.5, 0.94] {
                let z = low.z + tall * height;
                let (a, b) = back(side * y - 0.03, side * y + 0.03, 0.012, [z - 0.03, z + 0.03]);
                builder.block(a, b);
            }
            let z = low.z + tall * 0.36;
            builder.rod(at(z), at(z) - Vec3::Y * side * 0.20 + Vec3::Z * 0.02, 0.013, 6);
        }
        for height in [0.14, 0.38, 0.62, 0.86] {
            let z = low.z + tall * height;
            let (a, b) = back(side * half * 0.78, side * half * 0.97, 0.026, [z, z + 0.07]);
            builder.block(a, b);
        }
        builder.material(Material::LampRed);
        let (a, b) =
            back(side * half * 0.86, side * half * 0.95, 0.03, [high.z - 0.09, high.z - 0.05]);
        builder.block(a, b);
    }
}

/// A wind deflector on the cab's roof, as high as the box.
pub(super) fn deflector(builder: &mut MeshBuilder, cab: &Measure, roof: f32, top: f32) {
    let half = cab.body_m * 0.5;
    let rear = cab.nose_m - cab.size_m.x;
    let front = rear + cab.size_m.x * 0.66;
    builder.material(Material::CarPaint);
    // Rings from the rear edge, which is as high as the box, down to the front of the roof.
    let ring = |t: f32| -> Vec<Vec3> {
        let x = rear + 0.04 + (front - rear) * t;
        let high = roof - 0.05 + (top - roof - 0.02) * (1.0 - t * t) + 0.06 * (1.0 - t);
        let wide = half * (0.90 - 0.10 * t * t);
        (0..=8)
            .map(|step| {
                let u = 1.0 - 2.0 * step as f32 / 8.0;
                // A flat middle and round edges.
                vec3(x, wide * u, roof - 0.10 + (high - roof + 0.10) * (1.0 - u.powi(6)))
            })
            .collect()
    };
    let rings: Vec<_> = (0..=8).map(|step| ring(step as f32 / 8.0)).collect();
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
}

/// Adds a patient compartment.
pub(super) fn patients(builder: &mut MeshBuilder, measure: &Measure, space: [Vec3; 2]) {
    let [low, high] = space;
    let (half, tall) = (high.y, high.z - low.z);
    builder.material(Material::CarPaint);
    rounded(builder, space, 0.12);
    let (hub, clear) = (measure.wheels[2].position_m.x, measure.wheels[2].radius_m * 1.4);
    for side in [1.0, -1.0] {
        // Skirts down to the sill, ahead of the wheels and behind them.
        builder.material(Material::CarPaint);
        for x in [[low.x + 0.02, hub - clear], [hub + clear, high.x - 0.02]] {
            panel(builder, half - 0.01, side, x, [0.34, low.z + 0.1], 0.0);
        }
        builder.tinted(Material::Sign, [214, 92, 24]);
        let whole = [low.x + 0.06, high.x - 0.06];
        panel(builder, half, side, whole, [low.z + 0.30, low.z + 0.50], 0.004);
        builder.tinted(Material::Sign, [236, 214, 40]);
        panel(builder, half, side, whole, [low.z + 0.22, low.z + 0.28], 0.004);
        // Windows in rubber frames, dark behind the glass.
        let step = (high.x - low.x) / 2.0;
        for window in 0..2 {
            let x = low.x + step * (window as f32 + 0.22);
            let z = [low.z + tall * 0.52, low.z + tall * 0.80];
            builder.tinted(Material::Rubber, [20, 20, 22]);
            panel(builder, half, side, [x, x + step * 0.52], z, 0.008);
            builder.material(Material::Glass);
            let z = [z[0] + 0.03, z[1] - 0.03];
            panel(builder, half, side, [x + 0.03, x + step * 0.52 - 0.03], z, 0.014);
        }
        builder.tinted(Material::Plastic, [90, 92, 96]);
        // Lockers below the floor, their gaps and handles.
        for edge in [0.04, 0.30, 0.62, 0.96] {
            let x = low.x + (high.x - low.x) * edge;
            panel(builder, half, side, [x - 0.006, x + 0.006], [low.z + 0.04, high.z - 0.2], 0.002);
        }
        builder.tinted(Material::Metal, [170, 172, 176]);
        for edge in [0.27, 0.59, 0.93] {
            let x = low.x + (high.x - low.x) * edge;
            let z = [low.z + tall * 0.44, low.z + tall * 0.47];
            panel(builder, half, side, [x - 0.09, x], z, 0.02);
        }
        cross(builder, vec3(low.x * 0.5 + high.x * 0.5, side * half, low.z + tall * 0.68));
    }
    // The rear: two doors with windows, steps and grab handles.
    let x = low.x;
    let back = |a: [f32; 2], z: [f32; 2], out: f32| {
        (vec3(x - out, a[0].min(a[1]), z[0]), vec3(x + 0.04, a[0].max(a[1]), z[1]))
    };
    for side in [1.0f32, -1.0] {
        builder.tinted(Material::Rubber, [20, 20, 22]);
        let z = [low.z + tall * 0.50, low.z + tall * 0.84];
        let (a, b) = back([side * half * 0.10, side * half * 0.62], z, 0.006);
        builder.block(a, b);
        builder.material(Material::Glass);
        let z = [z[0] + 0.03, z[1] - 0.03];
        let (a, b) = back([side * half * 0.13, side * half * 0.59], z, 0.011);
        builder.block(a, b);
        builder.tinted(Material::Sign, [214, 92, 24]);
        let (a, b) =
            back([side * half * 0.03, side * half * 0.66], [low.z + 0.30, low.z + 0.50], 0.004);
        builder.block(a, b);
        builder.tinted(Material::Metal, [170, 172, 176]);
        let at = |z: f32| vec3(x - 0.03, side * half * 0.74, z);
        builder.rod(at(low.z + 0.4), at(low.z + tall * 0.8), 0.014, 6);
        builder.material(Material::LampRed);
        let z = [high.z - 0.28, high.z - 0.18];
        let (a, b) = back([side * half * 0.70, side * half * 0.90], z, 0.012);
        builder.block(a, b);
    }
    builder.tinted(Material::Plastic, [40, 41, 44]);
    let (a, b) = back([-0.006, 0.006], [low.z + 0.05, high.z - 0.15], 0.003);
    builder.block(a, b);
    builder.tinted(Material::Metal, [120, 122, 126]);
    builder
        .block(vec3(x - 0.01, -half * 0.7, low.z - 0.30), vec3(x + 0.25, half * 0.7, low.z - 0.26));
    let roof = vec3((low.x + high.x) * 0.5, 0.0, measure.size_m.z);
    let reach = vec3((high.x - low.x) * 0.5 - 0.2, 0.0, 0.0);
    for end in [-1.0, 1.0] {
        fittings::beacons(builder, roof + reach * end, measure.body_m * 0.42, 0.14);
    }
}

/// A red cross on a side wall.
fn cross(builder: &mut MeshBuilder, at: Vec3) {
    builder.tinted(Material::Sign, [196, 28, 30]);
    let (a, b) = (at.y - 0.012, at.y + 0.012);
    builder.block(vec3(at.x - 0.20, a, at.z - 0.065), vec3(at.x + 0.20, b, at.z + 0.065));
    builder.block(vec3(at.x - 0.065, a, at.z - 0.20), vec3(at.x + 0.065, b, at.z + 0.20));
}

/// Adds the body of a fire engine: lockers with roller shutters, a pump panel, hand rails, a
/// ladder.
pub(super) fn engine(builder: &mut MeshBuilder, measure: &Measure, space: [Vec3; 2]) {
    let [low, high] = space;
    let (half, tall) = (high.y - 0.03, high.z - low.z);
    builder.material(Material::CarPaint);
    rounded(builder, [low, vec3(high.x, half, high.z)], 0.05);
    let count = 4;
    let step = (high.x - low.x - 0.1) / count as f32;
    for side in [1.0, -1.0] {
        for locker in 0..count {
            let x = low.x + 0.05 + step * locker as f32;
            let span = [x + 0.05, x + step - 0.05];
            let z = [low.z + 0.16, high.z - 0.26];
            builder.tinted(Material::Metal, [196, 198, 200]);
            panel(builder, half, side, span, z, 0.006);
            // Slats of round section.
            let slats = 16;
            let tall = (z[1] - z[0] - 0.04) / slats as f32;
            for slat in 0..slats {
                let foot = z[0] + 0.02 + tall * slat as f32;
                let ring = |x: f32| -> Vec<Vec3> {
                    [(0.0, 0.0), (0.016, 0.25), (0.016, 0.75), (0.0, 1.0)]
                        .map(|(out, up)| vec3(x, side * (half + out), foot + tall * up))
                        .to_vec()
                };
                builder.solid(|builder| {
                    builder.loft(&[ring(span[0] + 0.03), ring(span[1] - 0.03)], |_, _| None);
                });
            }
            builder.tinted(Material::Metal, [60, 62, 66]);
            let at = |x: f32| vec3(x, side * (half + 0.03), z[0] + 0.07);
            builder.rod(at(span[0] + 0.1), at(span[1] - 0.1), 0.015, 6);
        }
        builder.tinted(Material::Sign, [236, 214, 40]);
        let whole = [low.x + 0.04, high.x - 0.04];
        panel(builder, half, side, whole, [low.z + 0.03, low.z + 0.12], 0.008);
        builder.tinted(Material::Sign, [240, 240, 240]);
        panel(builder, half, side, whole, [high.z - 0.21, high.z - 0.13], 0.006);
        builder.tinted(Material::Metal, [186, 188, 190]);
        let rail = |x: f32, z: f32| vec3(x, side * (half - 0.12), z);
        builder.rod(rail(low.x + 0.2, high.z + 0.12), rail(high.x - 0.2, high.z + 0.12), 0.02, 8);
        for post in 0..5 {
            let x = low.x + 0.2 + (high.x - low.x - 0.4) * post as f32 / 4.0;
            builder.rod(rail(x, high.z - 0.02), rail(x, high.z + 0.12), 0.018, 6);
        }
    }
    // The pump panel at the rear: gauges, outlets and a hose reel behind a shutter.
    builder.tinted(Material::Metal, [190, 192, 194]);
    builder.block(
        vec3(low.x - 0.008, -half * 0.62, low.z + 0.12),
        vec3(low.x + 0.1, half * 0.62, low.z + tall * 0.55),
    );
    for gauge in 0..6 {
        let y = half * (-0.45 + 0.18 * gauge as f32);
        let at = vec3(low.x - 0.004, y, low.z + tall * 0.46);
        builder.tinted(Material::Plastic, [20, 20, 22]);
        builder.rod(at, at - Vec3::X * 0.012, 0.055, 14);
        builder.tinted(Material::Sign, [236, 236, 232]);
        builder.rod(at - Vec3::X * 0.012, at - Vec3::X * 0.016, 0.044, 14);
        builder.tinted(Material::Metal, [206, 170, 60]);
        let at = vec3(low.x, y, low.z + tall * 0.24);
        builder.cone(at + Vec3::X * 0.02, at - Vec3::X * 0.015, [0.075, 0.060], 12);
    }
    for bar in 0..9 {
        builder.tinted(Material::Sign, if bar % 2 == 0 { [196, 28, 30] } else { [236, 214, 40] });
        let y = half * (-0.9 + 0.2 * bar as f32);
        builder.block(
            vec3(low.x - 0.004, y, high.z - 0.42),
            vec3(low.x + 0.05, y + half * 0.2, high.z - 0.16),
        );
    }
    // A monitor and cases on the roof.
    builder.tinted(Material::Metal, [176, 40, 34]);
    let at = vec3(low.x * 0.25 + high.x * 0.75, half * 0.62, high.z);
    builder.rod(at, at + Vec3::Z * 0.22, 0.06, 10);
    builder.cone(at + Vec3::Z * 0.20, at + vec3(0.45, 0.0, 0.28), [0.05, 0.035], 10);
    builder.tinted(Material::Metal, [150, 153, 156]);
    builder.block(
        vec3(low.x + 0.5, -half * 0.78, high.z - 0.02),
        vec3(low.x + 2.3, -half * 0.42, high.z + 0.24),
    );
    ladder(builder, vec3(low.x + 0.15, 0.0, high.z), measure.nose_m - 0.7, measure.size_m.z);
}

fn ladder(builder: &mut MeshBuilder, foot: Vec3, head_x: f32, top: f32) {
    builder.tinted(Material::Metal, [186, 188, 190]);
    let half = 0.32;
    for y in [-half, half] {
        builder.block(vec3(foot.x, y - 0.03, top - 0.20), vec3(head_x, y + 0.03, top - 0.14));
        builder.rod(vec3(foot.x, y, top - 0.025), vec3(head_x, y, top - 0.025), 0.025, 8);
        let braces = ((head_x - foot.x) / 0.7) as u32;
        for brace in 0..braces {
            let x = foot.x + 0.7 * brace as f32;
            builder.rod(vec3(x, y, top - 0.16), vec3(x + 0.35, y, top - 0.03), 0.012, 5);
            builder.rod(vec3(x + 0.35, y, top - 0.03), vec3(x + 0.7, y, top - 0.16), 0.012, 5);
        }
    }
    let rungs = ((head_x - foot.x) / 0.30) as u32;
    for rung in 0..rungs {
        let x = foot.x + 0.15 + rung as f32 * 0.30;
        builder.rod(vec3(x, -half, top - 0.17), vec3(x, half, top - 0.17), 0.02, 6);
    }
    builder.material(Material::Metal);
    for x in [foot.x + 0.4, foot.x + 2.6] {
        builder.block(vec3(x - 0.1, -0.38, foot.z - 0.02), vec3(x + 0.1, 0.38, top - 0.19));
    }
}
