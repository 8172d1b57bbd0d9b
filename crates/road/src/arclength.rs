//! Arc lengths of parametric cubics, converted back into parameters.

use crate::polynomial::{GAUSS_7, slope};

/// The parameter of a parametric cubic as a function of the arc length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ArcLength {
    /// Arc length at `KNOTS` equidistant parameters and at the end, metres.
    pub(crate) lengths: [f64; KNOTS + 1],
    /// Derivative dp/ds at the knots.
    pub(crate) rates: [f64; KNOTS + 1],
    pub(crate) u: [f64; 4],
    pub(crate) v: [f64; 4],
    pub(crate) p_end: f64,
    /// The curve's actual length divided by the length that the file declares.
    pub(crate) stretch: f64,
}

const KNOTS: usize = 8;

impl ArcLength {
    pub(crate) fn new(u: [f64; 4], v: [f64; 4], p_end: f64, declared_m: f64) -> ArcLength {
        let step = p_end / KNOTS as f64;
        let mut lengths = [0.0; KNOTS + 1];
        for knot in 0..KNOTS {
            let from = step * knot as f64;
            lengths[knot + 1] = lengths[knot] + length(&u, &v, from, from + step);
        }
        let mut rates = [0.0; KNOTS + 1];
        for (knot, rate) in rates.iter_mut().enumerate() {
            *rate = 1.0 / speed(&u, &v, step * knot as f64);
        }
        let own = lengths[KNOTS];
        let stretch = if declared_m > 0.0 && own > 0.0 { own / declared_m } else { 1.0 };
        ArcLength { lengths, rates, u, v, p_end, stretch }
    }

    /// Returns the curve's actual length where the file declares `declared_m`.
    pub(crate) fn own_length(&self, declared_m: f64) -> f64 {
        self.stretch * declared_m
    }

    /// Returns the parameter at `ds` metres of the declared length.
    pub(crate) fn parameter(&self, ds: f64) -> f64 {
        let target = ds * self.stretch;
        let step = self.p_end / KNOTS as f64;
        let knot = self.lengths.partition_point(|&length| length <= target).clamp(1, KNOTS) - 1;
        let (from, to) = (self.lengths[knot], self.lengths[knot + 1]);
        let start = step * knot as f64;
        let mut p = start + self.first_guess(knot, target - from, to - from);
        for _ in 0..4 {
            let wrong = from + length(&self.u, &self.v, start, p) - target;
            let speed = speed(&self.u, &self.v, p);
            if speed < 1e-9 {
                break;
            }
            p -= wrong / speed;
            // Newton's method squares the error, relative to the scale on which the speed changes.
            if wrong.abs() < 1e-5 {
                break;
            }
        }
        // The curve continues a little beyond its ends, for queries with rounding errors.
        p.clamp(-0.1 * self.p_end.abs(), 1.1 * self.p_end.abs())
    }

    /// Returns the parameter after `length` of the `whole` length between two knots: the cubic with
    /// the right slopes at both.
    fn first_guess(&self, knot: usize, length: f64, whole: f64) -> f64 {
        let step = self.p_end / KNOTS as f64;
        if whole <= 0.0 {
            return 0.0;
        }
        let x = length / whole;
        let slope = |rate: f64| if rate.is_finite() { rate * whole } else { step };
        let (from, to) = (slope(self.rates[knot]), slope(self.rates[knot + 1]));
        let (x2, x3) = (x * x, x * x * x);
        (x3 - 2.0 * x2 + x) * from + (3.0 * x2 - 2.0 * x3) * step + (x3 - x2) * to
    }

    /// Returns the parameter at which the curve has the length `length_m`.
    pub(crate) fn reach(u: [f64; 4], v: [f64; 4], length_m: f64) -> f64 {
        let mut p = length_m;
        for _ in 0..50 {
            let pieces = 16;
            let step = p / pieces as f64;
            let own: f64 =
                (0..pieces).map(|n| length(&u, &v, step * n as f64, step * (n + 1) as f64)).sum();
            let wrong = own - length_m;
            if wrong.abs() < 1e-10 * length_m.max(1.0) {
                break;
            }
            p = (p - wrong / speed(&u, &v, p).max(1e-9)).clamp(0.0, length_m.max(0.0));
        }
        p
    }
}

fn speed(u: &[f64; 4], v: &[f64; 4], p: f64) -> f64 {
    let (du, dv) = (slope(u, p), slope(v, p));
    (du * du + dv * dv).sqrt()
}

fn length(u: &[f64; 4], v: &[f64; 4], from: f64, to: f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS_7.iter().map(|(node, weight)| weight * speed(u, v, middle + half * node)).sum::<f64>()
        * half
}
