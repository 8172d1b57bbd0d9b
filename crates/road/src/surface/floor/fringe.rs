//! Cells of a floor that reach beyond the surrounding road. They are built in pieces as far as the
//! gap extends.

use std::ops::RangeInclusive;

use mesh::Mesh;

use super::raster::{Corner, Floor, SINK_M};
use crate::surface::faces::ASPHALT;

/// Pieces along each side of a cell.
const PIECES: usize = 8;
const SIDE: usize = PIECES + 1;

pub(super) struct Fringe<'a> {
    floor: &'a Floor,
    /// Cells by their first corner, rising.
    pub(super) cells: Vec<Cell>,
}

pub(super) struct Cell {
    at: usize,
    covered: [bool; SIDE * SIDE],
}

impl<'a> Fringe<'a> {
    pub(super) fn of(floor: &'a Floor) -> Fringe<'a> {
        let mut cells = Vec::new();
        for row in 0..floor.rows - 1 {
            for column in 0..floor.columns - 1 {
                let at = row * floor.columns + column;
                let has = |kind: Corner| {
                    floor.cell(at).iter().any(|corner| floor.corners[*corner] == kind)
                };
                if has(Corner::Gap) && has(Corner::Outside) {
                    cells.push(Cell { at, covered: [false; SIDE * SIDE] });
                }
            }
        }
        Fringe { floor, cells }
    }

    /// Marks the parts of the cells that lie below or above a triangle.
    pub(super) fn cover(&mut self, mesh: &Mesh, triangle: usize) {
        let Floor { low, step, columns, rows, .. } = *self.floor;
        let [a, b, c] = mesh.triangles[triangle].map(|corner| {
            let [x, y, _] = mesh.positions[corner as usize].map(f64::from);
            [(x - low[0]) / step, (y - low[1]) / step]
        });
        let side = |p: [f64; 2], q: [f64; 2], at: [f64; 2]| {
            (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])
        };
        if side(a, b, c) <= 1e-9 {
            return;
        }
        let span = |axis: usize, limit: usize| -> RangeInclusive<usize> {
            let first = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
            first..=(a[axis].max(b[axis]).max(c[axis]).floor().max(0.0) as usize).min(limit - 1)
        };
        for row in span(1, rows) {
            let from = row * columns;
            let range = span(0, columns);
            let first = self.cells.partition_point(|cell| cell.at < from + range.start());
            let cells = self.cells[first..].iter_mut();
            for cell in cells.take_while(|cell| cell.at <= from + range.end()) {
                for (number, covered) in cell.covered.iter_mut().enumerate() {
                    let at = [
                        (cell.at - from) as f64 + (number % SIDE) as f64 / PIECES as f64,
                        row as f64 + (number / SIDE) as f64 / PIECES as f64,
                    ];
                    let sides = [side(a, b, at), side(b, c, at), side(c, a, at)];
                    *covered |= sides.iter().all(|side| *side >= -1e-9);
                }
            }
        }
    }

    pub(super) fn lay(&self, mesh: &mut Mesh) {
        for cell in &self.cells {
            let Some(filled) = self.fill(cell) else { continue };
            let mut vertices = [None; SIDE * SIDE];
            for number in (0..SIDE * PIECES).filter(|number| number % SIDE < PIECES) {
                let corners = [number, number + 1, number + 1 + SIDE, number + SIDE];
                let in_gap = corners.iter().any(|corner| filled[*corner]);
                let inside = corners.iter().all(|at| filled[*at] || cell.covered[*at]);
                if !in_gap || !inside {
                    continue;
                }
                let [a, b, c, d] = corners.map(|corner| {
                    *vertices[corner].get_or_insert_with(|| mesh.vertex(self.point(cell, corner)))
                });
                mesh.triangle([a, b, c], ASPHALT);
                mesh.triangle([a, c, d], ASPHALT);
            }
        }
    }

    /// Returns the parts of a cell in the gap; `None` where the gap is connected to the outside.
    fn fill(&self, cell: &Cell) -> Option<[bool; SIDE * SIDE]> {
        let ends = [0, PIECES, SIDE * SIDE - 1, SIDE * PIECES];
        let kinds = self.floor.cell(cell.at).map(|corner| self.floor.corners[corner]);
        let mut filled = [false; SIDE * SIDE];
        let mut open: Vec<usize> = Vec::new();
        for (kind, end) in kinds.iter().zip(ends) {
            if *kind == Corner::Gap {
                open.push(end);
            }
        }
        while let Some(at) = open.pop() {
            if filled[at] || cell.covered[at] {
                continue;
            }
            filled[at] = true;
            let (row, column) = (at / SIDE, at % SIDE);
            open.extend((row > 0).then(|| at - SIDE));
            open.extend((column > 0).then(|| at - 1));
            open.extend((row < PIECES).then_some(at + SIDE));
            open.extend((column < PIECES).then_some(at + 1));
        }
        let leaks =
            kinds.iter().zip(ends).any(|(kind, end)| *kind == Corner::Outside && filled[end]);
        (!leaks).then_some(filled)
    }

    fn point(&self, cell: &Cell, number: usize) -> [f32; 3] {
        let floor = self.floor;
        let corners = floor.cell(cell.at);
        let known = |corner: &usize| floor.corners[*corner] != Corner::Outside;
        let (sum, count) = corners
            .iter()
            .filter(|corner| known(corner))
            .fold((0.0, 0.0), |(sum, count), corner| (sum + floor.heights[*corner], count + 1.0));
        let [a, b, c, d] =
            corners.map(|at| if known(&at) { floor.heights[at] } else { sum / count });
        let right = (number % SIDE) as f64 / PIECES as f64;
        let up = (number / SIDE) as f64 / PIECES as f64;
        let z = (a + (b - a) * right) * (1.0 - up) + (d + (c - d) * right) * up;
        let x = floor.low[0] + ((cell.at % floor.columns) as f64 + right) * floor.step;
        let y = floor.low[1] + ((cell.at / floor.columns) as f64 + up) * floor.step;
        [x as f32, y as f32, (z - SINK_M) as f32]
    }
}
