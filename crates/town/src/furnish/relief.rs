use glam::{Vec2, vec2};

/// The relief: a height at every point, taken from the roads and interpolated between them.
#[derive(Debug)]
pub(super) struct Relief {
    low: Vec2,
    cell_m: f32,
    columns: usize,
    rows: usize,
    heights: Vec<f32>,
}

impl Relief {
    /// Creates the relief from points on roads, over the plan from `low` to `high`.
    pub(super) fn new(low: Vec2, high: Vec2, points: impl Iterator<Item = (Vec2, f32)>) -> Relief {
        let size = high - low;
        let cell_m = (size.max_element() / 512.0).max(6.0);
        let (columns, rows) = ((size.x / cell_m) as usize + 2, (size.y / cell_m) as usize + 2);
        let mut sums = vec![(0.0f32, 0.0f32); columns * rows];
        for (point, height) in points {
            let p = (point - low) / cell_m;
            let cell = (p.y as usize).min(rows - 1) * columns + (p.x as usize).min(columns - 1);
            sums[cell].0 += height;
            sums[cell].1 += 1.0;
        }
        let known: Vec<bool> = sums.iter().map(|sum| sum.1 > 0.0).collect();
        for sum in &mut sums {
            *sum = (sum.0 / sum.1.max(1.0), sum.1.min(1.0));
        }
        let mut heights = fill(&sums, columns, rows);
        let mut relief = Relief { low, cell_m, columns, rows, heights: Vec::new() };
        // Relaxation makes the ground between roads smooth.
        for _ in 0..24 {
            relief.relax(&mut heights, &known);
        }
        relief.heights = heights;
        relief
    }

    fn relax(&self, heights: &mut [f32], known: &[bool]) {
        for row in 0..self.rows {
            for column in 0..self.columns {
                let cell = row * self.columns + column;
                if known[cell] {
                    continue;
                }
                let west = heights[cell - usize::from(column > 0)];
                let east = heights[cell + usize::from(column + 1 < self.columns)];
                let south = heights[if row > 0 { cell - self.columns } else { cell }];
                let north = heights[if row + 1 < self.rows { cell + self.columns } else { cell }];
                heights[cell] = (west + east + south + north) * 0.25;
            }
        }
    }

    /// The height at a point; outside the plan, that of the nearest edge.
    pub(super) fn at(&self, point: Vec2) -> f32 {
        let most = vec2(self.columns as f32 - 1.001, self.rows as f32 - 1.001);
        // Heights belong to the middles of cells.
        let p = ((point - self.low) / self.cell_m - 0.5).clamp(Vec2::ZERO, most);
        let (column, row) = (p.x as usize, p.y as usize);
        let (fx, fy) = (p.x - column as f32, p.y - row as f32);
        let height = |dx: usize, dy: usize| {
            let (row, column) =
                ((row + dy).min(self.rows - 1), (column + dx).min(self.columns - 1));
            self.heights[row * self.columns + column]
        };
        let south = height(0, 0) + (height(1, 0) - height(0, 0)) * fx;
        let north = height(0, 1) + (height(1, 1) - height(0, 1)) * fx;
        south + (north - south) * fy
    }
}

/// Gives every cell a height: averages go up a pyramid until all cells are known, then down again.
fn fill(sums: &[(f32, f32)], columns: usize, rows: usize) -> Vec<f32> {
    if sums.iter().all(|sum| sum.1 > 0.0) {
        return sums.iter().map(|sum| sum.0).collect();
    }
    if columns * rows <= 1 || sums.iter().all(|sum| sum.1 == 0.0) {
        return vec![0.0; sums.len()];
    }
    let (wide, tall) = (columns.div_ceil(2), rows.div_ceil(2));
    let mut coarse = vec![(0.0f32, 0.0f32); wide * tall];
    for row in 0..rows {
        for column in 0..columns {
            let (height, weight) = sums[row * columns + column];
            let cell = &mut coarse[row / 2 * wide + column / 2];
            cell.0 += height * weight;
            cell.1 += weight;
        }
    }
    for cell in &mut coarse {
        *cell = (cell.0 / cell.1.max(1.0), cell.1.min(1.0));
    }
    let coarse = fill(&coarse, wide, tall);
    (0..columns * rows)
        .map(|cell| {
            let (height, weight) = sums[cell];
            if weight > 0.0 {
                height
            } else {
                coarse[cell / columns / 2 * wide + cell % columns / 2]
            }
        })
        .collect()
}
