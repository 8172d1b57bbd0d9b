//! A spatial index of tracks.

use std::borrow::Cow;

use bake::Parts;
use bytemuck::{Pod, Zeroable, bytes_of, cast_slice};
use glam::Vec2;

use crate::tracks::{Tracks, lookup::FlatPlace};

/// Edge of a cell, metres; doubled on large maps until the number of cells is within bounds.
const CELL_M: f32 = 4.0;
/// A track is listed in every cell whose centre it passes at this distance or nearer, metres.
pub(crate) const REACH_M: f32 = 7.0;
/// A lane that leaves the reach of a cell for longer than this passes it a second time. Metres.
const APART_M: f32 = 10.0;
/// Largest number of cells.
const CELLS_MAX: usize = 4_000_000;

/// Tracks by square cell.
pub(crate) struct Grid {
    low: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    first: Vec<u32>,
    /// A lane that passes more than once, as where a road crosses over itself, has one entry for each
    /// pass.
    entries: Vec<Pass>,
}

/// A lane that passes a cell: its sample nearest to the centre of the cell.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Pass {
    pub(crate) lane: u32,
    /// Arc length of the sample.
    pub(crate) hint_m: f32,
    /// The point of the track there.
    pub(crate) place: FlatPlace,
    /// 1 at the end of the track, −1 at its begin, else 0.
    pub(crate) end: f32,
    /// Bound on the curvature around the sample: see [`Tracks::bends`].
    pub(crate) bend_per_m: f32,
}

/// The numbers of a [`Grid`] beside its lists.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Head {
    low: Vec2,
    cell_m: f32,
    columns: u32,
    rows: u32,
}

impl Grid {
    /// Returns the grid as bytes, in the order in which [`Grid::take`] reads them.
    pub(crate) fn parts(&self) -> Vec<Cow<'_, [u8]>> {
        let Grid { low, cell_m, columns, rows, first, entries } = self;
        let (columns, rows) = (*columns as u32, *rows as u32);
        let head = Head { low: *low, cell_m: *cell_m, columns, rows };
        let head = bytes_of(&head).to_vec();
        vec![head.into(), cast_slice(first).into(), cast_slice(entries).into()]
    }

    /// Reads what [`Grid::parts`] gave; `None` if a part is missing or damaged.
    pub(crate) fn take(parts: &mut Parts) -> Option<Grid> {
        let Head { low, cell_m, columns, rows } = *parts.take::<Head>()?.first()?;
        let (columns, rows) = (columns as usize, rows as usize);
        let (first, entries) = (parts.take()?, parts.take()?);
        Some(Grid { low, cell_m, columns, rows, first, entries })
    }

    /// Lists all tracks.
    pub(crate) fn new(tracks: &Tracks) -> Grid {
        let lanes = || (0..tracks.count() as u32).filter(|&lane| tracks.has(lane));
        let mut low = Vec2::INFINITY;
        let mut high = Vec2::NEG_INFINITY;
        for lane in lanes() {
            for index in 0..tracks.samples(lane).0 {
                let point = tracks.sample_point(lane, index).truncate();
                (low, high) = (low.min(point), high.max(point));
            }
        }
        if low.x > high.x {
            (low, high) = (Vec2::ZERO, Vec2::ZERO);
        }
        (low, high) = (low - REACH_M, high + REACH_M);
        let mut cell_m = CELL_M;
        let size = |cell_m: f32| ((high - low) / cell_m).ceil().max(Vec2::ONE);
        while size(cell_m).x * size(cell_m).y > CELLS_MAX as f32 {
            cell_m *= 2.0;
        }
        let size = size(cell_m);
        let (columns, rows) = (size.x as usize, size.y as usize);
        let mut grid = Grid { low, cell_m, columns, rows, first: Vec::new(), entries: Vec::new() };
        // Half a cell's diagonal is added, so that REACH_M holds from anywhere in the cell.
        let reach = REACH_M.max(cell_m) + cell_m * std::f32::consts::FRAC_1_SQRT_2;
        let mut found: Vec<(u32, u32, f32, f32)> = Vec::new();
        for lane in lanes() {
            let begin = found.len();
            let (count, step) = tracks.samples(lane);
            for index in 0..count {
                let point = tracks.sample_point(lane, index).truncate();
                grid.for_cells_within(point, reach, |cell, distance| {
                    found.push((cell, lane, distance, index as f32 * step));
                });
            }
            // One entry for each pass of the lane: that of the nearest sample.
            found[begin..].sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.3.total_cmp(&b.3)));
            let mut kept = begin;
            let mut last_m = 0.0;
            for k in begin..found.len() {
                let (cell, _, distance, arc_m) = found[k];
                if kept == begin || cell != found[kept - 1].0 || arc_m - last_m > APART_M {
                    found[kept] = found[k];
                    kept += 1;
                } else if distance < found[kept - 1].2 {
                    found[kept - 1] = found[k];
                }
                last_m = arc_m;
            }
            found.truncate(kept);
        }
        // A stable sort keeps the passes of a lane in their order.
        found.sort_by_key(|&(cell, lane, ..)| (cell, lane));
        grid.first = vec![0; columns * rows + 1];
        for &(cell, ..) in &found {
            grid.first[cell as usize + 1] += 1;
        }
        for cell in 0..columns * rows {
            grid.first[cell + 1] += grid.first[cell];
        }
        let bends: Vec<Vec<f32>> = (0..tracks.count() as u32).map(|l| tracks.bends(l)).collect();
        let pass = |(_, lane, _, hint_m): (u32, u32, f32, f32)| {
            let bends = &bends[lane as usize];
            let index = tracks.index_near(lane, hint_m);
            let is_last = index + 1 == bends.len();
            let end = if index == 0 { -1.0 } else { f32::from(u8::from(is_last)) };
            let (place, bend_per_m) = (tracks.flat_at(lane, hint_m), bends[index]);
            Pass { lane, hint_m, place, end, bend_per_m }
        };
        grid.entries = found.into_iter().map(pass).collect();
        grid
    }

    /// Returns the tracks within [`REACH_M`] of `point`, and some a little farther, once for each pass
    /// of the track. Ascending by lane.
    pub(crate) fn near(&self, point: Vec2) -> &[Pass] {
        let at = (point - self.low) / self.cell_m;
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return &[];
        }
        let (column, row) = (at.x as usize, at.y as usize);
        if column >= self.columns || row >= self.rows {
            return &[];
        }
        let cell = row * self.columns + column;
        &self.entries[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    fn for_cells_within(&self, point: Vec2, reach: f32, mut found: impl FnMut(u32, f32)) {
        let low = ((point - self.low - reach) / self.cell_m).max(Vec2::ZERO);
        let high = (point - self.low + reach) / self.cell_m;
        let (right, top) =
            ((high.x as usize).min(self.columns - 1), (high.y as usize).min(self.rows - 1));
        for row in low.y as usize..=top {
            for column in low.x as usize..=right {
                let centre = self.low + (Vec2::new(column as f32, row as f32) + 0.5) * self.cell_m;
                let distance = centre.distance_squared(point);
                if distance <= reach * reach {
                    found((row * self.columns + column) as u32, distance);
                }
            }
        }
    }
}
