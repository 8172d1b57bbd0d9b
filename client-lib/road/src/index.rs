//! The spatial index: lane centres as short segments in a grid, refined on the exact curve.

use crate::lane::{Lane, LanePoint, LaneTypes};
use crate::network::Network;
use glam::{DVec2, DVec3};

/// A piece of a lane's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub(crate) from: DVec3,
    pub(crate) to: DVec3,
    pub(crate) lane: u32,
    pub(crate) types: u32,
    pub(crate) from_s: f32,
    pub(crate) to_s: f32,
    /// The lane's centre lies nowhere farther from the piece than this.
    sag_m: f32,
    /// Nothing of the lane lies farther beside the piece than this.
    pub(crate) outside_m: f32,
    /// Everything nearer beside it than this lies on the lane.
    pub(crate) inside_m: f32,
}

/// Segments by the square cells that they cross.
#[derive(Clone, Debug, Default)]
pub(crate) struct LaneIndexGrid {
    segments: Vec<Segment>,
    low: DVec2,
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Where each cell's part of `entries` begins.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

const CELL_M: f64 = 6.0;
const CELLS_MAX: f64 = 4e6;
const SEGMENTS_MAX: f64 = 4e6;
const LONGEST_M: f64 = 6.0;
/// A piece whose middle lies farther from its chord than this is cut in two.
const SAG_M: f64 = 0.05;
/// At most so often.
const CUTS_MAX: u32 = 6;
/// Only a broken file has so many pieces that bend; it gets no more.
const FINE_MAX: usize = 1_000_000;
/// Widths may swell this much between the places where they are looked at.
const SLACK_M: f64 = 0.1;

/// Where a lane's centre is, and half its width.
type Centre = (DVec3, f64);

/// Adds the piece of a lane between `from_s` and `to_s`, cut in two where it bends too much.
fn segment(
    lane: &Lane,
    [from, middle, to]: [Centre; 3],
    (from_s, to_s): (f64, f64),
    cuts: u32,
    segments: &mut Vec<Segment>,
    centre: &impl Fn(f64) -> Centre,
) {
    let sag = middle.0.distance(0.5 * (from.0 + to.0));
    let middle_s = 0.5 * (from_s + to_s);
    if sag > SAG_M && cuts > 0 && to_s - from_s > 0.2 {
        let quarters = [0.5 * (from_s + middle_s), 0.5 * (middle_s + to_s)].map(centre);
        segment(lane, [from, quarters[0], middle], (from_s, middle_s), cuts - 1, segments, centre);
        segment(lane, [middle, quarters[1], to], (middle_s, to_s), cuts - 1, segments, centre);
        return;
    }
    let sag = 1.5 * sag;
    let halves = [from.1, middle.1, to.1];
    segments.push(Segment {
        from: from.0,
        to: to.0,
        lane: lane.index.0,
        types: lane.kind as u32,
        from_s: from_s as f32,
        to_s: to_s as f32,
        sag_m: sag as f32,
        outside_m: (halves.into_iter().fold(0.0, f64::max) + sag + SLACK_M) as f32,
        inside_m: (halves.into_iter().fold(f64::INFINITY, f64::min) - sag - SLACK_M) as f32,
    });
}

impl LaneIndexGrid {
    pub(crate) fn new(network: &Network) -> LaneIndexGrid {
        let total: f64 = network.lanes().iter().map(|lane| lane.length_m).sum();
        let longest = LONGEST_M.max(total / SEGMENTS_MAX);
        let mut segments = Vec::new();
        // Rows of centres: where pieces begin, in their middle, where they end.
        let mut rows: [Vec<Centre>; 3] = Default::default();
        for road in network.roads() {
            for section in &road.sections {
                let pieces = (section.length_m / longest).ceil().clamp(1.0, 1e6) as usize;
                let step = section.length_m / pieces as f64;
                network.centres(road, section, section.start_m, &mut rows[2]);
                for piece in 0..pieces {
                    let from_s = section.start_m + step * piece as f64;
                    let to_s = section.start_m + step * (piece + 1) as f64;
                    rows.swap(0, 2);
                    network.centres(road, section, 0.5 * (from_s + to_s), &mut rows[1]);
                    network.centres(road, section, to_s, &mut rows[2]);
                    for (place, lane) in section.lanes.iter().enumerate() {
                        let lane = network.lane(*lane);
                        let ends = [0, 1, 2].map(|row: usize| rows[row][place]);
                        let cuts = if segments.len() < FINE_MAX { CUTS_MAX } else { 0 };
                        segment(lane, ends, (from_s, to_s), cuts, &mut segments, &|s| {
                            network.centre(road, section, lane, s)
                        });
                    }
                }
            }
        }
        // As they were asked for lane by lane: near things lie near in memory.
        LaneIndexGrid::filled(segments)
    }

    /// Corners of the box round all lanes.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for segment in &self.segments {
            let half = f64::from(segment.outside_m) - SLACK_M;
            let along = (segment.to - segment.from).truncate().normalize_or_zero();
            let side = (along.perp().abs() * half).extend(0.0);
            for end in [segment.from, segment.to] {
                low = low.min(end - side);
                high = high.max(end + side);
            }
        }
        low.is_finite().then_some((low, high))
    }

    fn filled(segments: Vec<Segment>) -> LaneIndexGrid {
        let mut low = DVec2::splat(f64::INFINITY);
        let mut high = DVec2::splat(f64::NEG_INFINITY);
        for segment in &segments {
            for end in [segment.from.truncate(), segment.to.truncate()] {
                low = low.min(end);
                high = high.max(end);
            }
        }
        if segments.is_empty() {
            return LaneIndexGrid::default();
        }
        let size = high - low;
        let cell_m = CELL_M
            .max((size.x * size.y / CELLS_MAX).sqrt())
            .max(size.max_element() / CELLS_MAX.sqrt());
        let columns = (size.x / cell_m) as usize + 1;
        let rows = (size.y / cell_m) as usize + 1;
        let mut grid = LaneIndexGrid {
            segments,
            low,
            cell_m,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            entries: Vec::new(),
        };
        let mut places = Vec::new();
        for (index, segment) in grid.segments.iter().enumerate() {
            let a = grid.cell(segment.from.truncate());
            let b = grid.cell(segment.to.truncate());
            for row in a.1.min(b.1)..=a.1.max(b.1) {
                for column in a.0.min(b.0)..=a.0.max(b.0) {
                    places.push((row * columns + column, index as u32));
                }
            }
        }
        for (cell, _) in &places {
            grid.starts[cell + 1] += 1;
        }
        for cell in 0..columns * rows {
            grid.starts[cell + 1] += grid.starts[cell];
        }
        let mut next = grid.starts.clone();
        grid.entries = vec![0; places.len()];
        for (cell, index) in places {
            grid.entries[next[cell] as usize] = index;
            next[cell] += 1;
        }
        grid
    }

    /// The cell of a point, or the nearest one of the grid.
    fn cell(&self, point: DVec2) -> (usize, usize) {
        let at = (point - self.low) / self.cell_m;
        (
            at.x.clamp(0.0, (self.columns - 1) as f64) as usize,
            at.y.clamp(0.0, (self.rows - 1) as f64) as usize,
        )
    }

    pub(crate) fn nearest(
        &self,
        network: &Network,
        point: DVec3,
        types: LaneTypes,
    ) -> Option<LanePoint> {
        if self.segments.is_empty() || !point.is_finite() {
            return None;
        }
        let flat = point.truncate();
        let (column, row) = self.cell(flat);
        let mut nearest = Nearest::default();
        for ring in 0..self.columns.max(self.rows) {
            // Nothing in this ring can be nearer than its inner edge.
            let reach = self.clearance(flat, column, row, ring);
            if reach * reach > nearest.limit_squared {
                break;
            }
            self.each_of_ring(column, row, ring, |cell| {
                let entries = self.starts[cell] as usize..self.starts[cell + 1] as usize;
                for &entry in &self.entries[entries] {
                    let segment = &self.segments[entry as usize];
                    if segment.types & types.0 != 0 {
                        let (squared, share) = segment.distance_squared(point);
                        if squared <= nearest.limit_squared {
                            nearest.offer(Candidate { squared, share, segment });
                        }
                    }
                }
            });
        }
        nearest.choose(network, point)
    }

    /// Visits every segment in the cells within `reach` of `point`, some more than once.
    pub(crate) fn near(&self, point: DVec2, reach: f64, mut visit: impl FnMut(&Segment)) {
        if self.segments.is_empty() {
            return;
        }
        let (low, high) = (self.cell(point - reach), self.cell(point + reach));
        for row in low.1..=high.1 {
            for column in low.0..=high.0 {
                let cell = row * self.columns + column;
                let entries = self.starts[cell] as usize..self.starts[cell + 1] as usize;
                for &entry in &self.entries[entries] {
                    visit(&self.segments[entry as usize]);
                }
            }
        }
    }

    /// A lower bound of the distance from `point` to the cells of `ring` round a cell.
    fn clearance(&self, point: DVec2, column: usize, row: usize, ring: usize) -> f64 {
        if ring == 0 {
            return 0.0;
        }
        let inner = ring as f64 - 1.0;
        let low = self.low + DVec2::new(column as f64 - inner, row as f64 - inner) * self.cell_m;
        let high = self.low
            + DVec2::new(column as f64 + 1.0 + inner, row as f64 + 1.0 + inner) * self.cell_m;
        let inside = (point - low).min(high - point).min_element();
        inside.max(0.0)
    }

    fn each_of_ring(&self, column: usize, row: usize, ring: usize, mut visit: impl FnMut(usize)) {
        let (c, r, n) = (column as isize, row as isize, ring as isize);
        let mut cell = |column: isize, row: isize| {
            if (0..self.columns as isize).contains(&column)
                && (0..self.rows as isize).contains(&row)
            {
                visit(row as usize * self.columns + column as usize);
            }
        };
        if n == 0 {
            return cell(c, r);
        }
        for column in c - n..=c + n {
            cell(column, r - n);
            cell(column, r + n);
        }
        for row in r - n + 1..r + n {
            cell(c - n, row);
            cell(c + n, row);
        }
    }
}

/// A lane that may be the nearest, by its nearest piece.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    squared: f64,
    share: f64,
    segment: &'a Segment,
}

/// The lanes whose pieces are so near that only the exact curves can tell which is the nearest.
struct Nearest<'a> {
    few: [Option<Candidate<'a>>; 4],
    best_squared: f64,
    /// The nearest lane is at most so far.
    upper: f64,
    /// No piece farther than this can be of the nearest lane.
    limit_squared: f64,
}

impl Default for Nearest<'_> {
    fn default() -> Self {
        let far = f64::INFINITY;
        Nearest { few: [None; 4], best_squared: far, upper: far, limit_squared: far }
    }
}

impl<'a> Nearest<'a> {
    fn offer(&mut self, new: Candidate<'a>) {
        if new.squared < self.best_squared {
            self.best_squared = new.squared;
            self.upper = self.upper.min(new.squared.sqrt() + f64::from(new.segment.sag_m));
            self.limit_squared = (self.upper + 1.5 * SAG_M).powi(2);
        }
        let limit = self.limit_squared;
        // Its own lane's place, else one that is free or no longer near enough, else the last.
        let own = |c: &Candidate| c.segment.lane == new.segment.lane;
        let place = self
            .few
            .iter()
            .position(|c| c.as_ref().is_some_and(own))
            .or_else(|| self.few.iter().position(|c| c.is_none_or(|c| c.squared > limit)));
        let slot = match place {
            Some(place) => &mut self.few[place],
            None => {
                let far = |a: &Option<Candidate>, b: &Option<Candidate>| {
                    let squared = |c: &Option<Candidate>| c.map_or(0.0, |c| c.squared);
                    squared(a).total_cmp(&squared(b))
                };
                let Some(last) = self.few.iter_mut().max_by(|a, b| far(a, b)) else { return };
                last
            }
        };
        if slot.is_none_or(|old| new.squared < old.squared || old.squared > limit) {
            *slot = Some(new);
        }
    }

    fn choose(self, network: &Network, point: DVec3) -> Option<LanePoint> {
        // Feet on chords are rounded, and straight lanes may lie on each other.
        let near =
            |c: &&Candidate| c.squared.sqrt() - f64::from(c.segment.sag_m) <= self.upper + 1e-6;
        let is_clear = self.few.iter().flatten().filter(near).count() == 1;
        let mut best: Option<(f64, LanePoint)> = None;
        for candidate in self.few.iter().flatten().filter(near) {
            let segment = candidate.segment;
            let (from_s, to_s) = (f64::from(segment.from_s), f64::from(segment.to_s));
            let s = from_s + candidate.share * (to_s - from_s);
            let at = network.refined(&network.lanes()[segment.lane as usize], s, point);
            if is_clear {
                return Some(at);
            }
            let squared = network.place(at).position.distance_squared(point);
            if best.is_none_or(|(best, _)| squared < best) {
                best = Some((squared, at));
            }
        }
        best.map(|(_, at)| at)
    }
}

impl Segment {
    /// The squared distance to `point`, and where along the segment it is reached.
    fn distance_squared(&self, point: DVec3) -> (f64, f64) {
        let along = self.to - self.from;
        let length = along.length_squared();
        let share = if length > 0.0 {
            ((point - self.from).dot(along) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (point.distance_squared(self.from + along * share), share)
    }
}

impl Network {
    /// The foot of `point` on the lane's exact centre, beginning from `s` near it.
    fn refined(&self, lane: &crate::lane::Lane, s: f64, point: DVec3) -> LanePoint {
        let road = &self.roads()[lane.road as usize];
        let start = road.sections[lane.section as usize].start_m;
        let mut s = s.clamp(start, start + lane.length_m);
        for _ in 0..2 {
            let station = road.station(s);
            let lateral = self.lateral(road, lane, s, 0.0);
            let pose = road.pose(&station, s, &lateral);
            let offset = point - pose.position;
            let (sin, cos) = pose.heading_rad.sin_cos();
            let (pitch_sin, pitch_cos) = pose.pitch_rad.sin_cos();
            let ahead = (offset.x * cos + offset.y * sin) * pitch_cos - offset.z * pitch_sin;
            // A step along the path is longer or shorter than the same step of s, and the foot
            // moves faster on the inside of a bend.
            let left = offset.y * cos - offset.x * sin;
            let stretch = (1.0 - station.curvature * lateral.t.value).max(0.1);
            let bend = (1.0 - pose.curvature_per_m * left).max(0.2);
            let step = ahead / (stretch * bend);
            s = (s + step).clamp(start, start + lane.length_m);
            if step.abs() < 1e-4 {
                break;
            }
        }
        self.point_at_s(lane, s)
    }
}
