//! The OpenDRIVE elements that all roads share, and the ids of everything.

use std::fmt::Write as _;

use crate::{
    curve::Piece,
    junction::{Arm, Junction},
    layout::Layout,
    plan::Plan,
    street::Class,
};

/// The height of sidewalks above the road. Metres.
const KERB_M: f64 = 0.12;

/// The document while it is write_plan.
pub(super) struct Document<'a> {
    pub(super) layout: &'a Layout,
    pub(super) junctions: &'a [Junction],
    /// The reference line of each street, between the mouths of its junctions.
    pub(super) lines: Vec<Vec<Piece>>,
    /// By street: the junctions at its start and end, each with the index of the street's arm.
    pub(super) arms_of_streets: Vec<[(usize, usize); 2]>,
    pub(super) numbers: Numbers,
    pub(super) text: String,
}

/// The first id of each kind of element. The ranges do not overlap.
pub(super) struct Numbers {
    /// By junction: the id of its first connecting road.
    pub(super) connecting: Vec<usize>,
    pub(super) junction: usize,
    pub(super) crosswalk: usize,
    pub(super) signal: usize,
    pub(super) sign: usize,
    pub(super) controller: usize,
}

impl Numbers {
    pub(super) fn new(layout: &Layout, junctions: &[Junction]) -> Numbers {
        let after = |count: usize| count.next_multiple_of(1000);
        let mut next = after(layout.streets.len() + 1);
        let mut connecting = Vec::new();
        for junction in junctions {
            connecting.push(next);
            next += junction.turns.len();
        }
        let junction = after(next);
        let ends = 2 * layout.streets.len();
        let crosswalk = junction + after(junctions.len());
        let signal = crosswalk + after(ends);
        let sign = signal + after(ends);
        Numbers { connecting, junction, crosswalk, signal, sign, controller: sign + after(ends) }
    }
}

macro_rules! put {
    ($document:expr, $($format:tt)*) => {
        // Writing to a String cannot fail.
        let _ = writeln!($document.text, $($format)*);
    };
}
pub(super) use put;

impl Document<'_> {
    pub(super) fn header(&mut self, plan: &Plan) {
        let (mut low, mut high) = (glam::DVec2::MAX, glam::DVec2::MIN);
        for piece in self.lines.iter().flatten() {
            let at = piece.start.position;
            (low, high) = (low.min(at), high.max(at));
        }
        put!(self, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>");
        put!(self, "<OpenDRIVE>");
        put!(
            self,
            "<header revMajor=\"1\" revMinor=\"4\" name=\"{}\" version=\"1\" \
             date=\"2026-01-01T00:00:00\" north=\"{:.2}\" south=\"{:.2}\" east=\"{:.2}\" \
             west=\"{:.2}\" vendor=\"Omnibus\">",
            escaped(&plan.name),
            high.y + 30.0,
            low.y - 30.0,
            high.x + 30.0,
            low.x - 30.0
        );
        put!(
            self,
            "<geoReference><![CDATA[+proj=tmerc +lat_0=52.52 +lon_0=13.4 +k=1 +x_0=0 +y_0=0 \
             +datum=WGS84 +units=m +no_defs]]></geoReference>"
        );
        put!(self, "</header>");
    }

    pub(super) fn limit(&mut self, class: Class, kmh: f64) {
        let kind = match class {
            Class::Ring | Class::Town => "town",
            Class::Rural => "rural",
            Class::Ramp | Class::Motorway => "motorway",
        };
        put!(self, "<type s=\"0\" type=\"{kind}\"><speed max=\"{kmh}\" unit=\"km/h\"/></type>");
    }

    pub(super) fn plan_view(&mut self, pieces: &[Piece]) {
        put!(self, "<planView>");
        let mut s = 0.0;
        for piece in pieces {
            let (position, heading) = (piece.start.position, piece.start.heading);
            let shape = if piece.curvature == 0.0 {
                "<line/>".to_string()
            } else {
                format!("<arc curvature=\"{:.12}\"/>", piece.curvature)
            };
            put!(
                self,
                "<geometry s=\"{s:.9}\" x=\"{:.9}\" y=\"{:.9}\" hdg=\"{:.12}\" \
                 length=\"{:.9}\">{shape}</geometry>",
                position.x,
                position.y,
                heading,
                piece.length
            );
            s += piece.length;
        }
        put!(self, "</planView>");
    }

    /// Writes cubics through these distances, heights and slopes.
    pub(super) fn elevation(&mut self, knots: &[[f64; 3]]) {
        put!(self, "<elevationProfile>");
        for pair in knots.windows(2) {
            let ([s, from, b], [end, to, slope]) = (pair[0], pair[1]);
            let (run, climb) = (end - s, to - from);
            let c = (3.0 * climb / run - 2.0 * b - slope) / run;
            let d = (b + slope - 2.0 * climb / run) / run.powi(2);
            put!(
                self,
                "<elevation s=\"{s:.9}\" a=\"{from:.9}\" b=\"{b:.12}\" c=\"{c:.14}\" \
                 d=\"{d:.16}\"/>"
            );
        }
        put!(self, "</elevationProfile>");
        put!(self, "<lateralProfile/>");
    }

    pub(super) fn mark(&mut self, kind: &str, color: &str, wide: f64, change: &str) {
        put!(
            self,
            "<roadMark sOffset=\"0\" type=\"{kind}\" weight=\"standard\" color=\"{color}\" \
             width=\"{wide:.2}\" laneChange=\"{change}\"/>"
        );
    }

    pub(super) fn raised(&mut self) {
        put!(self, "<height sOffset=\"0\" inner=\"{KERB_M}\" outer=\"{KERB_M}\"/>");
    }

    /// The junction at an end of a street, and the street's arm there.
    pub(super) fn arm(&self, street: usize, end: usize) -> (usize, &Arm) {
        let (number, arm) = self.arms_of_streets[street][end];
        (number, &self.junctions[number].arms[arm])
    }
}

impl Numbers {
    pub(super) fn junction_id(&self, number: usize) -> usize {
        self.junction + number
    }

    pub(super) fn connecting_id(&self, number: usize, turn: usize) -> usize {
        self.connecting[number] + turn
    }

    pub(super) fn signal_id(&self, street: usize, end: usize) -> usize {
        self.signal + 2 * street + end
    }

    pub(super) fn controller_id(&self, number: usize, group: usize) -> usize {
        self.controller + number * 8 + group
    }
}

pub(super) fn street_id(street: usize) -> usize {
    street + 1
}

/// Coefficients c and d of a cubic that rises by `by` over `length`, level at both ends.
pub(super) fn cubic_rise(by: f64, length: f64) -> (f64, f64) {
    (3.0 * by / length.powi(2), -2.0 * by / length.powi(3))
}

pub(super) fn width(offset: f64, a: f64, c: f64, d: f64) -> String {
    format!("<width sOffset=\"{offset:.6}\" a=\"{a:.6}\" b=\"0\" c=\"{c:.12}\" d=\"{d:.14}\"/>")
}

/// Width records through pairs of offset and width, level at each.
pub(super) fn widths(places: &[(f64, f64)]) -> String {
    let mut text = String::new();
    for pair in places.windows(2) {
        let ((from, a), (to, b)) = (pair[0], pair[1]);
        let (c, d) = if a == b { (0.0, 0.0) } else { cubic_rise(b - a, to - from) };
        let _ = writeln!(text, "{}", width(from, a, c, d));
    }
    text
}

pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
