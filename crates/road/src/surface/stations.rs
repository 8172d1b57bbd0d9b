//! Stations: where along a section the surface is sampled.

use glam::DVec3;

use crate::{
    axes::RoadAxes,
    network::Network,
    road::{Road, Section},
};

/// Largest distance between a straight piece and the curve that it stands for, metres.
const CHORD_M: f64 = 0.005;

/// Smallest distance between two stations, unless a section is shorter, metres.
pub(super) const NEAR_M: f64 = 0.02;

/// Returns s values in rising order, from the section's start to its end: the `wanted` ones, and
/// between them as many as the bends of the outer borders and the reference line require.
pub(super) fn stations(
    network: &Network,
    road: &Road,
    section: &Section,
    spacing: f64,
    mut wanted: Vec<f64>,
) -> Vec<f64> {
    let (start, end) = (section.start_m, section.start_m + section.length_m);
    wanted.sort_by(f64::total_cmp);
    let mut knots = vec![start];
    for s in wanted {
        if s > knots[knots.len() - 1] + NEAR_M && s < end - NEAR_M {
            knots.push(s);
        }
    }
    if end > start {
        knots.push(end);
    }
    let outline = Outline { network, road, section };
    let mut found = vec![start];
    for pair in knots.windows(2) {
        let pieces = ((pair[1] - pair[0]) / spacing).ceil().clamp(1.0, 1e6) as usize;
        let step = (pair[1] - pair[0]) / pieces as f64;
        for piece in 0..pieces {
            let from = pair[0] + step * piece as f64;
            let to = if piece + 1 == pieces { pair[1] } else { from + step };
            outline.split(from, to, outline.at(from), outline.at(to), &mut found);
        }
    }
    found
}

struct Outline<'a> {
    network: &'a Network,
    road: &'a Road,
    section: &'a Section,
}

impl Outline<'_> {
    /// Returns the leftmost border, the reference line and the rightmost border.
    fn at(&self, s: f64) -> [DVec3; 3] {
        let axes = RoadAxes::new(self.road.station(s));
        let ds = s - self.section.start_m;
        let centre = self.section.lane_offset(self.road, s).value;
        let lanes = self.network.lanes();
        let border = |position: usize, sign: f64| {
            centre + sign * self.section.borders(lanes, position, ds).outer.value
        };
        let left = if self.section.left > 0 { border(0, 1.0) } else { centre };
        let last = self.section.lanes.len();
        let right = if last > self.section.left { border(last - 1, -1.0) } else { centre };
        [left, centre, right].map(|t| axes.point(t, 0.0, 0.0))
    }

    /// Adds `to`, preceded by the stations that the curve before it requires.
    fn split(&self, from: f64, to: f64, first: [DVec3; 3], last: [DVec3; 3], found: &mut Vec<f64>) {
        if to - from > 2.0 * NEAR_M {
            let middle = 0.5 * (from + to);
            let curve = self.at(middle);
            let off = |shares: f64, curve: &[DVec3; 3]| {
                (0..3).any(|line| {
                    curve[line].distance(first[line].lerp(last[line], shares)) > CHORD_M
                })
            };
            // Two triangles do not follow a cell that twists.
            let turn = |s: f64| self.road.superelevation.at(s);
            let twist = (turn(from) - turn(to)).abs().max((turn(from) - turn(middle)).abs());
            let wide = first[0].distance(first[1]).max(first[1].distance(first[2]));
            let twisted = 0.25 * twist * wide > CHORD_M;
            // An S-bend crosses its chord in the middle; the quarter reveals it.
            if twisted || off(0.5, &curve) || off(0.25, &self.at(0.75 * from + 0.25 * to)) {
                self.split(from, middle, first, curve, found);
                self.split(middle, to, curve, last, found);
                return;
            }
        }
        found.push(to);
    }
}
