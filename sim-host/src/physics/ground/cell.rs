//! Coordinates inside a cell of the grid, quantised so that one subtraction rejects most triangles
//! of a cell.

use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// Edge of a cell.
pub(super) const CELL_M: f32 = 2.0;
/// Steps along the edge of a cell.
const STEPS: f32 = 128.0;
/// The highest bit of each byte.
const HIGH: u32 = 0x8080_8080;

/// The cell of a point, and its place in the cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CellPoint {
    /// Column and row of the cell.
    pub cell: [u32; 2],
    /// Steps from the cell's lower corner, below 128.
    pub step: [u8; 2],
}

impl CellPoint {
    /// Returns the cell of a point, or `None` beyond the lower edges of the grid.
    #[inline]
    pub(super) fn of(origin: Vec2, point: Vec2) -> Option<CellPoint> {
        let at = (point - origin) * (1.0 / CELL_M);
        let cell = [at.x as u32, at.y as u32];
        (at.x >= 0.0 && at.y >= 0.0).then(|| CellPoint { cell, step: steps(origin, cell, point) })
    }
}

/// The bounds of a triangle in a cell, one byte each: the steps of the low corner, and 127 minus the
/// steps of the high corner.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellBounds(u32);

impl CellBounds {
    pub(super) fn new(origin: Vec2, cell: [u32; 2], low: Vec2, high: Vec2) -> CellBounds {
        let ([x, y], [right, top]) = (steps(origin, cell, low), steps(origin, cell, high));
        CellBounds(u32::from_le_bytes([x, y, 127 - right, 127 - top]))
    }

    /// Whether the point may be on the triangle.
    #[inline]
    pub(super) fn covers(self, at: &CellPoint) -> bool {
        let [x, y] = at.step;
        // Four comparisons in one subtraction: no byte may borrow.
        let point = u32::from_le_bytes([x, y, 127 - x, 127 - y]);
        ((point | HIGH) - self.0) & HIGH == HIGH
    }

    /// Whether a point between these steps, both inclusive, may be on the triangle.
    pub(super) fn overlaps(self, low: [u8; 2], high: [u8; 2]) -> bool {
        let most = u32::from_le_bytes([high[0], high[1], 127 - low[0], 127 - low[1]]);
        ((most | HIGH) - self.0) & HIGH == HIGH
    }
}

/// Returns the steps of a point from the cell's lower corner. The function is monotonic, and rounds
/// points and bounds in the same way.
#[inline]
fn steps(origin: Vec2, cell: [u32; 2], at: Vec2) -> [u8; 2] {
    let within = (at - origin) * (1.0 / CELL_M) - Vec2::new(cell[0] as f32, cell[1] as f32);
    (within * STEPS).clamp(Vec2::ZERO, Vec2::splat(STEPS - 1.0)).to_array().map(|step| step as u8)
}
