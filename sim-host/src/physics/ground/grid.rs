//! A sparse grid of cells that lists the triangles of the ground.

use std::ops::Range;

use bake::Values;
use glam::Vec2;

use super::{
    cell::{CELL_M, CellBounds, CellPoint},
    triangle::{SEAM_M, Triangle},
};

/// Cells along the edge of a block. Blocks without ground take no memory, so the memory of a long,
/// narrow map grows with the length of its roads.
const BLOCK_CELLS: usize = 16;
/// A query that starts below every surface is lifted to the lowest one within this height.
const RESCUE_M: f32 = 2.5;
/// Marks a block without ground, and a query that found none.
pub(super) const EMPTY: u32 = u32::MAX;

/// The triangles of the ground, listed by cell.
pub(super) struct Grid {
    pub triangles: Values<Triangle>,
    /// Lower corner of the grid, in world space.
    pub origin: Vec2,
    /// Blocks along x and y.
    pub blocks: [usize; 2],
    /// The number of each block among those with ground, or [`EMPTY`].
    pub block_numbers: Values<u32>,
    /// Where the list of each cell begins in `lists`, and the end of the last one.
    pub cell_starts: Values<u32>,
    /// Indices of triangles, cell by cell.
    pub lists: Values<u32>,
    /// In the order of `lists`: the part of the cell that each triangle may cover.
    pub bounds: Values<CellBounds>,
}

impl Grid {
    /// Sorts triangles into the cells of a grid from `low` to `high`: lists the cells under each
    /// triangle, counts, prefix sum, then writes. `corners` are those of each triangle.
    pub(super) fn new(
        triangles: Vec<Triangle>,
        corners: &[[Vec2; 3]],
        low: Vec2,
        high: Vec2,
    ) -> Grid {
        let origin = low - 1.0;
        let extent = high + 1.0 - origin;
        let edge_m = CELL_M * BLOCK_CELLS as f32;
        let blocks = [(extent.x / edge_m) as usize + 1, (extent.y / edge_m) as usize + 1];
        let mut block_numbers = vec![EMPTY; blocks[0] * blocks[1]];
        let cells_in_block = BLOCK_CELLS * BLOCK_CELLS;
        let mut counts: Vec<u32> = Vec::new();
        // Triangle by triangle: the cells under it, and its bounds in them.
        let mut covered: Vec<(u32, CellBounds)> = Vec::new();
        let mut covered_ends = Vec::with_capacity(triangles.len());
        let mut numbered = 0;
        for (triangle, points) in triangles.iter().zip(corners) {
            let low = points[0].min(points[1]).min(points[2]) - 2.0 * SEAM_M;
            let high = points[0].max(points[1]).max(points[2]) + 2.0 * SEAM_M;
            for_cells_under(origin, triangle, points, |[x, y]| {
                let block = y / BLOCK_CELLS * blocks[0] + x / BLOCK_CELLS;
                if block_numbers[block] == EMPTY {
                    block_numbers[block] = numbered;
                    numbered += 1;
                    counts.resize(numbered as usize * cells_in_block, 0);
                }
                let cell = block_numbers[block] as usize * cells_in_block
                    + y % BLOCK_CELLS * BLOCK_CELLS
                    + x % BLOCK_CELLS;
                counts[cell] += 1;
                let bounds = CellBounds::new(origin, [x as u32, y as u32], low, high);
                covered.push((cell as u32, bounds));
            });
            covered_ends.push(covered.len());
        }
        let mut total = 0;
        let mut cell_starts = Vec::with_capacity(counts.len() + 1);
        for count in &counts {
            cell_starts.push(total);
            total += count;
        }
        cell_starts.push(total);
        let mut lists = vec![0; total as usize];
        let mut bounds = vec![CellBounds::default(); total as usize];
        // The counts become the next free entry of each cell.
        let mut next = counts;
        next.copy_from_slice(&cell_starts[..cell_starts.len() - 1]);
        let mut begin = 0;
        for (index, end) in covered_ends.into_iter().enumerate() {
            for (cell, part) in &covered[begin..end] {
                let at = &mut next[*cell as usize];
                lists[*at as usize] = index as u32;
                bounds[*at as usize] = *part;
                *at += 1;
            }
            begin = end;
        }
        Grid {
            triangles: in_order_of(&mut lists, &triangles).into(),
            origin,
            blocks,
            block_numbers: block_numbers.into(),
            cell_starts: cell_starts.into(),
            lists: lists.into(),
            bounds: bounds.into(),
        }
    }

    /// Returns the entries of a cell in `lists`.
    #[inline]
    pub(super) fn range(&self, cell: [u32; 2]) -> Range<usize> {
        let [cell_x, cell_y] = cell.map(|c| c as usize);
        let (block_x, block_y) = (cell_x / BLOCK_CELLS, cell_y / BLOCK_CELLS);
        if block_x >= self.blocks[0] || block_y >= self.blocks[1] {
            return 0..0;
        }
        let block = self.block_numbers[block_y * self.blocks[0] + block_x];
        if block == EMPTY {
            return 0..0;
        }
        let cell = block as usize * (BLOCK_CELLS * BLOCK_CELLS)
            + cell_y % BLOCK_CELLS * BLOCK_CELLS
            + cell_x % BLOCK_CELLS;
        self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize
    }

    /// Returns the height of the highest surface at or below `z_from`, or of the lowest one within
    /// [`RESCUE_M`] above it, and its entry in `lists`; [`EMPTY`] if there is neither.
    #[inline]
    pub(super) fn find(&self, at: &CellPoint, point: Vec2, z_from: f32) -> (f32, u32) {
        let range = self.range(at.cell);
        let mut below = (f32::NEG_INFINITY, EMPTY);
        let mut above = (z_from + RESCUE_M, EMPTY);
        let first = range.start as u32;
        for (entry, bounds) in (first..).zip(&self.bounds[range]) {
            if !bounds.covers(at) {
                continue;
            }
            let triangle = &self.triangles[self.lists[entry as usize] as usize];
            let from_a = point - triangle.a.truncate();
            if triangle.inside(from_a) < -SEAM_M {
                continue;
            }
            let height = triangle.height(from_a);
            if height <= z_from {
                if height > below.0 {
                    below = (height, entry);
                }
            } else if height < above.0 {
                above = (height, entry);
            }
        }
        if below.1 != EMPTY { below } else { above }
    }
}

/// Returns the triangles in the order in which lists of their indices first name them, and renumbers
/// the lists: what is near in the world is near in memory then.
fn in_order_of(lists: &mut [u32], triangles: &[Triangle]) -> Vec<Triangle> {
    let mut ordered = Vec::with_capacity(triangles.len());
    let mut numbers = vec![EMPTY; triangles.len()];
    for index in lists {
        let number = &mut numbers[*index as usize];
        if *number == EMPTY {
            *number = ordered.len() as u32;
            ordered.push(triangles[*index as usize]);
        }
        *index = *number;
    }
    ordered
}

/// Calls `visit` with every cell that a triangle touches, with the margin of the seam, row by row.
fn for_cells_under(
    origin: Vec2,
    triangle: &Triangle,
    points: &[Vec2; 3],
    mut visit: impl FnMut([usize; 2]),
) {
    let low = points[0].min(points[1]).min(points[2]) - 2.0 * SEAM_M - origin;
    let high = points[0].max(points[1]).max(points[2]) + 2.0 * SEAM_M - origin;
    let cell = |m: f32| (m / CELL_M) as usize;
    let half = CELL_M / 2.0;
    let points = points.map(|p| p - origin);
    // A cell lies outside an edge if its nearest corner does.
    let reach = |edge: Vec2| -(half * (edge.x.abs() + edge.y.abs()) + 4.0 * SEAM_M);
    let (ab, bc, ca) = (triangle.edge_ab, triangle.edge_bc, triangle.edge_ca);
    let (reach_ab, reach_bc, reach_ca) = (reach(ab), reach(bc), reach(ca));
    for y in cell(low.y)..=cell(high.y) {
        let (from, to) = extent_in_row(&points, y as f32 * CELL_M);
        // A long slanting triangle touches few of the cells in its bounding box.
        for x in cell(from.max(low.x))..=cell(to.min(high.x).max(0.0)) {
            let center = origin + (Vec2::new(x as f32, y as f32) + 0.5) * CELL_M;
            let from_a = center - triangle.a.truncate();
            if ab.dot(from_a) >= reach_ab
                && bc.dot(from_a) + triangle.offset_bc >= reach_bc
                && ca.dot(from_a) >= reach_ca
            {
                visit([x, y]);
            }
        }
    }
}

/// Returns the extent along x of a triangle in the row of cells that begins at `y`, with a margin of
/// one cell.
fn extent_in_row(points: &[Vec2; 3], y: f32) -> (f32, f32) {
    let (low, high) = (y - CELL_M, y + 2.0 * CELL_M);
    let mut extent = (f32::INFINITY, f32::NEG_INFINITY);
    for index in 0..3 {
        let (a, b) = (points[index], points[(index + 1) % 3]);
        if a.y.max(b.y) < low || a.y.min(b.y) > high {
            continue;
        }
        // The part of the edge between the lines `low` and `high`.
        let along = |line: f32| ((line - a.y) / (b.y - a.y)).clamp(0.0, 1.0);
        let ends = if a.y == b.y { [0.0, 1.0] } else { [along(low), along(high)] };
        for share in ends {
            let x = a.x + (b.x - a.x) * share;
            extent = (extent.0.min(x - CELL_M), extent.1.max(x + CELL_M));
        }
    }
    extent
}
