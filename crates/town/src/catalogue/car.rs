//! Car bodies, lofted from the tail to the nose over profile tables.
//!
//! Tables are in shares: x from 0 at the nose to 1 at the tail, heights of the whole height, widths
//! of the body's half width. Smooth curves run through their points, straight lines through those
//! of angular bodies. Wheel arches are cut by raising the sill over each wheel.

use glam::{Quat, Vec3, vec3};
use mesh::{Face, Material};

use super::Wheel;
use super::rig::INTERIOR;
use super::trim;
use crate::clay::{Clay, FIRST_CAP, LAST_CAP};

/// What the upper skin is made of from one point of the profile to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Skin {
    /// Painted sheet.
    Paint,
    /// Windscreen or rear window.
    Pane,
}
use Skin::{Paint, Pane};

/// The silhouette of a class of cars.
#[derive(Debug)]
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
    /// How many doors open: 0, 2 or 4.
    pub(super) doors: u8,
    /// Drawn with straight lines.
    pub(super) is_angular: bool,
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
    doors: 4,
    is_angular: false,
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
    doors: 2,
    is_angular: false,
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
    doors: 4,
    is_angular: false,
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
    doors: 4,
    is_angular: false,
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
    doors: 4,
    is_angular: true,
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
    doors: 2,
    is_angular: false,
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
    doors: 4,
    is_angular: true,
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
    doors: 2,
    is_angular: false,
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
    doors: 2,
    is_angular: false,
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
    doors: 0,
    is_angular: false,
};

/// A long old saloon: bonnet and boot of one height, an upright glasshouse between.
pub(super) const CLASSIC: Silhouette = Silhouette {
    top: &[
        (0.0, 0.48, Paint),
        (0.010, 0.56, Paint),
        (0.03, 0.60, Paint),
        (0.15, 0.625, Paint),
        (0.30, 0.645, Pane),
        (0.395, 0.935, Paint),
        (0.44, 0.985, Paint),
        (0.52, 1.0, Paint),
        (0.61, 0.975, Paint),
        (0.645, 0.94, Pane),
        (0.735, 0.665, Paint),
        (0.80, 0.645, Paint),
        (0.97, 0.60, Paint),
        (0.99, 0.56, Paint),
        (1.0, 0.44, Paint),
    ],
    belt: &[
        (0.0, 0.42),
        (0.02, 0.54),
        (0.1, 0.585),
        (0.30, 0.605),
        (0.72, 0.615),
        (0.98, 0.56),
        (1.0, 0.42),
    ],
    plan: &[
        (0.0, 0.90),
        (0.01, 0.95),
        (0.05, 0.98),
        (0.2, 1.0),
        (0.9, 0.99),
        (0.985, 0.95),
        (1.0, 0.88),
    ],
    roof: 0.74,
    windows: (0.335, 0.70),
    pillars: &[0.505],
    mirror: 0.335,
    clearance_m: 0.19,
    doors: 4,
    is_angular: false,
};
/// A short-tailed fastback with a long bonnet.
pub(super) const FASTBACK: Silhouette = Silhouette {
    top: &[
        (0.0, 0.46, Paint),
        (0.012, 0.55, Paint),
        (0.05, 0.61, Paint),
        (0.20, 0.655, Paint),
        (0.355, 0.675, Pane),
        (0.445, 0.93, Paint),
        (0.49, 0.985, Paint),
        (0.55, 1.0, Paint),
        (0.62, 0.985, Paint),
        (0.68, 0.945, Pane),
        (0.86, 0.755, Paint),
        (0.96, 0.70, Paint),
        (0.985, 0.67, Paint),
        (1.0, 0.56, Paint),
    ],
    belt: &[
        (0.0, 0.42),
        (0.02, 0.53),
        (0.1, 0.58),
        (0.35, 0.625),
        (0.60, 0.635),
        (0.74, 0.69),
        (0.97, 0.64),
        (1.0, 0.52),
    ],
    plan: &[
        (0.0, 0.88),
        (0.012, 0.93),
        (0.06, 0.97),
        (0.2, 0.99),
        (0.5, 0.985),
        (0.78, 1.0),
        (0.95, 0.97),
        (1.0, 0.90),
    ],
    roof: 0.68,
    windows: (0.385, 0.70),
    pillars: &[0.615],
    mirror: 0.39,
    clearance_m: 0.16,
    doors: 2,
    is_angular: false,
};
/// A sports coupe like half an egg.
pub(super) const DOME: Silhouette = Silhouette {
    top: &[
        (0.0, 0.38, Paint),
        (0.015, 0.46, Paint),
        (0.07, 0.57, Paint),
        (0.18, 0.64, Paint),
        (0.275, 0.675, Pane),
        (0.405, 0.93, Paint),
        (0.47, 0.985, Paint),
        (0.53, 1.0, Paint),
        (0.61, 0.975, Paint),
        (0.66, 0.94, Pane),
        (0.86, 0.70, Paint),
        (0.94, 0.61, Paint),
        (0.985, 0.53, Paint),
        (1.0, 0.44, Paint),
    ],
    belt: &[
        (0.0, 0.34),
        (0.02, 0.43),
        (0.1, 0.55),
        (0.28, 0.62),
        (0.75, 0.66),
        (0.95, 0.56),
        (1.0, 0.40),
    ],
    plan: ROUND_PLAN,
    roof: 0.64,
    windows: (0.31, 0.72),
    pillars: &[0.585],
    mirror: 0.335,
    clearance_m: 0.14,
    doors: 2,
    is_angular: false,
};
/// A saloon whose roof runs down to a high tail in one sweep.
pub(super) const LIFTBACK: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Paint),
        (0.014, 0.44, Paint),
        (0.06, 0.54, Paint),
        (0.13, 0.60, Paint),
        (0.205, 0.65, Pane),
        (0.36, 0.925, Paint),
        (0.42, 0.98, Paint),
        (0.49, 1.0, Paint),
        (0.58, 0.985, Pane),
        (0.72, 0.905, Pane),
        (0.91, 0.755, Paint),
        (0.965, 0.735, Paint),
        (0.985, 0.68, Paint),
        (1.0, 0.50, Paint),
    ],
    belt: &[
        (0.0, 0.32),
        (0.02, 0.42),
        (0.1, 0.53),
        (0.21, 0.59),
        (0.6, 0.645),
        (0.88, 0.70),
        (0.98, 0.62),
        (1.0, 0.46),
    ],
    plan: ROUND_PLAN,
    roof: 0.70,
    windows: (0.245, 0.82),
    pillars: &[0.475, 0.685],
    mirror: 0.275,
    clearance_m: 0.16,
    doors: 4,
    is_angular: false,
};
/// A small upright car with short overhangs and a flat roof.
pub(super) const BRICK: Silhouette = Silhouette {
    top: &[
        (0.0, 0.42, Paint),
        (0.014, 0.52, Paint),
        (0.06, 0.595, Paint),
        (0.18, 0.635, Paint),
        (0.265, 0.655, Pane),
        (0.365, 0.94, Paint),
        (0.40, 0.985, Paint),
        (0.50, 1.0, Paint),
        (0.80, 0.985, Paint),
        (0.905, 0.955, Pane),
        (0.965, 0.66, Paint),
        (0.985, 0.62, Paint),
        (1.0, 0.46, Paint),
    ],
    belt: &[
        (0.0, 0.38),
        (0.02, 0.50),
        (0.1, 0.575),
        (0.27, 0.615),
        (0.9, 0.64),
        (0.98, 0.58),
        (1.0, 0.42),
    ],
    plan: &[
        (0.0, 0.80),
        (0.014, 0.88),
        (0.05, 0.94),
        (0.15, 0.98),
        (0.4, 1.0),
        (0.85, 0.99),
        (0.96, 0.94),
        (1.0, 0.84),
    ],
    roof: 0.80,
    windows: (0.295, 0.93),
    pillars: &[0.56],
    mirror: 0.315,
    clearance_m: 0.16,
    doors: 2,
    is_angular: false,
};
/// A tall family car with a short bonnet.
pub(super) const MONOVOLUME: Silhouette = Silhouette {
    top: &[
        (0.0, 0.36, Paint),
        (0.014, 0.45, Paint),
        (0.05, 0.53, Paint),
        (0.11, 0.59, Paint),
        (0.17, 0.635, Pane),
        (0.335, 0.925, Paint),
        (0.41, 0.985, Paint),
        (0.52, 1.0, Paint),
        (0.76, 0.985, Paint),
        (0.89, 0.935, Pane),
        (0.965, 0.66, Paint),
        (0.985, 0.60, Paint),
        (1.0, 0.44, Paint),
    ],
    belt: &[
        (0.0, 0.32),
        (0.02, 0.43),
        (0.1, 0.53),
        (0.2, 0.585),
        (0.9, 0.65),
        (0.98, 0.57),
        (1.0, 0.41),
    ],
    plan: ROUND_PLAN,
    roof: 0.76,
    windows: (0.215, 0.91),
    pillars: &[0.47, 0.70],
    mirror: 0.265,
    clearance_m: 0.16,
    doors: 4,
    is_angular: false,
};
/// A jeep: flat bonnet, upright windscreen, straight sides.
pub(super) const JEEP: Silhouette = Silhouette {
    top: &[
        (0.0, 0.50, Paint),
        (0.008, 0.585, Paint),
        (0.02, 0.60, Paint),
        (0.325, 0.625, Paint),
        (0.335, 0.63, Pane),
        (0.385, 0.955, Paint),
        (0.40, 0.985, Paint),
        (0.6, 1.0, Paint),
        (0.965, 0.99, Pane),
        (0.985, 0.60, Paint),
        (1.0, 0.54, Paint),
    ],
    belt: &[(0.0, 0.46), (0.02, 0.57), (0.33, 0.60), (0.97, 0.61), (1.0, 0.50)],
    plan: &[
        (0.0, 0.70),
        (0.02, 0.74),
        (0.18, 0.80),
        (0.32, 0.98),
        (0.36, 1.0),
        (0.985, 1.0),
        (1.0, 0.96),
    ],
    roof: 0.90,
    windows: (0.365, 0.955),
    pillars: &[0.59],
    mirror: 0.385,
    clearance_m: 0.30,
    doors: 2,
    is_angular: true,
};

/// A curve through the points of a table sorted by x, flat beyond its ends: monotone cubics
/// (Fritsch and Butland 1984), so that nothing bulges between two points, or straight lines.
fn curve(points: &[(f32, f32)], x: f32, is_angular: bool) -> f32 {
    let last = points.len() - 1;
    if x <= points[0].0 {
        return points[0].1;
    }
    let Some(right) = points.iter().position(|point| x <= point.0) else { return points[last].1 };
    let left = right - 1;
    let ((x0, y0), (x1, y1)) = (points[left], points[right]);
    let width = x1 - x0;
    let t = (x - x0) / width;
    if is_angular {
        return y0 + (y1 - y0) * t;
    }
    let slope = |from: usize| {
        let (a, b) = (points[from], points[from + 1]);
        (b.1 - a.1) / (b.0 - a.0)
    };
    let tangent = |at: usize| {
        if at == 0 || at == last {
            return slope(at.min(last - 1));
        }
        let (before, after) = (slope(at - 1), slope(at));
        if before * after <= 0.0 {
            return 0.0;
        }
        let (a, b) = (points[at].0 - points[at - 1].0, points[at + 1].0 - points[at].0);
        let (wa, wb) = (2.0 * b + a, b + 2.0 * a);
        (wa + wb) / (wa / before + wb / after)
    };
    let (m0, m1) = (tangent(left) * width, tangent(right) * width);
    let (t2, t3) = (t * t, t * t * t);
    y0 * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m0 * (t3 - 2.0 * t2 + t)
        + y1 * (3.0 * t2 - 2.0 * t3)
        + m1 * (t3 - t2)
}

impl Silhouette {
    /// Upper edge, as a share of the height.
    pub(super) fn top(&self, share: f32) -> f32 {
        let points: Vec<(f32, f32)> = self.top.iter().map(|point| (point.0, point.1)).collect();
        curve(&points, share, self.is_angular)
    }

    /// Window sill, as a share of the height.
    pub(super) fn belt(&self, share: f32) -> f32 {
        curve(self.belt, share, self.is_angular)
    }

    /// Half width, as a share of the body's.
    pub(super) fn plan(&self, share: f32) -> f32 {
        curve(self.plan, share, self.is_angular)
    }

    fn skin(&self, x: f32) -> Skin {
        self.top.iter().rev().find(|point| point.0 <= x).map_or(Paint, |point| point.2)
    }

    fn is_window(&self, x: f32) -> bool {
        x > self.windows.0 && x < self.windows.1 && !self.is_pillar(x)
    }

    fn is_pillar(&self, x: f32) -> bool {
        self.pillars.iter().any(|pillar| (x - pillar).abs() < PILLAR)
    }

    /// From where to where each of the left doors goes, front first.
    pub(super) fn door_cuts(&self) -> Vec<(f32, f32)> {
        let first =
            (self.windows.0 - 0.012, self.pillars.first().copied().unwrap_or(self.windows.1));
        let rear = self.pillars.get(1).copied().unwrap_or(self.windows.1 - 0.03);
        match self.doors {
            0 => Vec::new(),
            2 => vec![first],
            _ => vec![first, (first.1 + SEAM, rear)],
        }
    }
}

/// Colours of parts that are not the actor's own.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Livery {
    /// Everything above the window sill.
    pub(super) upper: Option<[u8; 3]>,
    pub(super) doors: Option<[u8; 3]>,
}

impl Measure<'_> {
    /// x of a share of the length. Metres.
    pub(super) fn at(&self, share: f32) -> f32 {
        self.nose_m - RELIEF - share * (self.size_m.x - 2.0 * RELIEF)
    }
}

/// By how much lamps and plates stand out of the body. Metres.
const RELIEF: f32 = 0.012;
/// Half the share of the length that a pillar takes.
const PILLAR: f32 = 0.010;
/// The share of the length that the gap between a door and its frame takes.
const SEAM: f32 = 0.0035;
/// The object of the body beside its doors, if it has any, and of the first door.
pub(super) const SHELL: u32 = 5;

/// The body, without wheels; nose at `measure.nose_m`, mirrors included. Doors are objects of
/// their own, after [`SHELL`], in CARLA's order.
pub(super) fn body(clay: &mut Clay, shape: &Silhouette, measure: &Measure, livery: Livery) {
    let stations = stations(shape, measure);
    // Lamps and plates stand out by `RELIEF` and make up the full length.
    let rings: Vec<Vec<Vec3>> = stations.iter().map(|x| ring(shape, measure, *x)).collect();
    let doors = shape.door_cuts();
    let shell = if doors.is_empty() { 0 } else { SHELL };
    clay.object(shell).material(Material::CarPaint);
    clay.loft_with(&rings, |usual, band, side| {
        let with = |material: Material| Face { material: material as u8, ..usual };
        if band == FIRST_CAP || band == LAST_CAP {
            return usual;
        }
        let middle = (stations[band] + stations[band + 1]) * 0.5;
        let row = side.min(RING - 1 - side);
        let upper = Face { tint: livery.upper.map_or(0, Face::tint), ..usual };
        let mut face = match row {
            0 | 1 => with(Material::Plastic),
            8 | 9 if shape.is_window(middle) => with(Material::Glass),
            8 | 9 if shape.is_pillar(middle) => with(Material::Plastic),
            11..=13 if shape.skin(middle) == Pane => with(Material::Glass),
            8..=13 => upper,
            _ => usual,
        };
        if (2..=9).contains(&row) {
            let is_left = side < RING / 2;
            for (door, (from, to)) in doors.iter().enumerate() {
                if middle > *from && middle < *to {
                    face.object = shell + 1 + 2 * door as u32 + u32::from(!is_left);
                    if row <= 7 {
                        face.tint = livery.doors.map_or(0, Face::tint);
                    }
                }
                let is_seam = (middle > from - SEAM && middle < *from)
                    || (middle > *to && middle < to + SEAM);
                if is_seam && row <= 7 {
                    (face.material, face.tint) = (Material::Plastic as u8, 0);
                }
            }
        }
        face
    });
    linings(clay, shape, measure);
    trim::mirrors_and_handles(clay, shape, measure);
    if !doors.is_empty() {
        interior(clay, shape, measure);
    }
    clay.object(shell);
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

/// Floor, dashboard and seats: seen through an open door.
fn interior(clay: &mut Clay, shape: &Silhouette, measure: &Measure) {
    clay.object(INTERIOR).material(Material::Plastic);
    let (half, height) = (measure.body_m * 0.5, measure.size_m.z);
    let cuts = shape.door_cuts();
    let (front, rear) = (cuts[0].0, cuts[cuts.len() - 1].1);
    let floor = shape.clearance_m + 0.10;
    let belt = shape.belt(front) * height;
    let x = |share: f32| measure.at(share);
    clay.block(
        vec3(x(rear + 0.03), -half * 0.9, floor - 0.04),
        vec3(x(front - 0.03), half * 0.9, floor),
    );
    clay.block(
        vec3(x(front + 0.035), -half * 0.86, belt - 0.22),
        vec3(x(front - 0.01), half * 0.86, belt),
    );
    let seats: &[f32] = if cuts.len() > 1 { &[0.62, 0.55] } else { &[0.62] };
    for ((from, to), back) in cuts.iter().zip(seats) {
        let seat = x(from + (to - from) * back);
        for y in [half * 0.45, -half * 0.45] {
            clay.tinted(Material::Cloth, [70, 66, 62]);
            clay.block(
                vec3(seat - 0.10, y - 0.23, floor),
                vec3(seat + 0.42, y + 0.23, floor + 0.32),
            );
            let lean = Quat::from_rotation_y(-0.3);
            clay.block_at(vec3(seat - 0.16, y, floor + 0.58), vec3(0.06, 0.22, 0.34), lean);
        }
    }
    clay.material(Material::LampInterior);
    let roof = shape.top((front + rear) * 0.5) * height - 0.06;
    clay.block(
        vec3(x((front + rear) * 0.5) - 0.06, -0.08, roof - 0.02),
        vec3(x((front + rear) * 0.5) + 0.06, 0.08, roof),
    );
}

/// Where to cut the body, tail first.
fn stations(shape: &Silhouette, measure: &Measure) -> Vec<f32> {
    let mut cuts: Vec<f32> = shape.top.iter().map(|point| point.0).collect();
    let doors = shape.door_cuts();
    cuts.extend(doors.iter().flat_map(|(from, to)| [*from, *to, from - SEAM, to + SEAM]));
    cuts.extend([shape.windows.0, shape.windows.1]);
    cuts.extend(shape.pillars.iter().flat_map(|pillar| [pillar - PILLAR, pillar + PILLAR]));
    cuts.extend(shape.plan.iter().map(|point| point.0));
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
    let keep = |kept: &mut Vec<f32>, cut: f32, near: f32| {
        let near = near / measure.size_m.x;
        if (0.0..=1.0).contains(&cut) && !kept.iter().any(|other| (other - cut).abs() < near) {
            kept.push(cut);
        }
    };
    cuts.iter().for_each(|cut| keep(&mut kept, *cut, 0.010));
    if !shape.is_angular {
        let steps = ((measure.size_m.x / 0.17) as u32).min(30);
        (1..steps).for_each(|k| keep(&mut kept, k as f32 / steps as f32, 0.095));
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

/// Points of a ring: 15 up the left side, 13 down the right.
const RING: usize = 28;

/// The outline across the car at one station.
fn ring(shape: &Silhouette, measure: &Measure, share: f32) -> Vec<Vec3> {
    let (x_m, height) = (measure.at(share), measure.size_m.z);
    let top = shape.top(share) * height;
    let belt = (shape.belt(share) * height).min(top - 0.03);
    let half = shape.plan(share) * measure.body_m * 0.5;
    let sill = sill(shape, measure, x_m, share).min(belt - 0.06);
    let usual_sill = shape.clearance_m.min(belt - 0.06);
    let waist = (usual_sill + (belt - usual_sill) * 0.55).max(sill + (belt - sill) * 0.30);

    // How much of the greenhouse stands here: 0 on the bonnet, 1 under the roof.
    let rise = ((top - belt) / (height * 0.30)).clamp(0.0, 1.0);
    let roof = half * (0.86 + (shape.roof - 0.86) * rise);
    let crown = if shape.is_angular { 0.008 } else { 0.020 + 0.012 * rise }.min((top - belt) * 0.4);
    let shoulder = (belt + 0.008).min(top - crown * 2.4);
    let foot = half * 0.93;
    let edge = top - crown * 2.2;
    let glass = |t: f32| {
        (
            foot + (roof - foot) * t + 0.035 * rise * t * (1.0 - t),
            shoulder + 0.012 * (1.0 - t) + (edge - shoulder) * t,
        )
    };
    let left = [
        (0.0, sill),
        (half * 0.80, sill),
        (half * 0.955, sill + 0.02),
        (half * 0.988, sill + (waist - sill) * 0.35),
        (half, waist),
        (half * 0.994, waist + (belt - waist) * 0.5),
        (half * 0.975, belt - 0.008),
        (half * 0.950, shoulder),
        glass(0.0),
        glass(0.5),
        glass(1.0),
        (roof * 0.93, top - crown * 1.15),
        (roof * 0.75, top - crown * 0.6),
        (roof * 0.42, top - crown * 0.18),
        (0.0, top),
    ];
    let right = left[1..14].iter().rev().map(|(y, z)| vec3(x_m, -y, *z));
    left.iter().map(|(y, z)| vec3(x_m, *y, *z)).chain(right).collect()
}
