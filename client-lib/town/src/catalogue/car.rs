//! Car bodies, lofted from the tail to the nose over profile tables.
//!
//! Tables are in shares: x from 0 at the nose to 1 at the tail, heights of the whole height, widths
//! of the body's half width. Wheel arches are cut by raising the sill over each wheel.

use glam::{Vec3, vec3};
use road::Material;

use super::Wheel;
use crate::clay::{Clay, FIRST_CAP, LAST_CAP};

/// What the upper skin is made of from one point of the profile to the next.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Skin {
    /// Painted sheet.
    Paint,
    /// Windscreen or rear window.
    Pane,
}
use Skin::{Paint, Pane};

/// The silhouette of a class of cars.
pub(super) struct Silhouette {
    /// Upper edge seen from the side, nose to tail.
    pub(super) top: &'static [(f32, f32, Skin)],
    /// Height of the window sill.
    pub(super) belt: &'static [(f32, f32)],
    /// Half width seen from above.
    pub(super) plan: &'static [(f32, f32)],
    /// Half width of the roof.
    pub(super) roof: f32,
    /// Where the side windows begin and end.
    pub(super) windows: (f32, f32),
    /// Pillars that divide them.
    pub(super) pillars: &'static [f32],
    /// Where the mirrors sit.
    pub(super) mirror: f32,
    /// Ground clearance. Metres.
    pub(super) clearance_m: f32,
}

/// How big, and where the wheels are.
pub(super) struct Measure<'a> {
    /// Length, width with mirrors, height. Metres.
    pub(super) size_m: Vec3,
    /// Width without mirrors. Metres.
    pub(super) body_m: f32,
    /// x of the nose in actor space. Metres.
    pub(super) nose_m: f32,
    /// All wheels.
    pub(super) wheels: &'a [Wheel],
}

const ROUND_PLAN: &[(f32, f32)] = &[
    (0.0, 0.72),
    (0.012, 0.82),
    (0.04, 0.90),
    (0.10, 0.955),
    (0.22, 0.99),
    (0.5, 1.0),
    (0.80, 0.985),
    (0.93, 0.93),
    (0.985, 0.85),
    (1.0, 0.76),
];
const BLUFF_PLAN: &[(f32, f32)] =
    &[(0.0, 0.86), (0.012, 0.93), (0.05, 0.98), (0.2, 1.0), (0.9, 1.0), (0.985, 0.96), (1.0, 0.91)];

pub(super) const SEDAN: Silhouette = Silhouette {
    top: &[
        (0.0, 0.40, Paint),
        (0.012, 0.47, Paint),
        (0.05, 0.535, Paint),
        (0.15, 0.60, Paint),
        (0.265, 0.655, Pane),
        (0.375, 0.925, Paint),
        (0.43, 0.978, Paint),
        (0.50, 1.0, Paint),
        (0.60, 0.99, Paint),
        (0.68, 0.95, Pane),
        (0.845, 0.735, Paint),
        (0.93, 0.715, Paint),
        (0.975, 0.69, Paint),
        (1.0, 0.52, Paint),
    ],
    belt: &[
        (0.0, 0.36),
        (0.02, 0.44),
        (0.1, 0.54),
        (0.265, 0.61),
        (0.7, 0.655),
        (0.9, 0.66),
        (0.98, 0.63),
        (1.0, 0.50),
    ],
    plan: ROUND_PLAN,
    roof: 0.70,
    windows: (0.30, 0.80),
    pillars: &[0.505, 0.70],
    mirror: 0.32,
    clearance_m: 0.17,
};
pub(super) const COUPE: Silhouette = Silhouette {
    top: &[
        (0.0, 0.39, Paint),
        (0.012, 0.47, Paint),
        (0.06, 0.56, Paint),
        (0.18, 0.63, Paint),
        (0.315, 0.67, Pane),
        (0.43, 0.94, Paint),
        (0.49, 0.99, Paint),
        (0.55, 1.0, Paint),
        (0.63, 0.97, Pane),
        (0.83, 0.76, Paint),
        (0.95, 0.72, Paint),
        (0.98, 0.69, Paint),
        (1.0, 0.54, Paint),
    ],
    belt: &[
        (0.0, 0.36),
        (0.02, 0.45),
        (0.1, 0.56),
        (0.3, 0.63),
        (0.75, 0.68),
        (0.98, 0.64),
        (1.0, 0.5),
    ],
    plan: ROUND_PLAN,
    roof: 0.68,
    windows: (0.35, 0.76),
    pillars: &[0.60],
    mirror: 0.37,
    clearance_m: 0.14,
};
pub(super) const HATCHBACK: Silhouette = Silhouette {
    top: &[
        (0.0, 0.38, Paint),
        (0.014, 0.46, Paint),
        (0.06, 0.55, Paint),
        (0.15, 0.61, Paint),
        (0.235, 0.655, Pane),
        (0.37, 0.93, Paint),
        (0.44, 0.985, Paint),
        (0.54, 1.0, Paint),
        (0.72, 0.985, Paint),
        (0.87, 0.94, Pane),
        (0.965, 0.66, Paint),
        (0.985, 0.60, Paint),
        (1.0, 0.46, Paint),
    ],
    belt: &[
        (0.0, 0.34),
        (0.02, 0.44),
        (0.1, 0.54),
        (0.24, 0.60),
        (0.9, 0.655),
        (0.98, 0.58),
        (1.0, 0.43),
    ],
    plan: ROUND_PLAN,
    roof: 0.74,
    windows: (0.265, 0.88),
    pillars: &[0.50, 0.73],
    mirror: 0.29,
    clearance_m: 0.17,
};
pub(super) const SUV: Silhouette = Silhouette {
    top: &[
        (0.0, 0.42, Paint),
        (0.012, 0.50, Paint),
        (0.05, 0.575, Paint),
        (0.15, 0.62, Paint),
        (0.25, 0.655, Pane),
        (0.355, 0.93, Paint),
        (0.42, 0.985, Paint),
        (0.52, 1.0, Paint),
        (0.75, 0.985, Paint),
        (0.905, 0.945, Pane),
        (0.97, 0.69, Paint),
        (0.988, 0.64, Paint),
        (1.0, 0.48, Paint),
    ],
    belt: &[
        (0.0, 0.38),
        (0.02, 0.48),
        (0.1, 0.57),
        (0.25, 0.61),
        (0.9, 0.66),
        (0.985, 0.61),
        (1.0, 0.44),
    ],
    plan: ROUND_PLAN,
    roof: 0.77,
    windows: (0.28, 0.92),
    pillars: &[0.49, 0.70],
    mirror: 0.30,
    clearance_m: 0.22,
};
pub(super) const OFF_ROADER: Silhouette = Silhouette {
    top: &[
        (0.0, 0.44, Paint),
        (0.01, 0.56, Paint),
        (0.04, 0.60, Paint),
        (0.26, 0.63, Paint),
        (0.29, 0.635, Pane),
        (0.355, 0.95, Paint),
        (0.38, 0.985, Paint),
        (0.6, 1.0, Paint),
        (0.95, 0.985, Pane),
        (0.985, 0.64, Paint),
        (1.0, 0.50, Paint),
    ],
    belt: &[(0.0, 0.42), (0.02, 0.54), (0.26, 0.60), (0.97, 0.62), (1.0, 0.48)],
    plan: BLUFF_PLAN,
    roof: 0.86,
    windows: (0.315, 0.94),
    pillars: &[0.50, 0.70],
    mirror: 0.34,
    clearance_m: 0.26,
};
pub(super) const BUBBLE: Silhouette = Silhouette {
    top: &[
        (0.0, 0.34, Paint),
        (0.02, 0.46, Paint),
        (0.07, 0.56, Pane),
        (0.30, 0.93, Paint),
        (0.42, 0.99, Paint),
        (0.52, 1.0, Paint),
        (0.70, 0.97, Pane),
        (0.92, 0.66, Paint),
        (0.98, 0.56, Paint),
        (1.0, 0.42, Paint),
    ],
    belt: &[(0.0, 0.30), (0.03, 0.44), (0.1, 0.52), (0.9, 0.58), (0.98, 0.52), (1.0, 0.38)],
    plan: ROUND_PLAN,
    roof: 0.74,
    windows: (0.16, 0.84),
    pillars: &[0.56],
    mirror: 0.20,
    clearance_m: 0.15,
};
pub(super) const WEDGE: Silhouette = Silhouette {
    top: &[
        (0.0, 0.42, Paint),
        (0.008, 0.50, Paint),
        (0.03, 0.535, Paint),
        (0.20, 0.665, Pane),
        (0.395, 0.965, Paint),
        (0.42, 1.0, Paint),
        (0.44, 0.995, Paint),
        (0.62, 0.86, Paint),
        (0.985, 0.645, Paint),
        (1.0, 0.61, Paint),
    ],
    belt: &[(0.0, 0.40), (0.02, 0.49), (0.18, 0.575), (0.40, 0.60), (0.98, 0.60), (1.0, 0.58)],
    plan: BLUFF_PLAN,
    roof: 0.72,
    windows: (0.22, 0.62),
    pillars: &[0.43],
    mirror: 0.27,
    clearance_m: 0.32,
};
pub(super) const VAN: Silhouette = Silhouette {
    top: &[
        (0.0, 0.27, Paint),
        (0.01, 0.36, Paint),
        (0.05, 0.42, Paint),
        (0.135, 0.49, Pane),
        (0.235, 0.85, Paint),
        (0.28, 0.95, Paint),
        (0.36, 0.99, Paint),
        (0.6, 1.0, Paint),
        (0.97, 0.985, Paint),
        (0.99, 0.95, Paint),
        (1.0, 0.90, Paint),
    ],
    belt: &[(0.0, 0.24), (0.02, 0.34), (0.13, 0.46), (0.4, 0.50), (0.97, 0.50), (1.0, 0.48)],
    plan: BLUFF_PLAN,
    roof: 0.86,
    windows: (0.17, 0.345),
    pillars: &[],
    mirror: 0.20,
    clearance_m: 0.20,
};
pub(super) const MICROBUS: Silhouette = Silhouette {
    top: &[
        (0.0, 0.34, Paint),
        (0.012, 0.45, Paint),
        (0.035, 0.545, Pane),
        (0.10, 0.86, Paint),
        (0.14, 0.95, Paint),
        (0.22, 0.99, Paint),
        (0.6, 1.0, Paint),
        (0.90, 0.985, Paint),
        (0.95, 0.91, Pane),
        (0.985, 0.60, Paint),
        (1.0, 0.46, Paint),
    ],
    belt: &[(0.0, 0.31), (0.02, 0.45), (0.06, 0.52), (0.9, 0.535), (0.98, 0.53), (1.0, 0.42)],
    plan: BLUFF_PLAN,
    roof: 0.80,
    windows: (0.085, 0.93),
    pillars: &[0.28, 0.48, 0.70],
    mirror: 0.10,
    clearance_m: 0.20,
};
pub(super) const COACH: Silhouette = Silhouette {
    top: &[
        (0.0, 0.30, Paint),
        (0.006, 0.36, Paint),
        (0.012, 0.40, Pane),
        (0.05, 0.84, Paint),
        (0.065, 0.94, Paint),
        (0.10, 0.985, Paint),
        (0.5, 1.0, Paint),
        (0.96, 0.985, Paint),
        (0.975, 0.88, Pane),
        (0.992, 0.52, Paint),
        (1.0, 0.40, Paint),
    ],
    belt: &[(0.0, 0.28), (0.01, 0.38), (0.06, 0.42), (0.97, 0.42), (1.0, 0.38)],
    plan: BLUFF_PLAN,
    roof: 0.92,
    windows: (0.05, 0.955),
    pillars: &[0.13, 0.25, 0.37, 0.49, 0.61, 0.73, 0.85],
    mirror: 0.03,
    clearance_m: 0.28,
};

/// Piecewise linear over a table sorted by x; flat beyond its ends.
fn table(points: impl Iterator<Item = (f32, f32)>, x: f32) -> f32 {
    let mut before: Option<(f32, f32)> = None;
    for (px, py) in points {
        if x <= px {
            return match before {
                Some((bx, by)) if px > bx => by + (py - by) * (x - bx) / (px - bx),
                _ => py,
            };
        }
        before = Some((px, py));
    }
    before.map_or(0.0, |point| point.1)
}

/// The body, without wheels; nose at `measure.nose_m`, mirrors, lamps and plates included.
pub(super) fn body(clay: &mut Clay, shape: &Silhouette, measure: &Measure) {
    let stations = stations(shape, measure);
    // Lamps and plates stand out by `RELIEF` and make up the full length.
    let at = |x: f32| measure.nose_m - RELIEF - x * (measure.size_m.x - 2.0 * RELIEF);
    let rings: Vec<Vec<Vec3>> = stations.iter().map(|x| ring(shape, measure, *x, at(*x))).collect();

    clay.material(Material::CarPaint);
    clay.loft(&rings, |band, side| {
        if band == FIRST_CAP || band == LAST_CAP {
            return None;
        }
        let middle = (stations[band] + stations[band + 1]) * 0.5;
        let row = side.min(15 - side);
        match row {
            0 | 1 => Some(Material::Plastic),
            3 if middle < 0.03 => Some(Material::LampWhite),
            3 if middle > 0.985 => Some(Material::LampRed),
            5 if is_window(shape, middle) => Some(Material::Glass),
            6 | 7 if skin(shape, middle) == Pane => Some(Material::Glass),
            _ => None,
        }
    });
    linings(clay, shape, measure);
    fittings(clay, shape, measure);
}

/// What one sees behind the wheels instead of the other side of the street.
fn linings(clay: &mut Clay, shape: &Silhouette, measure: &Measure) {
    clay.material(Material::Plastic);
    for wheel in measure.wheels.iter().filter(|wheel| wheel.position_m.y > 0.0) {
        let (reach, x) = (arch_radius(wheel), wheel.position_m.x);
        let side = wheel.position_m.y - wheel.width_m * 0.5 - 0.02;
        let top = wheel.position_m.z + reach + 0.02;
        let low = vec3(x - reach, -side, shape.clearance_m + 0.02);
        clay.block(low, vec3(x + reach, side, top));
    }
}

/// By how much lamps and plates stand out of the body. Metres.
const RELIEF: f32 = 0.012;

fn skin(shape: &Silhouette, x: f32) -> Skin {
    shape.top.iter().rev().find(|point| point.0 <= x).map_or(Paint, |point| point.2)
}

fn is_window(shape: &Silhouette, x: f32) -> bool {
    x > shape.windows.0
        && x < shape.windows.1
        && !shape.pillars.iter().any(|pillar| (x - pillar).abs() < PILLAR)
}

/// Half the share of the length that a pillar takes.
const PILLAR: f32 = 0.010;

/// Where to cut the body, tail first.
fn stations(shape: &Silhouette, measure: &Measure) -> Vec<f32> {
    let mut cuts: Vec<f32> = shape.top.iter().map(|point| point.0).collect();
    cuts.extend(shape.plan.iter().map(|point| point.0));
    cuts.extend([shape.windows.0, shape.windows.1]);
    cuts.extend(shape.pillars.iter().flat_map(|pillar| [pillar - PILLAR, pillar + PILLAR]));
    // Least wanted last: of two cuts that nearly coincide the earlier in this list stays.
    for wheel in measure.wheels.iter().filter(|wheel| wheel.position_m.y > 0.0) {
        let reach = arch_radius(wheel);
        let hub = measure.nose_m - wheel.position_m.x;
        let angles = (0..=8).map(|k| (std::f32::consts::PI * k as f32 / 8.0).cos() * reach);
        cuts.extend(
            angles.chain([reach + 0.012, -reach - 0.012]).map(|dx| (hub + dx) / measure.size_m.x),
        );
    }
    let mut kept: Vec<f32> = Vec::new();
    for cut in cuts {
        let near = 0.008 / measure.size_m.x;
        if (0.0..=1.0).contains(&cut) && !kept.iter().any(|other| (other - cut).abs() < near) {
            kept.push(cut);
        }
    }
    kept.sort_by(|a, b| b.total_cmp(a));
    kept
}

fn arch_radius(wheel: &Wheel) -> f32 {
    wheel.radius_m * 1.14
}

/// Height of the lower edge: the ground clearance, raised over wheels.
fn sill(shape: &Silhouette, measure: &Measure, x_m: f32, share: f32) -> f32 {
    // Nose and tail sweep up a little, as bumpers do.
    let sweep = (0.04 - share).max(share - 0.95).max(0.0) * 1.2;
    measure
        .wheels
        .iter()
        .filter_map(|wheel| {
            let (reach, dx) = (arch_radius(wheel), x_m - wheel.position_m.x);
            let square = reach * reach - dx * dx;
            (dx.abs() < reach + 0.001).then(|| wheel.position_m.z + square.max(0.0).sqrt())
        })
        .fold(shape.clearance_m + sweep, f32::max)
}

/// The outline across the car at one station: 9 points up the left side, 7 down the right.
fn ring(shape: &Silhouette, measure: &Measure, share: f32, x_m: f32) -> Vec<Vec3> {
    let height = measure.size_m.z;
    let top = table(shape.top.iter().map(|point| (point.0, point.1)), share) * height;
    let belt = (table(shape.belt.iter().copied(), share) * height).min(top - 0.015);
    let half = table(shape.plan.iter().copied(), share) * measure.body_m * 0.5;
    let sill = sill(shape, measure, x_m, share).min(belt - 0.06);
    let usual_sill = shape.clearance_m.min(belt - 0.06);
    let waist = (usual_sill + (belt - usual_sill) * 0.55).max(sill + (belt - sill) * 0.35);

    // How much of the greenhouse stands here: 0 on the bonnet, 1 under the roof.
    let rise = ((top - belt) / (height * 0.30)).clamp(0.0, 1.0);
    let roof = half * (0.84 + (shape.roof - 0.84) * rise);
    let crown = 0.012 + 0.02 * rise;
    let shoulder = (belt + 0.012).min(top - crown * 0.5);
    let left = [
        (0.0, sill),
        (half * 0.78, sill),
        (half * 0.965, sill + 0.02),
        (half, waist),
        (half * 0.975, belt),
        (half * 0.935, shoulder),
        (roof, top - crown * 1.4),
        (roof * 0.62, top - crown * 0.4),
        (0.0, top),
    ];
    let right = left[1..8].iter().rev().map(|(y, z)| vec3(x_m, -y, *z));
    left.iter().map(|(y, z)| vec3(x_m, *y, *z)).chain(right).collect()
}

/// What is fixed to the body: lamps, grille, plates, mirrors, door handles, wipers, sills.
fn fittings(clay: &mut Clay, shape: &Silhouette, measure: &Measure) {
    let (length, height) = (measure.size_m.x, measure.size_m.z);
    let half = measure.body_m * 0.5;
    let at = |share: f32| measure.nose_m - share * length;
    let belt = |share: f32| table(shape.belt.iter().copied(), share) * height;
    let (nose, tail) = (at(0.0), at(1.0));
    let (nose_top, tail_top) = (belt(0.0), belt(1.0));
    let (bumper_nose, bumper_tail) = (shape.clearance_m + 0.06, shape.clearance_m + 0.08);
    for side in [1.0f32, -1.0] {
        let mut lamp = |x: [f32; 2], y: [f32; 2], z: [f32; 2], material: Material| {
            let (y0, y1) = (y[0] * half * side, y[1] * half * side);
            clay.material(material);
            clay.block(vec3(x[0], y0.min(y1), z[0]), vec3(x[1], y0.max(y1), z[1]));
        };
        let (front, rear) = ([nose - 0.08, nose], [tail, tail + 0.08]);
        let lid = nose_top - (nose_top - bumper_nose) * 0.34;
        lamp(front, [0.40, 0.71], [lid, nose_top - 0.02], Material::LampWhite);
        lamp(front, [0.50, 0.68], [bumper_nose, bumper_nose + 0.07], Material::LampAmber);
        let lid = tail_top - (tail_top - bumper_tail) * 0.36;
        lamp(rear, [0.44, 0.75], [lid, tail_top - 0.015], Material::LampRed);
        lamp(rear, [0.44, 0.58], [lid - 0.075, lid - 0.005], Material::LampAmber);
    }
    let bar = |clay: &mut Clay, x: [f32; 2], y: f32, z: [f32; 2], material: Material| {
        clay.material(material);
        clay.block(vec3(x[0], -y, z[0]), vec3(x[1], y, z[1]));
    };
    let (front, rear) = ([nose - 0.07, nose - 0.005], [tail + 0.005, tail + 0.07]);
    let (low, high) = (nose_top * 0.62, nose_top - 0.05);
    bar(clay, front, half * 0.38, [low, high], Material::Plastic);
    bar(clay, front, half * 0.66, [bumper_nose - 0.03, bumper_nose + 0.06], Material::Plastic);
    bar(clay, [nose - 0.06, nose], 0.26, [low - 0.06, low + 0.05], Material::Sign);
    let low = bumper_tail - 0.04;
    bar(clay, rear, half * 0.70, [low, low + 0.12], Material::Plastic);
    let low = low + (tail_top - low) * 0.55;
    bar(clay, [tail, tail + 0.06], 0.26, [low - 0.055, low + 0.055], Material::Sign);

    mirrors_and_handles(clay, shape, measure, belt);
}

fn mirrors_and_handles(
    clay: &mut Clay,
    shape: &Silhouette,
    measure: &Measure,
    belt: impl Fn(f32) -> f32,
) {
    let at = |share: f32| measure.nose_m - share * measure.size_m.x;
    let (half, full) = (measure.body_m * 0.5, measure.size_m.y * 0.5);
    for side in [1.0f32, -1.0] {
        let across = |inner: f32, outer: f32| {
            let (a, b) = (inner * side, outer * side);
            (a.min(b), a.max(b))
        };
        let (x, z) = (at(shape.mirror), belt(shape.mirror));
        if full > half + 0.02 {
            let (y0, y1) = across(half * 0.9, full - 0.02);
            clay.material(Material::Plastic);
            clay.block(vec3(x - 0.03, y0, z + 0.01), vec3(x + 0.03, y1, z + 0.05));
            let (y0, y1) = across((full - 0.22).max(half * 0.93), full);
            clay.material(Material::CarPaint);
            clay.block(vec3(x - 0.03, y0, z + 0.01), vec3(x + 0.08, y1, z + 0.17));
            clay.material(Material::Glass);
            clay.block(
                vec3(x - 0.036, y0 + 0.015, z + 0.025),
                vec3(x - 0.02, y1 - 0.015, z + 0.155),
            );
        }
        let (y0, y1) = across(half * 0.94, half * 0.995);
        clay.material(Material::Metal);
        for share in shape.pillars.iter().take(2) {
            let (x, z) = (at(share - 0.035), belt(*share) - 0.09);
            clay.block(vec3(x - 0.09, y0, z), vec3(x + 0.09, y1, z + 0.03));
        }
    }
}
