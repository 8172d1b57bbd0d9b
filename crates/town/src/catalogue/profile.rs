//! The profiles of car bodies.
//!
//! Tables are in fractions: x from 0 at the nose to 1 at the tail, heights of the whole height,
//! widths of the body's half width. Smooth curves pass through the points; bodies of flat sheets use
//! straight lines.

use glam::Vec3;

use crate::catalogue::blueprint::Wheel;

/// The material of the upper skin from one point of the profile to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Skin {
    /// Painted sheet metal.
    Paint,
    /// Windscreen or rear window.
    Pane,
}
/// The silhouette of a class of cars.
#[derive(Debug)]
pub(super) struct Silhouette {
    /// The upper edge in side view, nose to tail.
    pub(super) top: &'static [(f32, f32, Skin)],
    /// The height of the window sill.
    pub(super) belt: &'static [(f32, f32)],
    /// The half width in top view.
    pub(super) plan: &'static [(f32, f32)],
    /// The half width of the roof.
    pub(super) roof: f32,
    /// The start and end of the side windows.
    pub(super) windows: (f32, f32),
    /// The pillars between the side windows.
    pub(super) pillars: &'static [f32],
    /// The position of the mirrors.
    pub(super) mirror: f32,
    /// The ground clearance. Metres.
    pub(super) clearance_m: f32,
    /// The number of doors that open: 0, 2 or 4.
    pub(super) doors: u8,
    /// Whether the body is of flat sheets with unpainted bumpers: straight lines connect the points of the tables.
    pub(super) is_angular: bool,
    /// The control cage of the body, a text of the form that [`cage`](super::cage) reads.
    pub(super) cage: &'static str,
}

/// The dimensions of a vehicle, and its wheels.
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

/// A curve through the points of a table sorted by x, constant beyond its ends: monotone cubics
/// (Fritsch and Butland 1984), which do not overshoot between two points, or straight lines.
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
    /// The upper edge, as a fraction of the height.
    pub(super) fn top(&self, fraction: f32) -> f32 {
        let points: Vec<(f32, f32)> = self.top.iter().map(|point| (point.0, point.1)).collect();
        curve(&points, fraction, self.is_angular)
    }

    /// Whether the tail is about as tall as the roof, as that of a van.
    pub(super) fn has_tall_tail(&self) -> bool {
        self.top(0.99) > 0.85
    }

    /// The window sill, as a fraction of the height.
    pub(super) fn belt(&self, fraction: f32) -> f32 {
        curve(self.belt, fraction, self.is_angular)
    }

    /// The half width, as a fraction of the body's half width.
    pub(super) fn plan(&self, fraction: f32) -> f32 {
        curve(self.plan, fraction, self.is_angular)
    }

    /// The lower edge of the windscreen: fractions of the length and of the height.
    pub(super) fn cowl(&self) -> Option<(f32, f32)> {
        let pane = self.top.iter().find(|point| point.2 == Skin::Pane)?;
        Some((pane.0, pane.1))
    }

    /// The start and end of each left door, front first.
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

impl Measure<'_> {
    /// The x coordinate at a fraction of the length. Metres.
    pub(super) fn at(&self, fraction: f32) -> f32 {
        self.nose_m - RELIEF - fraction * (self.size_m.x - 2.0 * RELIEF)
    }
}

/// The distance by which lamps and plates protrude from the body. Metres.
pub(super) const RELIEF: f32 = 0.012;
/// The width of the gap between a door and its frame, as a fraction of the length.
pub(super) const SEAM: f32 = 0.0035;
/// The object of the body without its doors, if it has doors; the objects of the doors follow.
pub(super) const SHELL: u32 = 5;
