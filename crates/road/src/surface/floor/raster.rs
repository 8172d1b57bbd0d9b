//! The heights of a floor at the corners of square cells.

use std::ops::Range;

use mesh::{Mesh, Tag};

use crate::surface::faces::ASPHALT;

/// Distance of the floor's corners in metres, and most corners; cells of a large junction are
/// larger.
const STEP_M: f64 = 1.0;
const CORNERS_MAX: f64 = 250_000.0;
/// How far the floor lies below the lanes around it, metres.
pub(super) const SINK_M: f64 = 0.012;
/// Iterations in which the floor between known heights is smoothed.
const ROUNDS: usize = 60;

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Corner {
    /// No road reaches here, and no road separates it from the rim.
    Outside,
    /// Between roads.
    Gap,
    /// Below a road of unknown or known height.
    Covered,
}

pub(super) struct Floor {
    pub(super) low: [f64; 2],
    pub(super) step: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) corners: Vec<Corner>,
    pub(super) heights: Vec<f64>,
    /// Whether the height is that of a road.
    fixed: Vec<bool>,
}

impl Floor {
    pub(super) fn round(
        mesh: &Mesh,
        triangles: impl Iterator<Item = Range<usize>>,
    ) -> Option<Floor> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for triangle in triangles.flatten() {
            for corner in mesh.triangles[triangle] {
                for axis in 0..2 {
                    let value = f64::from(mesh.positions[corner as usize][axis]);
                    low[axis] = low[axis].min(value);
                    high[axis] = high[axis].max(value);
                }
            }
        }
        if low[0] > high[0] {
            return None;
        }
        let size = [high[0] - low[0] + 4.0, high[1] - low[1] + 4.0];
        let step = STEP_M.max((size[0] * size[1] / CORNERS_MAX).sqrt());
        let low = low.map(|value| ((value - 2.0) / step).floor() * step);
        let (columns, rows) = ((size[0] / step) as usize + 3, (size[1] / step) as usize + 3);
        Some(Floor {
            low,
            step,
            columns,
            rows,
            corners: vec![Corner::Gap; columns * rows],
            heights: vec![f64::INFINITY; columns * rows],
            fixed: vec![false; columns * rows],
        })
    }

    /// Takes over the height of a triangle at all corners below or above it.
    pub(super) fn cover(&mut self, mesh: &Mesh, triangle: usize) {
        let [a, b, c] =
            mesh.triangles[triangle].map(|corner| mesh.positions[corner as usize].map(f64::from));
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area <= 1e-9 {
            return;
        }
        let tag = mesh.faces[triangle].tag;
        let drivable = tag == Tag::Roads as u8 || tag == Tag::RoadLine as u8;
        let span = |axis: usize, limit: usize| {
            let (low, high) = (
                a[axis].min(b[axis]).min(c[axis]) - self.low[axis],
                a[axis].max(b[axis]).max(c[axis]) - self.low[axis],
            );
            let first = (low / self.step).ceil().max(0.0) as usize;
            let last = (high / self.step).floor();
            if last < 0.0 { 1..1 } else { first..(last as usize + 1).min(limit) }
        };
        for row in span(1, self.rows) {
            for column in span(0, self.columns) {
                let x = self.low[0] + column as f64 * self.step;
                let y = self.low[1] + row as f64 * self.step;
                let side = |p: [f64; 3], q: [f64; 3]| {
                    ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
                };
                let shares = [side(b, c), side(c, a), side(a, b)];
                if shares.iter().any(|share| *share < -1e-9) {
                    continue;
                }
                let at = row * self.columns + column;
                self.corners[at] = Corner::Covered;
                if drivable {
                    let z = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
                    self.heights[at] = self.heights[at].min(z);
                    self.fixed[at] = true;
                }
            }
        }
    }

    /// Separates gaps from the outside, beginning at the rim.
    pub(super) fn enclose(&mut self) {
        let mut open = Vec::new();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let rim =
                    row == 0 || column == 0 || row + 1 == self.rows || column + 1 == self.columns;
                if rim {
                    open.push((row, column));
                }
            }
        }
        while let Some((row, column)) = open.pop() {
            let at = row * self.columns + column;
            if self.corners[at] != Corner::Gap {
                continue;
            }
            self.corners[at] = Corner::Outside;
            if row > 0 {
                open.push((row - 1, column));
            }
            if column > 0 {
                open.push((row, column - 1));
            }
            if row + 1 < self.rows {
                open.push((row + 1, column));
            }
            if column + 1 < self.columns {
                open.push((row, column + 1));
            }
        }
    }

    /// Computes heights without a road as the mean of their neighbours.
    pub(super) fn smooth(&mut self) {
        let known: Vec<f64> = self
            .heights
            .iter()
            .zip(&self.fixed)
            .filter(|(_, fixed)| **fixed)
            .map(|(h, _)| *h)
            .collect();
        if known.is_empty() {
            return;
        }
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        for (height, fixed) in self.heights.iter_mut().zip(&self.fixed) {
            if !fixed {
                *height = mean;
            }
        }
        for _ in 0..ROUNDS {
            for row in 1..self.rows - 1 {
                for column in 1..self.columns - 1 {
                    let at = row * self.columns + column;
                    if self.fixed[at] || self.corners[at] == Corner::Outside {
                        continue;
                    }
                    let around = [at - 1, at + 1, at - self.columns, at + self.columns];
                    let inside = around.iter().filter(|at| self.corners[**at] != Corner::Outside);
                    let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), at| {
                        (sum + self.heights[*at], count + 1.0)
                    });
                    if count > 0.0 {
                        self.heights[at] = sum / count;
                    }
                }
            }
        }
    }

    /// Where roads are steep, takes the lowest height around, so that no cell protrudes through a
    /// road that dips between its corners.
    pub(super) fn sink(&mut self) {
        let heights = self.heights.clone();
        for row in 1..self.rows - 1 {
            for column in 1..self.columns - 1 {
                let at = row * self.columns + column;
                for near in [at - self.columns, at, at + self.columns] {
                    for near in near - 1..=near + 1 {
                        if self.fixed[near] && heights[near] < heights[at] - SINK_M {
                            self.heights[at] = self.heights[at].min(heights[near]);
                        }
                    }
                }
            }
        }
    }

    /// Returns the corners of the cell whose first corner is `at`.
    pub(super) fn cell(&self, at: usize) -> [usize; 4] {
        [at, at + 1, at + 1 + self.columns, at + self.columns]
    }

    pub(super) fn lay(&self, mesh: &mut Mesh) {
        if !self.fixed.iter().any(|fixed| *fixed) {
            return;
        }
        let mut vertices: Vec<Option<u32>> = vec![None; self.corners.len()];
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let at = row * self.columns + column;
                let corners = self.cell(at);
                if corners.iter().any(|corner| self.corners[*corner] == Corner::Outside) {
                    continue;
                }
                let [a, b, c, d] = corners.map(|corner| {
                    *vertices[corner].get_or_insert_with(|| {
                        let x = self.low[0] + (corner % self.columns) as f64 * self.step;
                        let y = self.low[1] + (corner / self.columns) as f64 * self.step;
                        mesh.vertex([x as f32, y as f32, (self.heights[corner] - SINK_M) as f32])
                    })
                });
                mesh.triangle([a, b, c], ASPHALT);
                mesh.triangle([a, c, d], ASPHALT);
            }
        }
    }
}
