//! The grid of the spatial index: pieces of lane centres, by the square cells that they cross.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec3};

use crate::slab::{SharedBytes, Slab};

/// A piece of a lane's centre, in world space.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Segment {
    pub(crate) from: DVec3,
    pub(crate) to: DVec3,
    /// Metres along the lane in driving direction at `from` and `to`.
    pub(crate) along: [f64; 2],
    pub(crate) lane: u32,
    pub(crate) types: u32,
    /// Upper bound of the distance between the lane's centre and the piece, metres.
    pub(crate) sag_m: f32,
    /// No part of the lane lies farther beside the piece than this, metres.
    pub(crate) outside_m: f32,
    /// Every point nearer beside the piece than this lies on the lane, metres.
    pub(crate) inside_m: f32,
    pub(crate) shape: Shape,
    /// Derivatives of the centre at both ends, scaled to the whole piece; of [`Shape::ARC`] only.
    pub(crate) tangents: [Vec3; 2],
}

/// How the lane's centre follows a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(crate) struct Shape(u32);

impl Shape {
    /// The centre is the piece, with constant speed.
    pub(crate) const STRAIGHT: Shape = Shape(0);
    /// The centre is the cubic with the ends and tangents of the piece, to a tenth of a millimetre.
    pub(crate) const ARC: Shape = Shape(1);
    /// The centre must be computed from the road.
    pub(crate) const FREE: Shape = Shape(2);
}

/// A segment as stored in a cell of the grid: relative to the cell's lower corner, so that f32
/// resolves a tenth of a millimetre. The entries of a cell are contiguous in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Entry {
    pub(crate) from: Vec3,
    pub(crate) along: Vec3,
    pub(crate) types: u32,
    pub(crate) segment: u32,
}

/// Segments by the square cells that they cross.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LaneIndexGrid {
    pub(crate) segments: Slab<Segment>,
    /// Union of the types of all segments.
    pub(crate) types: u32,
    pub(crate) low: DVec2,
    /// The height that entries are relative to, metres.
    pub(crate) base_m: f64,
    pub(crate) cell_m: f64,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Index of each cell's first entry, and the number of entries.
    pub(crate) starts: Slab<u32>,
    pub(crate) entries: Slab<Entry>,
}

const CELL_M: f64 = 8.0;
const CELLS_MAX: f64 = 5e5;
/// Widths may exceed the sampled ones by this much between samples, metres.
pub(crate) const SLACK_M: f64 = 0.1;
impl LaneIndexGrid {
    /// Returns the corners of the bounding box of all lanes.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for segment in &*self.segments {
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

    pub(crate) fn filled(segments: Vec<Segment>) -> LaneIndexGrid {
        let mut low = DVec3::splat(f64::INFINITY);
        let mut high = DVec3::splat(f64::NEG_INFINITY);
        for segment in &segments {
            low = low.min(segment.from).min(segment.to);
            high = high.max(segment.from).max(segment.to);
        }
        if segments.is_empty() {
            return LaneIndexGrid::default();
        }
        let size = (high - low).truncate();
        let cell_m =
            CELL_M.max((size.x * size.y / CELLS_MAX).sqrt()).max(size.max_element() / CELLS_MAX);
        let columns = (size.x / cell_m) as usize + 1;
        let rows = (size.y / cell_m) as usize + 1;
        let types = segments.iter().fold(0, |types, segment| types | segment.types);
        let mut grid = LaneIndexGrid {
            segments: Slab::default(),
            types,
            low: low.truncate(),
            base_m: low.z,
            cell_m,
            columns,
            rows,
            starts: Slab::default(),
            entries: Slab::default(),
        };
        let mut starts = vec![0; columns * rows + 1];
        for segment in &segments {
            grid.each_cell(segment, |cell| starts[cell + 1] += 1);
        }
        for cell in 0..columns * rows {
            starts[cell + 1] += starts[cell];
        }
        let mut entries = vec![Entry::default(); starts[columns * rows] as usize];
        // Each cell's start becomes its end, which is the start of the next cell.
        for (segment, index) in segments.iter().zip(0..) {
            grid.each_cell(segment, |cell| {
                entries[starts[cell] as usize] = grid.entry(segment, index, cell);
                starts[cell] += 1;
            });
        }
        starts.pop();
        starts.insert(0, 0);
        grid.segments = Slab::Owned(segments);
        (grid.starts, grid.entries) = (Slab::Owned(starts), Slab::Owned(entries));
        grid
    }

    /// Returns the slabs of the index in the order of [`LaneIndexGrid::shared`].
    pub(crate) fn slabs(&self) -> [&[u8]; 3] {
        let (segments, entries) = (&*self.segments, &*self.entries);
        [
            bytemuck::cast_slice(segments),
            bytemuck::cast_slice(&self.starts),
            bytemuck::cast_slice(entries),
        ]
    }

    /// Returns this grid over the slabs in `bytes`; `None` if they contain an invalid reference.
    pub(crate) fn shared(
        bytes: &SharedBytes,
        [segments, starts, entries]: [Range<usize>; 3],
        grid: &LaneIndexGrid,
        lanes: usize,
    ) -> Option<LaneIndexGrid> {
        let grid = LaneIndexGrid {
            segments: Slab::shared(bytes, segments)?,
            starts: Slab::shared(bytes, starts)?,
            entries: Slab::shared(bytes, entries)?,
            ..grid.clone()
        };
        grid.is_sound(lanes).then_some(grid)
    }

    fn is_sound(&self, lanes: usize) -> bool {
        let (segments, starts, entries) = (&*self.segments, &*self.starts, &*self.entries);
        if segments.is_empty() {
            return *self == LaneIndexGrid::default();
        }
        let cells = self.columns.checked_mul(self.rows);
        let is_whole = self.low.is_finite() && self.base_m.is_finite() && self.cell_m > 0.0;
        is_whole
            && cells.and_then(|cells| cells.checked_add(1)) == Some(starts.len())
            && starts.first() == Some(&0)
            && starts.last().is_some_and(|end| *end as usize == entries.len())
            && starts.is_sorted()
            && segments.iter().all(|segment| (segment.lane as usize) < lanes)
            && entries.iter().all(|entry| (entry.segment as usize) < segments.len())
    }

    fn entry(&self, segment: &Segment, index: u32, cell: usize) -> Entry {
        let from = segment.from - self.corner(cell % self.columns, cell / self.columns);
        let along = segment.to - segment.from;
        Entry { from: from.as_vec3(), along: along.as_vec3(), types: segment.types, segment: index }
    }

    /// Returns the origin of a cell's coordinates.
    pub(crate) fn corner(&self, column: usize, row: usize) -> DVec3 {
        let corner = self.low + DVec2::new(column as f64, row as f64) * self.cell_m;
        corner.extend(self.base_m)
    }

    /// Returns the cell of a point, or the nearest cell of the grid.
    fn cell(&self, point: DVec2) -> (usize, usize) {
        let at = (point - self.low) / self.cell_m;
        (
            at.x.clamp(0.0, (self.columns - 1) as f64) as usize,
            at.y.clamp(0.0, (self.rows - 1) as f64) as usize,
        )
    }

    /// Visits every cell that a segment crosses, once.
    fn each_cell(&self, segment: &Segment, mut visit: impl FnMut(usize)) {
        let (from, to) = (segment.from.truncate(), segment.to.truncate());
        let (a, b) = (self.cell(from), self.cell(to));
        let (low, high) = (a.1.min(b.1), a.1.max(b.1));
        for row in low..=high {
            let (mut left, mut right) = (a.0.min(b.0), a.0.max(b.0));
            if low < high && left < right {
                // The x coordinates where the segment enters and leaves the row.
                let ends = [row, row + 1].map(|row| {
                    let y = self.low.y + row as f64 * self.cell_m;
                    let share = ((y - from.y) / (to.y - from.y)).clamp(0.0, 1.0);
                    from.x + (to.x - from.x) * share
                });
                let column = |x: f64| self.cell(DVec2::new(x, 0.0)).0;
                left = left.max(column(ends[0].min(ends[1]) - EDGE_M));
                right = right.min(column(ends[0].max(ends[1]) + EDGE_M));
            }
            for column in left..=right {
                visit(row * self.columns + column);
            }
        }
    }

    /// Visits every segment in the cells within `reach` of `point`, some more than once.
    pub(crate) fn near(&self, point: DVec2, reach: f64, mut visit: impl FnMut(&Segment)) {
        if self.segments.is_empty() {
            return;
        }
        let (low, high) = (self.cell(point - reach), self.cell(point + reach));
        let (starts, all, segments) = (&*self.starts, &*self.entries, &*self.segments);
        for row in low.1..=high.1 {
            let cells = row * self.columns + low.0..row * self.columns + high.0;
            let entries = starts[cells.start] as usize..starts[cells.end + 1] as usize;
            for entry in &all[entries] {
                visit(&segments[entry.segment as usize]);
            }
        }
    }
}

/// A segment that comes this near to a cell may count as crossing it, metres.
const EDGE_M: f64 = 1e-6;
