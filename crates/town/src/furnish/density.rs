use glam::Vec2;

use crate::furnish::{
    frontage::{Frontage, STEP_M, Station},
    raster::coarsest_m,
};

/// The urban density of each place: 0 in the open country, 1 in the middle of a dense grid.
#[derive(Debug, Default)]
pub(super) struct Density {
    low: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    cells: Vec<f32>,
    middle: Vec2,
    radius_m: f32,
    phase: f32,
}

/// The size of a cell, unless the plan is so large that there would be too many.
const CELL_M: f32 = 30.0;
/// The frontage of slow residential roads at density 1. Metres per hectare.
const DENSE: f32 = 290.0;
/// The speed from which on a road has no residential frontage. Metres per second.
pub(super) const FAST_MPS: f32 = 21.0;

impl Density {
    pub(super) fn new(low: Vec2, high: Vec2, outlines: &[Frontage], phase: f32) -> Density {
        let size = high - low;
        let cell_m = CELL_M.max(coarsest_m(size));
        let (columns, rows) = ((size.x / cell_m) as usize + 1, (size.y / cell_m) as usize + 1);
        let mut cells = vec![0.0f32; columns * rows];
        let (mut middle, mut weight) = (Vec2::ZERO, 0.0f32);
        let slow = || {
            let lived = |station: &&Station| station.limit_mps < FAST_MPS || station.walk_m > 0.5;
            outlines.iter().flatten().filter(lived)
        };
        for station in slow() {
            let p = ((station.edge - low) / cell_m).max(Vec2::ZERO);
            let cell = (p.y as usize).min(rows - 1) * columns + (p.x as usize).min(columns - 1);
            cells[cell] += STEP_M / (cell_m * cell_m * 1e-4);
            middle += station.edge;
            weight += 1.0;
        }
        let middle = if weight > 0.0 { middle / weight } else { (low + high) * 0.5 };
        let spread = slow().map(|station| station.edge.distance_squared(middle)).sum::<f32>();
        let radius_m = (spread / weight.max(1.0)).sqrt().max(150.0) * 1.5;
        for _ in 0..4 {
            blur(&mut cells, columns, rows);
        }
        Density { low, cell_m, columns, rows, cells, middle, radius_m, phase }
    }

    /// The density at a point.
    pub(super) fn at(&self, point: Vec2) -> f32 {
        let p = ((point - self.low) / self.cell_m).max(Vec2::ZERO);
        let cell =
            (p.y as usize).min(self.rows - 1) * self.columns + (p.x as usize).min(self.columns - 1);
        let grid = (self.cells[cell] / DENSE).min(1.0);
        let away = (point.distance(self.middle) / self.radius_m).min(1.0);
        let patch =
            (point.x * 0.017 + self.phase).sin() * (point.y * 0.015 + self.phase * 1.7).cos();
        (grid * (1.0 - 0.72 * away * away) + 0.12 * patch * grid).clamp(0.0, 1.0)
    }
}

/// Averages over three by three cells.
fn blur(cells: &mut [f32], columns: usize, rows: usize) {
    let old = cells.to_vec();
    for row in 0..rows {
        for column in 0..columns {
            let mut sum = 0.0;
            for y in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
                for x in column.saturating_sub(1)..=(column + 1).min(columns - 1) {
                    sum += old[y * columns + x];
                }
            }
            cells[row * columns + column] = sum / 9.0;
        }
    }
}
