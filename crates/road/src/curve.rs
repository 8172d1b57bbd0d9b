//! Curves of the plan view: the course of the reference line in x and y.

use glam::DVec2;

use crate::{
    arclength::ArcLength,
    polynomial::{GAUSS_7, bend, slope, value},
};

/// A point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CurvePoint {
    pub(crate) position: DVec2,
    pub(crate) heading_rad: f64,
    /// Positive to the left.
    pub(crate) curvature_per_m: f64,
    /// Change of the curvature per metre.
    pub(crate) curvature_slope: f64,
}

/// One `<geometry>` of a plan view.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Curve {
    /// Where it begins, metres of the road's s.
    pub(crate) from_m: f64,
    pub(crate) length_m: f64,
    pub(crate) start: DVec2,
    pub(crate) heading_rad: f64,
    /// The direction at the start.
    pub(crate) ahead: DVec2,
    pub(crate) shape: Shape,
}

/// The kind of a curve, with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    Line,
    Arc {
        curvature: f64,
    },
    Spiral {
        from: f64,
        slope: f64,
    },
    /// u(p) and v(p); `arc` converts lengths into p.
    Cubic {
        u: [f64; 4],
        v: [f64; 4],
        arc: Box<ArcLength>,
    },
}

impl Shape {
    /// Creates a spiral with curvatures `from` and `to` at its ends; a line or an arc where they
    /// are equal.
    pub(crate) fn spiral(from: f64, to: f64, length_m: f64) -> Shape {
        let slope = if length_m > 0.0 { (to - from) / length_m } else { 0.0 };
        if slope.abs() < 1e-14 {
            return if from.abs() < 1e-14 { Shape::Line } else { Shape::Arc { curvature: from } };
        }
        Shape::Spiral { from, slope }
    }

    /// Creates a parametric cubic over p from 0 to `p_end`, parametrised by length.
    pub(crate) fn cubic(u: [f64; 4], v: [f64; 4], p_end: f64, length_m: f64) -> Shape {
        Shape::Cubic { u, v, arc: Box::new(ArcLength::new(u, v, p_end, length_m)) }
    }

    /// Creates v as a polynomial of u, up to the arc length `length_m`.
    pub(crate) fn poly3(v: [f64; 4], length_m: f64) -> Shape {
        let u = [0.0, 1.0, 0.0, 0.0];
        let u_end = ArcLength::reach(u, v, length_m);
        Shape::cubic(u, v, u_end, length_m)
    }
}

impl Curve {
    pub(crate) fn new(
        from_m: f64,
        length_m: f64,
        start: DVec2,
        heading_rad: f64,
        shape: Shape,
    ) -> Curve {
        let ahead = DVec2::from_angle(heading_rad);
        Curve { from_m, length_m, start, heading_rad, ahead, shape }
    }

    /// Moves the curve by `by`.
    pub(crate) fn shift(&mut self, by: DVec2) {
        self.start += by;
    }

    pub(crate) fn start(&self) -> DVec2 {
        self.start
    }

    /// Returns the point at `ds` metres from the curve's start.
    pub(crate) fn at(&self, ds: f64) -> CurvePoint {
        let (local, turn, curvature, slope) = self.shape.at(ds);
        CurvePoint {
            position: self.start + self.ahead.rotate(local),
            heading_rad: self.heading_rad + turn,
            curvature_per_m: curvature,
            curvature_slope: slope,
        }
    }

    /// Returns position, direction and curvature at `ds` metres from the curve's start.
    pub(crate) fn ray(&self, ds: f64) -> (DVec2, DVec2, f64) {
        let (local, along, curvature) = match &self.shape {
            Shape::Line => (DVec2::new(ds, 0.0), DVec2::X, 0.0),
            Shape::Cubic { u, v, arc } => {
                let p = arc.parameter(ds);
                let along = DVec2::new(slope(u, p), slope(v, p));
                let bend = DVec2::new(bend(u, p), bend(v, p));
                let speed = along.length().max(1e-9);
                (
                    DVec2::new(value(u, p), value(v, p)),
                    along / speed,
                    along.perp_dot(bend) / (speed * speed * speed),
                )
            }
            shape => {
                let (local, turn, curvature, _) = shape.at(ds);
                (local, DVec2::from_angle(turn), curvature)
            }
        };
        (self.start + self.ahead.rotate(local), self.ahead.rotate(along), curvature)
    }

    /// Returns the curve's actual length for shapes whose declared length can be wrong.
    pub(crate) fn own_length(&self) -> Option<f64> {
        match &self.shape {
            Shape::Cubic { arc, .. } => Some(arc.own_length(self.length_m)),
            _ => None,
        }
    }

    /// Returns by how much the curve turns, whatever the side, radians. A cubic turns by less than once
    /// round.
    pub(crate) fn turn_rad(&self) -> f64 {
        match self.shape {
            Shape::Line | Shape::Cubic { .. } => 0.0,
            Shape::Arc { curvature } => curvature.abs() * self.length_m,
            Shape::Spiral { from, slope } => {
                let end = from + slope * self.length_m;
                if from * end >= 0.0 {
                    0.5 * (from + end).abs() * self.length_m
                } else {
                    // Two triangles, before and after the curvature is 0.
                    0.5 * (from * from + end * end) / slope.abs()
                }
            }
        }
    }

    /// Returns whether the curve is a straight line.
    pub(crate) fn is_line(&self) -> bool {
        matches!(self.shape, Shape::Line)
    }
}

impl Shape {
    /// Returns position, heading, curvature and its slope in the curve's own axes.
    fn at(&self, ds: f64) -> (DVec2, f64, f64, f64) {
        match self {
            Shape::Line => (DVec2::new(ds, 0.0), 0.0, 0.0, 0.0),
            Shape::Arc { curvature } => {
                let turn = curvature * ds;
                (chord(ds, turn), turn, *curvature, 0.0)
            }
            Shape::Spiral { from, slope } => {
                let turn = ds * (from + 0.5 * slope * ds);
                (clothoid(*from, *slope, ds), turn, from + slope * ds, *slope)
            }
            Shape::Cubic { u, v, arc } => {
                let p = arc.parameter(ds);
                let (pu, pv) = (value(u, p), value(v, p));
                let (du, dv) = (slope(u, p), slope(v, p));
                let (ddu, ddv) = (bend(u, p), bend(v, p));
                let speed = (du * du + dv * dv).sqrt().max(1e-9);
                let cross = du * ddv - dv * ddu;
                let curvature = cross / (speed * speed * speed);
                let (dddu, dddv) = (6.0 * u[3], 6.0 * v[3]);
                let cross_slope = du * dddv - dv * dddu;
                let speed_slope = (du * ddu + dv * ddv) / speed;
                let per_p = cross_slope / speed.powi(3) - 3.0 * cross * speed_slope / speed.powi(4);
                (DVec2::new(pu, pv), dv.atan2(du), curvature, per_p / speed)
            }
        }
    }
}

/// Returns the end of an arc of length `ds` that turns by `turn`; stable for vanishing turns.
fn chord(ds: f64, turn: f64) -> DVec2 {
    let half = 0.5 * turn;
    // sin(h)/h, by its series where the quotient would lose digits.
    let sinc = if half.abs() < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    let (sin, cos) = half.sin_cos();
    DVec2::new(cos, sin) * (ds * sinc)
}

/// Returns the end of a clothoid of initial curvature `from` and curvature slope `slope` after
/// `ds`: the Fresnel integrals by Gauss-Legendre quadrature, in panels that turn so little that
/// seven nodes leave less than a nanometre over the lengths of roads.
fn clothoid(from: f64, slope: f64, ds: f64) -> DVec2 {
    let most = from.abs().max((from + slope * ds).abs());
    let panels = ((most * ds.abs()).min(1e4) / 1.0).ceil().max(1.0) as usize;
    let half = 0.5 * ds / panels as f64;
    let mut sum = DVec2::ZERO;
    for panel in 0..panels {
        let middle = half * (2 * panel + 1) as f64;
        for (node, weight) in GAUSS_7 {
            let at = middle + half * node;
            let (sin, cos) = (at * (from + 0.5 * slope * at)).sin_cos();
            sum += DVec2::new(cos, sin) * weight;
        }
    }
    sum * half
}
