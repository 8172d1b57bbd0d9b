//! Where in its cell a point lies, and how much of a cell a triangle covers: most of those that a
//! cell lists are out of the question at a glance, without being looked at.

use glam::Vec2;

use super::CELL_M;

/// Steps along the edge of a cell.
const STEPS: f32 = 128.0;
/// The highest bit of each byte.
const HIGH: u32 = 0x8080_8080;

/// Where in the grid a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seat {
    pub cell: [u32; 2],
    /// Steps from the cell's lower corner, below 128.
    pub step: [u8; 2],
}

impl Seat {
    /// Nothing left of the map or below it.
    #[inline]
    pub(super) fn of(origin: Vec2, point: Vec2) -> Option<Seat> {
        let at = (point - origin) * (1.0 / CELL_M);
        let cell = [at.x as u32, at.y as u32];
        (at.x >= 0.0 && at.y >= 0.0).then(|| Seat { cell, step: steps(origin, cell, point) })
    }
}

/// What a triangle's bounds are in a cell: steps of the low corner, and what the high corner's
/// lack to 127; a byte each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reach(u32);

impl Reach {
    pub(super) fn new(origin: Vec2, cell: [u32; 2], low: Vec2, high: Vec2) -> Reach {
        let ([x, y], [right, top]) = (steps(origin, cell, low), steps(origin, cell, high));
        Reach(u32::from_le_bytes([x, y, 127 - right, 127 - top]))
    }

    /// Whether the point may be on the triangle.
    #[inline]
    pub(super) fn covers(self, seat: &Seat) -> bool {
        let [x, y] = seat.step;
        // Four comparisons at once: no byte may borrow.
        let point = u32::from_le_bytes([x, y, 127 - x, 127 - y]);
        ((point | HIGH) - self.0) & HIGH == HIGH
    }

    /// Whether any point between these steps, both inclusive, may be on it.
    pub(super) fn meets(self, low: [u8; 2], high: [u8; 2]) -> bool {
        let most = u32::from_le_bytes([high[0], high[1], 127 - low[0], 127 - low[1]]);
        ((most | HIGH) - self.0) & HIGH == HIGH
    }
}

/// Rises with the place, and is rounded alike for points and bounds.
#[inline]
fn steps(origin: Vec2, cell: [u32; 2], at: Vec2) -> [u8; 2] {
    let within = (at - origin) * (1.0 / CELL_M) - Vec2::new(cell[0] as f32, cell[1] as f32);
    (within * STEPS).clamp(Vec2::ZERO, Vec2::splat(STEPS - 1.0)).to_array().map(|step| step as u8)
}
