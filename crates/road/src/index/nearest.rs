//! The nearest lane: approximate distances select a candidates pieces, exact ones the lane.

use glam::{DVec2, DVec3, Vec3};

use crate::{
    grid::{Entry, LaneIndexGrid, Segment, Shape},
    lane::{Lane, LaneIndex, LanePoint, LaneTypes},
    network::Network,
};

/// Upper bound of the error of approximate distances, metres: pieces sag, and f32 rounds.
const ROUGH_M: f32 = 0.1;

/// The cells that are searched, and what for.
struct Cells<'a> {
    starts: &'a [u32],
    entries: &'a [Entry],
    point: DVec3,
    types: LaneTypes,
}

impl LaneIndexGrid {
    fn nearest(&self, network: &Network, point: DVec3, types: LaneTypes) -> Option<LanePoint> {
        if self.types & types.0 == 0 || !point.is_finite() {
            return None;
        }
        let flat = point.truncate();
        // The four cells around the nearest corner first, then ring by ring the cells around them.
        let corner = ((flat - self.low) / self.cell_m).round();
        let most = DVec2::new(self.columns as f64, self.rows as f64);
        let corner = corner.clamp(DVec2::ZERO, most).as_i64vec2();
        let mut candidates = Candidates::default();
        let cells = Cells { starts: &self.starts, entries: &self.entries, point, types };
        let mut seen: Option<[i64; 4]> = None;
        for ring in 1.. {
            let clamped = |at: i64, end: usize| at.clamp(0, end as i64);
            let block = [
                clamped(corner.x - ring, self.columns),
                clamped(corner.x + ring, self.columns),
                clamped(corner.y - ring, self.rows),
                clamped(corner.y + ring, self.rows),
            ];
            for row in block[2]..block[3] {
                match seen {
                    Some([left, right, low, high]) if (low..high).contains(&row) => {
                        self.row(&cells, row, block[0]..left, &mut candidates);
                        self.row(&cells, row, right..block[1], &mut candidates);
                    }
                    _ => self.row(&cells, row, block[0]..block[1], &mut candidates),
                }
            }
            // Nothing outside the block can be nearer than its edge.
            let clear = self.clearance(flat, block);
            if clear * clear > f64::from(candidates.limit_squared) || clear == f64::INFINITY {
                break;
            }
            seen = Some(block);
        }
        self.choose(network, &candidates, point)
    }

    /// Returns a lower bound of the distance to any cell outside a block; infinite if there is
    /// none.
    fn clearance(&self, point: DVec2, [left, right, low, high]: [i64; 4]) -> f64 {
        let mut clear = f64::INFINITY;
        let (columns, rows) = (self.columns as i64, self.rows as i64);
        let at = (point - self.low) / self.cell_m;
        for (inside, beyond) in [
            (at.x - left as f64, left > 0),
            (right as f64 - at.x, right < columns),
            (at.y - low as f64, low > 0),
            (high as f64 - at.y, high < rows),
        ] {
            if beyond {
                clear = clear.min(inside.max(0.0) * self.cell_m);
            }
        }
        clear
    }

    fn row(
        &self,
        cells: &Cells,
        row: i64,
        columns: std::ops::Range<i64>,
        candidates: &mut Candidates,
    ) {
        let Cells { starts, entries, point, types } = *cells;
        for column in columns {
            let cell = row as usize * self.columns + column as usize;
            let (from, to) = (starts[cell] as usize, starts[cell + 1] as usize);
            if from == to {
                continue;
            }
            let here = (point - self.corner(column as usize, row as usize)).as_vec3();
            for entry in &entries[from..to] {
                if entry.types & types.0 != 0 {
                    let squared = entry.distance_squared(here);
                    if squared <= candidates.limit_squared {
                        candidates.offer(squared, entry.segment);
                    }
                }
            }
        }
    }

    fn choose(
        &self,
        network: &Network,
        candidates: &Candidates,
        point: DVec3,
    ) -> Option<LanePoint> {
        // For each lane its nearest piece.
        let segments = &*self.segments;
        let mut near: [Option<(f32, &Segment)>; Candidates::MOST] = [None; Candidates::MOST];
        let mut lanes = 0;
        for (squared, segment) in
            candidates.found().filter(|found| found.0 <= candidates.limit_squared)
        {
            let segment = &segments[segment as usize];
            let own = near[..lanes].iter_mut().flatten().find(|old| old.1.lane == segment.lane);
            match own {
                Some(old) if squared < old.0 => *old = (squared, segment),
                Some(_) => {}
                None => {
                    near[lanes] = Some((squared, segment));
                    lanes += 1;
                }
            }
        }
        let is_clear = lanes == 1;
        let mut best: Option<(f64, LanePoint)> = None;
        for (squared, segment) in near.into_iter().flatten() {
            let (share, found) = segment.foot(point);
            let [from, to] = segment.along;
            let along_m = from + share * (to - from);
            let mut at = LanePoint { lane: LaneIndex(segment.lane), along_m };
            let mut exact = found;
            if segment.shape == Shape::FREE {
                // A piece that cannot come before the best one in spite of its sag is skipped.
                let least = f64::from(squared).sqrt() - f64::from(segment.sag_m) - ROUNDED_M;
                if best.is_some_and(|(best, _)| least > 0.0 && least * least > best) {
                    continue;
                }
                at = network.refined(network.lane(at.lane), at, point);
                if !is_clear {
                    exact = network
                        .lane_pose(at.lane, at.along_m, 0.0)
                        .0
                        .position
                        .distance_squared(point);
                }
            }
            if best.is_none_or(|(best, _)| exact < best) {
                best = Some((exact, at));
            }
        }
        best.map(|(_, at)| at)
    }
}

/// Rounding error of f32, metres.
const ROUNDED_M: f64 = 1e-3;

impl Entry {
    /// Returns the squared distance to a point that is relative to the same corner.
    fn distance_squared(&self, point: Vec3) -> f32 {
        let offset = point - self.from;
        let share = offset.dot(self.along) / self.along.length_squared().max(1e-9);
        (offset - self.along * share.clamp(0.0, 1.0)).length_squared()
    }
}

impl Segment {
    /// Returns the fraction of the piece at which it is nearest to `point`, and the squared
    /// distance there.
    fn foot(&self, point: DVec3) -> (f64, f64) {
        let (chord, offset) = (self.to - self.from, point - self.from);
        let mut share = (offset.dot(chord) / chord.length_squared().max(1e-12)).clamp(0.0, 1.0);
        if self.shape != Shape::ARC {
            return (share, offset.distance_squared(chord * share));
        }
        // The cubic b·u + c·u² + d·u³ that ends at `chord` and has these slopes.
        let [b, end] = self.tangents.map(|tangent| tangent.as_dvec3());
        let (c, d) = (3.0 * chord - 2.0 * b - end, b + end - 2.0 * chord);
        let mut away = DVec3::ZERO;
        for _ in 0..FEET_MAX {
            away = offset - ((d * share + c) * share + b) * share;
            let slope = (3.0 * d * share + 2.0 * c) * share + b;
            let bend = 6.0 * d * share + 2.0 * c;
            let steep = slope.length_squared();
            // Beyond the centre of a bend there is no foot, but such a point is not near either.
            let step = away.dot(slope) / (steep - away.dot(bend)).max(0.2 * steep).max(1e-12);
            let next = (share + step).clamp(0.0, 1.0);
            if (next - share) * (next - share) * steep < FOOT_M * FOOT_M {
                break;
            }
            share = next;
        }
        (share, away.length_squared())
    }
}

/// Accuracy of feet in metres, and most iterations.
const FOOT_M: f64 = 1e-5;
const FEET_MAX: usize = 6;

/// The nearest pieces found so far.
#[derive(Clone, Copy)]
struct Candidates {
    /// Squared distance and segment.
    list: [(f32, u32); Candidates::MOST],
    count: usize,
    best_squared: f32,
    /// No piece farther than this can be the nearest.
    limit_squared: f32,
}

impl Default for Candidates {
    fn default() -> Self {
        let far = f32::INFINITY;
        Candidates {
            list: [(far, 0); Candidates::MOST],
            count: 0,
            best_squared: far,
            limit_squared: far,
        }
    }
}

impl Candidates {
    const MOST: usize = 8;

    fn offer(&mut self, squared: f32, segment: u32) {
        if squared < self.best_squared {
            self.best_squared = squared;
            self.limit_squared = (squared.sqrt() + ROUGH_M).powi(2);
            // Pieces that are too far behind the new one are dropped.
            let mut kept = 0;
            for at in 0..self.count {
                if self.list[at].0 <= self.limit_squared {
                    self.list[kept] = self.list[at];
                    kept += 1;
                }
            }
            self.count = kept;
        }
        if self.list[..self.count].iter().any(|found| found.1 == segment) {
            return;
        }
        if self.count < Candidates::MOST {
            self.list[self.count] = (squared, segment);
            self.count += 1;
            return;
        }
        let far = |a: &&mut (f32, u32), b: &&mut (f32, u32)| a.0.total_cmp(&b.0);
        if let Some(last) = self.list.iter_mut().max_by(far)
            && squared < last.0
        {
            *last = (squared, segment);
        }
    }

    fn found(&self) -> impl Iterator<Item = (f32, u32)> + Clone + '_ {
        self.list[..self.count].iter().copied()
    }
}

impl Network {
    /// Returns the point of the nearest lane centre, in three dimensions, among lanes of `types`.
    ///
    /// Distances are those to the lanes as the file describes them. `None` if no lane has such a
    /// type or `point` is not finite.
    pub fn nearest(&self, point: DVec3, types: LaneTypes) -> Option<LanePoint> {
        self.grid.nearest(self, point, types)
    }

    /// Returns the foot of `point` on the lane's exact centre, starting from a point near it.
    fn refined(&self, lane: &Lane, near: LanePoint, point: DVec3) -> LanePoint {
        let road = &self.roads()[lane.road as usize];
        let start = road.sections[lane.section as usize].start_m;
        let mut s = self.s_of(lane, near.along_m);
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
