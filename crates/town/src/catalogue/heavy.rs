//! Trucks and buses.

use glam::{Vec3, vec3};
use mesh::{Material, Tag};

use crate::{
    catalogue::{
        car::{self, Livery},
        fittings,
        profile::{Measure, Silhouette, Skin},
        silhouettes,
        trim::{self, Extra, Grille, Lamps, Tail, Trim},
    },
    mesh_builder::MeshBuilder,
};

/// How a large vehicle is composed.
#[derive(Debug)]
pub(super) struct Heavy {
    pub(super) tag: Tag,
    pub(super) base_type: &'static str,
    load: Load,
}

/// The part behind the cab.
#[derive(Debug, PartialEq)]
enum Load {
    /// None: one body with windows along its whole length.
    Seats,
    /// A closed box of this material; the second number is the fraction of the height that the cab
    /// has.
    Box(f32, f32, Material),
    /// Pumps, lockers and a ladder.
    Fire(f32, f32),
    /// A patient compartment with beacons.
    Bay(f32, f32),
}

pub(super) const BUS: Heavy = Heavy { tag: Tag::Bus, base_type: "bus", load: Load::Seats };
pub(super) const BOX_TRUCK: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Box(0.36, 0.88, Material::CarPaint) };
pub(super) const LORRY: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Box(0.27, 0.86, Material::Metal) };
pub(super) const FIRE_TRUCK: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Fire(0.33, 0.80) };
pub(super) const AMBULANCE: Heavy =
    Heavy { tag: Tag::Truck, base_type: "truck", load: Load::Bay(0.40, 0.82) };

/// A forward-control cab.
const CAB: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Skin::Paint),
        (0.02, 0.42, Skin::Paint),
        (0.05, 0.46, Skin::Pane),
        (0.22, 0.86, Skin::Paint),
        (0.30, 0.96, Skin::Paint),
        (0.55, 1.0, Skin::Paint),
        (1.0, 1.0, Skin::Paint),
    ],
    belt: &[(0.0, 0.34), (0.03, 0.42), (0.2, 0.47), (1.0, 0.47)],
    plan: &[(0.0, 0.88), (0.04, 0.95), (0.15, 1.0), (1.0, 1.0)],
    roof: 0.90,
    windows: (0.16, 0.78),
    pillars: &[],
    mirror: 0.10,
    clearance_m: 0.34,
    doors: 2,
    is_angular: false,
    cage: None,
};

/// A cab with a bonnet, as on vans.
const SNOUT: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Skin::Paint),
        (0.03, 0.48, Skin::Paint),
        (0.12, 0.55, Skin::Paint),
        (0.36, 0.60, Skin::Pane),
        (0.62, 0.94, Skin::Paint),
        (0.72, 1.0, Skin::Paint),
        (1.0, 1.0, Skin::Paint),
    ],
    belt: &[(0.0, 0.34), (0.05, 0.46), (0.36, 0.56), (1.0, 0.58)],
    plan: &[(0.0, 0.74), (0.03, 0.85), (0.15, 0.95), (0.4, 1.0), (1.0, 1.0)],
    roof: 0.84,
    windows: (0.45, 0.95),
    pillars: &[],
    mirror: 0.42,
    clearance_m: 0.24,
    doors: 2,
    is_angular: false,
    cage: None,
};

/// The part of the vehicle that is lofted, and its dimensions.
pub(super) fn cab<'a>(heavy: &Heavy, measure: &Measure<'a>) -> (&'static Silhouette, Measure<'a>) {
    let (shape, fraction, height) = match heavy.load {
        Load::Seats => (&silhouettes::COACH, 1.0, 1.0),
        Load::Box(fraction, height, _) | Load::Fire(fraction, height) => (&CAB, fraction, height),
        Load::Bay(fraction, height) => (&SNOUT, fraction, height),
    };
    let size_m = vec3(measure.size_m.x * fraction, measure.size_m.y, measure.size_m.z * height);
    let wheels = if fraction < 1.0 { &measure.wheels[..2] } else { measure.wheels };
    (shape, Measure { size_m, wheels, ..*measure })
}

/// Builds the body, without wheels.
pub(super) fn body(builder: &mut MeshBuilder, heavy: &Heavy, measure: &Measure, number: usize) {
    let (shape, front) = cab(heavy, measure);
    let livery = match heavy.load {
        Load::Box(_, _, Material::CarPaint) => Livery { upper: Some([232, 230, 226]), doors: None },
        Load::Fire(..) => Livery { upper: Some([236, 234, 230]), doors: None },
        _ => Livery::default(),
    };
    car::body(builder, shape, &front, livery, number);
    let trim = match heavy.load {
        Load::Seats => Trim(Lamps::Wide, Grille::Bare, Tail::Upright, Extra::Nothing),
        Load::Bay(..) => Trim(Lamps::Tall, Grille::Frame, Tail::Upright, Extra::Nothing),
        _ => Trim(Lamps::Wide, Grille::Frame, Tail::Upright, Extra::Nothing),
    };
    if heavy.load == Load::Seats {
        trim::fit(builder, shape, &front, &trim, None, number);
        return seats(builder, measure);
    }
    trim::front(builder, shape, &front, &trim, None, number);
    let rear = front.nose_m - front.size_m.x;
    chassis(builder, measure, rear);
    match heavy.load {
        Load::Seats => {}
        Load::Box(_, _, material) => {
            let (low, high) = load_space(measure, rear, 1.0);
            builder.material(material);
            crate_of(builder, low, high);
            stripes(builder, low, high, if material == Material::Metal { 5 } else { 0 });
            if material == Material::CarPaint {
                // The wave of a soft drink's logo, on both sides.
                builder.tinted(Material::Sign, [240, 238, 234]);
                for side in [low.y, high.y] {
                    let out = 0.006 * side.signum();
                    let mut before = None;
                    for step in 0..=16 {
                        let fraction = step as f32 / 16.0;
                        let x = low.x + 0.15 + (high.x - low.x - 0.3) * fraction;
                        let z = low.z + (high.z - low.z) * (0.48 + 0.16 * (fraction * 7.0).sin());
                        let wide = 0.07 + 0.10 * fraction;
                        let here = (vec3(x, side + out, z - wide), vec3(x, side + out, z + wide));
                        if let Some((a, b)) = before.replace(here) {
                            let corners: [Vec3; 4] = [a, here.0, here.1, b];
                            let [p, q, r, s] = corners;
                            builder.quad(if side < 0.0 { [p, q, r, s] } else { [s, r, q, p] });
                        }
                    }
                }
            }
            tail_lamps(builder, low, measure);
        }
        Load::Bay(..) => {
            let (low, high) = load_space(measure, rear, 0.95);
            builder.material(Material::CarPaint);
            crate_of(builder, low, high);
            builder.tinted(Material::Sign, [214, 92, 24]);
            for side in [low.y, high.y] {
                let out = 0.008 * side.signum();
                let (a, b) = ((side - out).min(side + out), (side - out).max(side + out));
                builder.block(
                    vec3(low.x + 0.02, a, low.z + 0.30),
                    vec3(high.x - 0.02, b, low.z + 0.52),
                );
            }
            side_windows(builder, low, high, 2);
            cross(builder, low, high);
            tail_lamps(builder, low, measure);
            let roof = vec3((low.x + high.x) * 0.5, 0.0, measure.size_m.z);
            let reach = vec3((high.x - low.x) * 0.5 - 0.2, 0.0, 0.0);
            for end in [-1.0, 1.0] {
                fittings::beacons(builder, roof + reach * end, measure.body_m * 0.42, 0.14);
            }
        }
        Load::Fire(fraction, height) => {
            let (low, high) = load_space(measure, rear, 0.84);
            builder.material(Material::CarPaint);
            crate_of(builder, low, high);
            lockers(builder, low, high);
            ladder(
                builder,
                vec3(low.x + 0.15, 0.0, high.z),
                measure.nose_m - 0.7,
                measure.size_m.z,
            );
            tail_lamps(builder, low, measure);
            let front = measure.nose_m - measure.size_m.x * fraction * 0.62;
            let top = measure.size_m.z * height + 0.16;
            fittings::beacons(builder, vec3(front, 0.0, top), measure.body_m * 0.40, 0.18);
        }
    }
}

/// A box with bevelled edges.
fn crate_of(builder: &mut MeshBuilder, low: Vec3, high: Vec3) {
    let ring = |x: f32, cut: f32| {
        let (y, c) = (high.y - cut, 0.06);
        vec![
            vec3(x, y, low.z),
            vec3(x, y, high.z - c - cut),
            vec3(x, y - c, high.z - cut),
            vec3(x, -y + c, high.z - cut),
            vec3(x, -y, high.z - c - cut),
            vec3(x, -y, low.z),
        ]
    };
    let rings =
        [ring(low.x, 0.03), ring(low.x + 0.03, 0.0), ring(high.x - 0.03, 0.0), ring(high.x, 0.03)];
    builder.solid(|builder| builder.loft(&rings, |_, _| None));
}

/// A red cross on both sides.
fn cross(builder: &mut MeshBuilder, low: Vec3, high: Vec3) {
    builder.tinted(Material::Sign, [196, 28, 30]);
    let (x, z) = (low.x * 0.3 + high.x * 0.7, low.z + (high.z - low.z) * 0.72);
    for side in [low.y, high.y] {
        let (a, b) = ((side - 0.012).min(side + 0.012), (side - 0.012).max(side + 0.012));
        builder.block(vec3(x - 0.22, a, z - 0.07), vec3(x + 0.22, b, z + 0.07));
        builder.block(vec3(x - 0.07, a, z - 0.22), vec3(x + 0.07, b, z + 0.22));
    }
}

/// Adds the parts that only a bus has: a door on the right, a destination sign, a box on the roof.
fn seats(builder: &mut MeshBuilder, measure: &Measure) {
    let (half, height) = (measure.body_m * 0.5, measure.size_m.z);
    builder.material(Material::Glass);
    for fraction in [0.075, 0.46] {
        let x = measure.at(fraction);
        for leaf in [-0.34, 0.02] {
            builder.block(
                vec3(x + leaf, -half - 0.006, 0.42),
                vec3(x + leaf + 0.30, -half * 0.95, height * 0.80),
            );
        }
    }
    builder.tinted(Material::LampAmber, [250, 180, 60]);
    builder.block(
        vec3(measure.at(0.055), -half * 0.5, height * 0.865),
        vec3(measure.at(0.03), half * 0.5, height * 0.93),
    );
    builder.tinted(Material::Plastic, [200, 202, 204]);
    builder.block(
        vec3(measure.at(0.66), -half * 0.55, height - 0.16),
        vec3(measure.at(0.46), half * 0.55, height),
    );
}

fn load_space(measure: &Measure, cab_rear: f32, fraction: f32) -> (Vec3, Vec3) {
    let half = measure.body_m * 0.5;
    let floor = measure.wheels[2].radius_m * 2.0 + 0.10;
    let tail = measure.nose_m - measure.size_m.x;
    (vec3(tail + 0.02, -half, floor), vec3(cab_rear - 0.12, half, measure.size_m.z * fraction))
}

/// Frame rails, side guards and mud flaps.
fn chassis(builder: &mut MeshBuilder, measure: &Measure, cab_rear: f32) {
    let tail = measure.nose_m - measure.size_m.x;
    let hub = measure.wheels[2].position_m.x;
    let (radius, half) = (measure.wheels[2].radius_m, measure.body_m * 0.5);
    builder.material(Material::Plastic);
    builder.block(
        vec3(tail + 0.05, -0.5, radius * 1.1),
        vec3(cab_rear + 0.3, 0.5, radius * 2.0 + 0.11),
    );
    for side in [1.0f32, -1.0] {
        let (a, b) = (side * half * 0.9, side * half * 0.97);
        for (from, to) in [(hub + radius * 1.3, cab_rear - 0.05), (tail + 0.1, hub - radius * 1.3)]
        {
            if to - from > 0.2 {
                builder.block(
                    vec3(from, a.min(b), radius * 0.9),
                    vec3(to, a.max(b), radius * 2.0 + 0.08),
                );
            }
        }
    }
    builder.block(vec3(tail, -half * 0.9, 0.45), vec3(tail + 0.12, half * 0.9, 0.60));
}

fn tail_lamps(builder: &mut MeshBuilder, low: Vec3, measure: &Measure) {
    let tail = measure.nose_m - measure.size_m.x;
    let half = measure.body_m * 0.5;
    for (side, indicator) in [(1.0f32, Material::IndicatorLeft), (-1.0, Material::IndicatorRight)] {
        for (from, to, material) in [
            (0.70, 0.90, Material::LampRed),
            (0.58, 0.69, indicator),
            (0.47, 0.57, Material::LampReverse),
        ] {
            let (a, b) = (side * half * from, side * half * to);
            builder.material(material);
            builder.block(
                vec3(tail, a.min(b), low.z - 0.20),
                vec3(tail + 0.08, a.max(b), low.z - 0.02),
            );
        }
    }
    builder.material(Material::Sign);
    builder.block(vec3(tail, -0.26, low.z - 0.16), vec3(tail + 0.08, 0.26, low.z - 0.05));
    // Rear doors: a frame and two locking bars.
    builder.material(Material::Metal);
    for y in [-0.04, 0.04] {
        builder.rod(
            vec3(low.x - 0.005, y, low.z + 0.05),
            vec3(low.x - 0.005, y, low.z + 1.2),
            0.015,
            5,
        );
    }
}

/// Reflective bands along both sides.
fn stripes(builder: &mut MeshBuilder, low: Vec3, high: Vec3, ribs: u32) {
    for side in [low.y, high.y] {
        let out = 0.008 * side.signum();
        let (a, b) = (side - out, side + out);
        builder.material(Material::Sign);
        builder.block(
            vec3(low.x + 0.1, a.min(b), low.z + 0.18),
            vec3(high.x - 0.1, a.max(b), low.z + 0.30),
        );
        builder.material(Material::Metal);
        for rib in 0..=ribs {
            let x = low.x + 0.03 + (high.x - low.x - 0.06) * rib as f32 / ribs.max(1) as f32;
            builder.block(
                vec3(x - 0.03, a.min(b), low.z + 0.02),
                vec3(x + 0.03, a.max(b), high.z - 0.02),
            );
        }
    }
}

fn side_windows(builder: &mut MeshBuilder, low: Vec3, high: Vec3, count: u32) {
    builder.material(Material::Glass);
    let step = (high.x - low.x) / count as f32;
    for side in [low.y, high.y] {
        let out = 0.01 * side.signum();
        for window in 0..count {
            let x = low.x + step * (window as f32 + 0.25);
            builder.block(
                vec3(x, (side - out).min(side + out), low.z + (high.z - low.z) * 0.50),
                vec3(x + step * 0.5, (side - out).max(side + out), low.z + (high.z - low.z) * 0.80),
            );
        }
    }
}

/// Roller shutters of a fire engine.
fn lockers(builder: &mut MeshBuilder, low: Vec3, high: Vec3) {
    let count = 4;
    let step = (high.x - low.x) / count as f32;
    for side in [low.y, high.y] {
        let out = 0.012 * side.signum();
        for locker in 0..count {
            let x = low.x + step * locker as f32;
            builder.material(Material::Metal);
            for slat in 0..6 {
                let span = (high.z - low.z - 0.3) / 6.0;
                let z = low.z + 0.12 + span * slat as f32;
                builder.block(
                    vec3(x + 0.08, (side - out).min(side + out), z),
                    vec3(x + step - 0.08, (side - out).max(side + out), z + span * 0.9),
                );
            }
        }
        builder.material(Material::Sign);
        builder.block(
            vec3(low.x + 0.05, (side - out).min(side + out), low.z + 0.02),
            vec3(high.x - 0.05, (side - out).max(side + out), low.z + 0.09),
        );
    }
}

fn ladder(builder: &mut MeshBuilder, foot: Vec3, head_x: f32, top: f32) {
    builder.material(Material::Metal);
    let half = 0.32;
    for y in [-half, half] {
        builder.block(vec3(foot.x, y - 0.04, top - 0.16), vec3(head_x, y + 0.04, top - 0.08));
        builder.block(vec3(foot.x, y - 0.02, top - 0.08), vec3(head_x, y + 0.02, top));
    }
    let rungs = ((head_x - foot.x) / 0.35) as u32;
    for rung in 0..rungs {
        let x = foot.x + 0.2 + rung as f32 * 0.35;
        builder.rod(vec3(x, -half, top - 0.12), vec3(x, half, top - 0.12), 0.02, 5);
    }
    for x in [foot.x + 0.4, foot.x + 2.6] {
        builder.block(vec3(x - 0.2, -0.25, foot.z - 0.02), vec3(x + 0.2, 0.25, top - 0.14));
    }
}
