//! Lane centres cut into pieces that are straight or almost straight.

use glam::{DVec3, Vec3};

use crate::{
    axes::RoadAxes,
    grid::{SLACK_M, Segment, Shape},
    lane::Lane,
    network::Network,
    road::{Road, Section},
};

/// Longest piece where nothing bends, metres.
const STRAIGHT_M: f64 = 24.0;
/// Longest piece where the reference line bends, metres.
const BENT_M: f64 = 6.0;
/// Longest piece where widths or banking change, of which only the ends of a piece tell, metres.
const SHAPED_M: f64 = 3.0;
/// Shortest piece, metres.
const SHORTEST_M: f64 = 0.2;
/// Desired upper bound of the distance between a lane's centre and its pieces, metres.
const SAG_M: f64 = 0.05;
/// Only a broken file yields more pieces than this.
const PIECES_MAX: f64 = 1e6;
/// What a width or banking that changes may add to the sag, metres.
const SHAPED_SAG_M: f64 = 0.02;

/// A point of a lane's centre, and half the lane's width.
type Centre = (DVec3, f64);

/// The ends of the pieces of all lanes at one s.
struct Row {
    s: f64,
    axes: RoadAxes,
    /// Curvature of the reference line, per metre.
    bend: f64,
    centres: Vec<Centre>,
}

/// Cuts the lanes of roads into pieces, in the order of the roads.
pub(super) fn of_roads(network: &Network, roads: &[Road], total_m: f64) -> Vec<Segment> {
    let mut cutter = Cutter {
        network,
        segments: Vec::new(),
        finest: (total_m / PIECES_MAX).max(SHORTEST_M),
        rows: [0, 1].map(|_| Row {
            s: 0.0,
            axes: RoadAxes::default(),
            bend: 0.0,
            centres: Vec::new(),
        }),
        knots: Vec::new(),
    };
    for road in roads {
        for section in &road.sections {
            cutter.section(road, section);
        }
    }
    cutter.segments
}

struct Cutter<'a> {
    network: &'a Network,
    segments: Vec<Segment>,
    /// Shortest piece that bends, metres.
    finest: f64,
    rows: [Row; 2],
    knots: Vec<f64>,
}

/// What applies between two knots of a section.
#[derive(Clone, Copy, PartialEq)]
enum Run {
    /// Every lane's centre is straight, with constant speed.
    Straight,
    /// Only the reference line bends.
    Bent,
    /// Widths or banking change as well.
    Shaped,
}

impl Cutter<'_> {
    fn section(&mut self, road: &Road, section: &Section) {
        if section.lanes.is_empty() {
            return;
        }
        let end = section.start_m + section.length_m;
        self.find_knots(road, section);
        for knot in 0..self.knots.len().max(1) {
            let from = self.knots.get(knot).copied().unwrap_or(section.start_m);
            let to = self.knots.get(knot + 1).copied().unwrap_or(end);
            let to = if knot + 1 == self.knots.len() { end } else { to };
            match self.run(road, section, 0.5 * (from + to)) {
                Run::Straight => self.straight(road, section, from, to),
                run => self.bent(road, section, from, to, run),
            }
        }
    }

    /// Collects where one polynomial ends and another begins; the section's start is the first.
    fn find_knots(&mut self, road: &Road, section: &Section) {
        let (start, end) = (section.start_m, section.start_m + section.length_m);
        self.knots.clear();
        let Cutter { knots, .. } = self;
        let mut add = |s: f64| {
            if s > start + KNOT_M && s < end - KNOT_M {
                knots.push(s);
            }
        };
        road.curves.iter().for_each(|curve| add(curve.from_m));
        road.elevation.knots().for_each(&mut add);
        road.lane_offset.knots().for_each(&mut add);
        for lane in &section.lanes {
            let lane = self.network.lane(*lane);
            let records = lane.widths.knots().chain(lane.borders.knots());
            let records = records.chain(lane.heights.iter().map(|height| height.from_m));
            records.for_each(|ds| add(start + ds));
        }
        knots.push(start);
        knots.sort_by(f64::total_cmp);
        knots.dedup_by(|later, earlier| *later - *earlier < KNOT_M);
    }

    fn run(&self, road: &Road, section: &Section, s: f64) -> Run {
        let ds = s - section.start_m;
        let lanes = || section.lanes.iter().map(|lane| self.network.lane(*lane));
        let is_even = |lane: &Lane| lane.widths.is_straight(ds) && lane.borders.is_empty();
        let is_flat = road.superelevation.is_zero() && road.is_even();
        if !is_flat || !road.lane_offset.is_straight(s) || !lanes().all(is_even) {
            Run::Shaped
        } else if road.is_line_at(s) && road.elevation.is_straight(s) {
            Run::Straight
        } else {
            Run::Bent
        }
    }

    fn straight(&mut self, road: &Road, section: &Section, from: f64, to: f64) {
        let count = ((to - from) / STRAIGHT_M.max(self.finest)).ceil().clamp(1.0, 1e6) as usize;
        self.sample(road, section, from, 0);
        // What applies after a knot does not yet apply here.
        self.sample(road, section, to.next_down().max(from), 1);
        for (place, lane) in section.lanes.iter().enumerate() {
            let lane = self.network.lane(*lane);
            let [a, b] = [0, 1].map(|row: usize| self.rows[row].centres[place]);
            let at = |share: f64| Centre::from((a.0.lerp(b.0, share), a.1 + (b.1 - a.1) * share));
            for piece in 0..count {
                let shares = [piece, piece + 1].map(|end| end as f64 / count as f64);
                let s = shares.map(|share| from + (to - from) * share);
                let form = Form { sag_m: 0.0, shape: Shape::STRAIGHT, tangents: [Vec3::ZERO; 2] };
                self.segments.push(segment(section, lane, shares.map(at), s, form));
            }
        }
    }

    fn bent(&mut self, road: &Road, section: &Section, from: f64, to: f64, run: Run) {
        let most = if run == Run::Bent { BENT_M } else { SHAPED_M }.max(self.finest);
        self.sample(road, section, from, 0);
        loop {
            let here = self.rows[0].s;
            if here >= to {
                break;
            }
            let mut step = most.min(fitting(self.rows[0].bend)).max(self.finest);
            loop {
                // The last two pieces have about the same length.
                let left = to - here;
                let next = if left <= step {
                    to
                } else {
                    here + if left < 2.0 * step { 0.5 * left } else { step }
                };
                self.sample(road, section, if next == to { to.next_down() } else { next }, 1);
                let fits = fitting(self.rows[1].bend);
                if next - here <= 1.5 * fits || step <= self.finest {
                    self.rows[1].s = next;
                    break;
                }
                step = fits.max(0.25 * step).max(self.finest);
            }
            self.between(section, run);
            self.rows.swap(0, 1);
        }
    }

    /// Adds the pieces from the first row to the second.
    fn between(&mut self, section: &Section, run: Run) {
        let [from, to] = &self.rows;
        let bend = from.bend.max(to.bend);
        for (place, lane) in section.lanes.iter().enumerate() {
            let lane = self.network.lane(*lane);
            let ends = [from.centres[place], to.centres[place]];
            // The sagitta of an arc is an eighth of length times turn.
            let turn = bend * (to.s - from.s);
            let sag_m = 1.5 * 0.125 * ends[0].0.distance(ends[1].0) * turn;
            let form = if run == Run::Bent && turn < TURN_MAX_RAD {
                Form { sag_m, shape: Shape::ARC, tangents: tangents([from, to], ends) }
            } else {
                let tangents = [Vec3::ZERO; 2];
                Form { sag_m: sag_m + SHAPED_SAG_M, shape: Shape::FREE, tangents }
            };
            self.segments.push(segment(section, lane, ends, [from.s, to.s], form));
        }
    }

    fn sample(&mut self, road: &Road, section: &Section, s: f64, row: usize) {
        let (axes, bend) = road.axes_and_bend(s);
        let row = &mut self.rows[row];
        (row.s, row.axes, row.bend) = (s, axes, bend);
        self.network.centres(road, section, &axes, s, &mut row.centres);
    }
}

/// Knots nearer than this are one, metres.
const KNOT_M: f64 = 1e-6;

/// Returns the longest piece for a given curvature.
fn fitting(bend: f64) -> f64 {
    (8.0 * SAG_M / bend.max(1e-9)).sqrt()
}

/// Returns the derivatives of a lane's centre at both ends, scaled to the whole length of s, where
/// its distances from the reference line change linearly.
fn tangents([from, to]: [&Row; 2], ends: [Centre; 2]) -> [Vec3; 2] {
    let length = to.s - from.s;
    let beside = |row: &Row, end: Centre| row.axes.beside(end.0);
    let (a, b) = (beside(from, ends[0]), beside(to, ends[1]));
    [(from, a), (to, b)].map(|(row, (t, _))| row.axes.tangent(t, (b.0 - a.0, b.1 - a.1), length))
}

/// A cubic does not follow an arc that turns more than this.
const TURN_MAX_RAD: f64 = 0.8;

/// What a piece records about the centre that it stands for.
struct Form {
    sag_m: f64,
    shape: Shape,
    tangents: [Vec3; 2],
}

fn segment(
    section: &Section,
    lane: &Lane,
    [from, to]: [Centre; 2],
    s: [f64; 2],
    Form { sag_m, shape, tangents }: Form,
) -> Segment {
    let along = |s: f64| {
        let ds = s - section.start_m;
        if lane.forward { ds } else { lane.length_m - ds }
    };
    Segment {
        from: from.0,
        to: to.0,
        lane: lane.index.0,
        types: lane.kind as u32,
        along: s.map(along),
        sag_m: sag_m as f32,
        outside_m: (from.1.max(to.1) + sag_m + SLACK_M) as f32,
        inside_m: (from.1.min(to.1) - sag_m - SLACK_M) as f32,
        shape,
        tangents,
    }
}
