//! The walkable ground as the planner reads it: triangles, crossings, the lanes under them.

use glam::Vec2;
use walkable::{Area, Ground, Surface};

use crate::{
    approach::Approaches,
    grid::{Grid, Pass},
    tracks::{NONE, Tracks},
};

/// Resolution along a crossing. Metres.
const STEP_M: f32 = 0.5;
/// Part of each end of a crossing that lies on a sidewalk. Metres.
const REACH_M: f32 = 1.5;
/// Length of each end of a crossing on the road where walkers stand without stopping vehicles. Metres.
const END_M: f32 = 0.6;
/// Distance from a crosswalk to the junction or stop line behind it, at most. Metres.
const SIGNAL_M: f32 = 25.0;

/// Walkable ground with its crossings and the components that are connected.
pub(crate) struct WalkerGround {
    pub(crate) surface: Surface,
    /// In the numbering of [`walkable::Cell::crossing`].
    pub(crate) crossings: Vec<Crossing>,
    /// By lane: its crossings and the arc length of each. Sorted by lane.
    by_lane: Vec<(u32, u32, f32)>,
    /// By triangle: its connected component for walkers that keep to crosswalks, and for the others.
    components: [Vec<u32>; 2],
    /// Sidewalk triangles and the area of all up to each.
    areas: Vec<(u32, f32)>,
}

/// A place where walkers cross.
pub(crate) struct Crossing {
    pub(crate) area: Area,
    pub(crate) center: Vec2,
    /// Unit vector across the road.
    pub(crate) axis: Vec2,
    /// Half the distance between the kerbs.
    pub(crate) half_length_m: f32,
    /// Half the width along the road.
    pub(crate) half_width_m: f32,
    pub(crate) lanes: Vec<CrossedLane>,
    /// Traffic lights that stop the vehicles that approach; ascending.
    pub(crate) signals: Vec<u32>,
}

/// A lane under a crossing.
pub(crate) struct CrossedLane {
    pub(crate) lane: u32,
    /// Arc length on the lane.
    pub(crate) arc_m: f32,
    /// Coordinate along the crossing's axis, from its centre.
    pub(crate) along_m: f32,
}

impl WalkerGround {
    /// Finds the lanes and lights of every crossing.
    pub(crate) fn new(
        ground: &Ground,
        tracks: &Tracks,
        grid: &Grid,
        approaches: &Approaches,
    ) -> WalkerGround {
        let surface = Surface::new(ground);
        let crossing = |shape: &walkable::Crossing| Crossing::new(shape, tracks, grid, approaches);
        let crossings: Vec<Crossing> = surface.crossings().iter().map(crossing).collect();
        let mut by_lane = Vec::new();
        for (index, crossing) in crossings.iter().enumerate() {
            by_lane.extend(crossing.lanes.iter().map(|at| (at.lane, index as u32, at.arc_m)));
        }
        by_lane.sort_by_key(|row: &(u32, u32, f32)| (row.0, row.1));
        let components =
            [false, true].map(|crosses| components(&surface, |area| crosses || area != Area::Road));
        let mut sum = 0.0;
        let mut areas = Vec::new();
        for (index, cell) in surface.cells().iter().enumerate() {
            if cell.area == Area::Sidewalk {
                let [a, b, c] = surface.corners(index as u32);
                sum += (b - a).perp_dot(c - a).max(0.0) / 2.0;
                areas.push((index as u32, sum));
            }
        }
        WalkerGround { surface, crossings, by_lane, components, areas }
    }

    /// Returns the crossings of a lane: lane, crossing, arc length.
    pub(crate) fn on_lane(&self, lane: u32) -> &[(u32, u32, f32)] {
        let begin = self.by_lane.partition_point(|row| row.0 < lane);
        let count = self.by_lane[begin..].partition_point(|row| row.0 == lane);
        &self.by_lane[begin..begin + count]
    }

    /// Returns whether a way leads from one triangle to another.
    pub(crate) fn connects(&self, from: u32, to: u32, crosses: bool) -> bool {
        let component = &self.components[usize::from(crosses)];
        component[from as usize] == component[to as usize]
    }

    /// Returns a point on a sidewalk for three numbers in 0..1, uniform over the area.
    pub(crate) fn point(&self, [place, u, v]: [f32; 3]) -> Option<(u32, Vec2)> {
        let whole = self.areas.last()?.1;
        let at = self.areas.partition_point(|(_, sum)| *sum <= place * whole);
        let cell = self.areas[at.min(self.areas.len() - 1)].0;
        let [a, b, c] = self.surface.corners(cell);
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some((cell, a + (b - a) * u + (c - a) * v))
    }
}

impl Crossing {
    fn new(
        shape: &walkable::Crossing,
        tracks: &Tracks,
        grid: &Grid,
        approaches: &Approaches,
    ) -> Crossing {
        let corners: Vec<Vec2> = shape.outline.iter().map(|at| at.truncate().as_vec2()).collect();
        let center = corners.iter().sum::<Vec2>() / corners.len().max(1) as f32;
        let ends = corners.iter().zip(corners.iter().cycle().skip(1));
        // The first of the longest sides, which lies across the road.
        let mut axis = Vec2::X;
        let mut longest_m = 0.0;
        for way in ends.map(|(a, b)| *b - *a) {
            if way.length() > longest_m + 1e-3 {
                (axis, longest_m) = (way.normalize_or_zero(), way.length());
            }
        }
        let extent = |along: Vec2| {
            corners.iter().map(|at| (*at - center).dot(along).abs()).fold(0.0, f32::max)
        };
        let mut crossing = Crossing {
            area: shape.area,
            center,
            axis,
            half_length_m: (extent(axis) - REACH_M).max(1.0),
            half_width_m: extent(axis.perp()),
            lanes: Vec::new(),
            signals: Vec::new(),
        };
        crossing.find_lanes(tracks, grid);
        crossing.find_signals(tracks, approaches);
        crossing
    }

    /// Whether a place on the crossing is so near to a kerb that vehicles pass it.
    pub(crate) fn is_end(&self, at: Vec2) -> bool {
        (at - self.center).dot(self.axis).abs() > self.half_length_m - END_M
    }

    fn find_lanes(&mut self, tracks: &Tracks, grid: &Grid) {
        let steps = (2.0 * self.half_length_m / STEP_M).ceil() as i32;
        for step in 0..=steps {
            let along_m = step as f32 * STEP_M - self.half_length_m;
            let at = self.center + self.axis * along_m;
            for &Pass { lane, hint_m, .. } in grid.near(at) {
                let on = tracks.project(lane, at, hint_m);
                let is_on = (-1.0..=tracks.length(lane) + 1.0).contains(&on.arc_m);
                let crosses = on.tangent.dot(self.axis).abs() < 0.9;
                let known = self.lanes.iter().any(|known| known.lane == lane);
                if is_on && crosses && !known && on.left_m.abs() <= STEP_M * 0.75 {
                    let arc_m = on.arc_m.clamp(0.0, tracks.length(lane));
                    self.lanes.push(CrossedLane { lane, arc_m, along_m });
                }
            }
        }
    }

    fn find_signals(&mut self, tracks: &Tracks, approaches: &Approaches) {
        for crossed in &self.lanes {
            if tracks.in_junction(crossed.lane) {
                // A crosswalk inside the junction belongs to an approach if it lies near its begin.
                if crossed.arc_m < 0.3 * tracks.length(crossed.lane) {
                    self.signals.push(approaches.signal[crossed.lane as usize]);
                }
                continue;
            }
            let midblock = approaches.midblock.iter().filter(|stop| {
                stop.0 == crossed.lane && (0.0..SIGNAL_M).contains(&(crossed.arc_m - stop.1))
            });
            self.signals.extend(midblock.map(|stop| stop.2));
            let left_m = tracks.length(crossed.lane) - crossed.arc_m;
            if left_m < SIGNAL_M {
                let entries = tracks.next(crossed.lane).iter();
                self.signals.extend(entries.map(|entry| approaches.signal[*entry as usize]));
            }
        }
        self.signals.retain(|signal| *signal != NONE);
        self.signals.sort_unstable();
        self.signals.dedup();
    }
}

/// Returns the number of the component of each triangle, by what `allows` admits.
fn components(surface: &Surface, allows: impl Fn(Area) -> bool) -> Vec<u32> {
    let cells = surface.cells();
    let mut component = vec![u32::MAX; cells.len()];
    for start in 0..cells.len() {
        if component[start] != u32::MAX || !allows(cells[start].area) {
            continue;
        }
        let mut open = vec![start];
        component[start] = start as u32;
        while let Some(at) = open.pop() {
            for next in cells[at].neighbours.iter().flatten().map(|next| *next as usize) {
                if component[next] == u32::MAX && allows(cells[next].area) {
                    component[next] = start as u32;
                    open.push(next);
                }
            }
        }
    }
    component
}
