//! Where the roads of a map and their markings are, in square cells seen from above.

use glam::Vec2;
use mesh::{Mesh, Tag};

/// Cells along the edge of a tile. Tiles without roads take no memory.
const TILE: usize = 64;
const TILE_CELLS: usize = TILE * TILE;
/// Most tiles of a raster.
const TILES_MAX: usize = 1 << 22;
/// No tile.
const NONE: u32 = u32::MAX;

/// Bits of a cell: its middle lies on a road, and a marking touches it.
pub(crate) const ROAD: u8 = 1;
pub(crate) const MARKING: u8 = 2;

/// The roads and markings of a map as cells of world space.
#[derive(Clone, Debug)]
pub(crate) struct RoadRaster {
    low: Vec2,
    cells_per_m: f32,
    columns: usize,
    rows: usize,
    /// The number of each tile among those with roads, or [`NONE`].
    numbers: Vec<u32>,
    cells: Vec<u8>,
}

impl RoadRaster {
    /// Draws the faces of a mesh that are road or marking, in cells of `cell_m`, coarser ones if the
    /// map is too large.
    pub(crate) fn new(mesh: &Mesh, cell_m: f32) -> RoadRaster {
        let is_road = |tag: u8| match Tag::from_code(tag) {
            Some(Tag::Roads) => Some(ROAD),
            Some(Tag::RoadLine) => Some(ROAD | MARKING),
            _ => None,
        };
        let corners = |triangle: &[u32; 3]| {
            triangle.map(|corner| {
                let [x, y, _] = mesh.positions[corner as usize];
                Vec2::new(x, y)
            })
        };
        let faces = || mesh.triangles.iter().zip(&mesh.faces);
        let roads = || faces().filter_map(|(t, face)| Some((corners(t), is_road(face.tag)?)));
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for (points, _) in roads() {
            for point in points.into_iter().filter(|point| point.is_finite()) {
                (low, high) = (low.min(point), high.max(point));
            }
        }
        if low.x > high.x {
            (low, high) = (Vec2::ZERO, Vec2::ZERO);
        }
        let mut cell_m = cell_m;
        let tiles = |cell_m: f32| {
            ((high - low) / (cell_m * TILE as f32)).to_array().map(|tiles| tiles as usize + 1)
        };
        while tiles(cell_m)[0] * tiles(cell_m)[1] > TILES_MAX {
            cell_m *= 2.0;
        }
        let [columns, rows] = tiles(cell_m);
        let numbers = vec![NONE; columns * rows];
        let cells_per_m = 1.0 / cell_m;
        let mut raster = RoadRaster { low, cells_per_m, columns, rows, numbers, cells: Vec::new() };
        for (points, bits) in roads().filter(|(points, _)| points.iter().all(|p| p.is_finite())) {
            // A marking is thinner than a cell.
            let reach = if bits & MARKING != 0 { 0.5 } else { 0.0 };
            let points = points.map(|point| (point - low) * cells_per_m);
            raster.draw(points, reach, bits);
        }
        raster
    }

    /// Sets bits of the cells whose squares of half edge `reach` around their centres meet a
    /// triangle. Coordinates in cells.
    fn draw(&mut self, [a, b, c]: [Vec2; 3], reach: f32, bits: u8) {
        let area = (b - a).perp_dot(c - a);
        if area.abs() < 1e-9 {
            return;
        }
        let sign = area.signum();
        // Each edge: its inward normal, and how far a square reaches along it.
        let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| {
            let normal = (to - from).perp() * sign;
            (from, normal, reach * (normal.x.abs() + normal.y.abs()))
        });
        let (low, high) = (a.min(b).min(c) - reach, a.max(b).max(c) + reach);
        let first = (low - 0.5).ceil().max(Vec2::ZERO);
        let last = high - 0.5;
        let (mut y, limit) = (first.y, Vec2::new(last.x, last.y));
        while y <= limit.y {
            let mut x = first.x;
            while x <= limit.x {
                let middle = Vec2::new(x, y) + 0.5;
                if edges.iter().all(|(from, normal, reach)| normal.dot(middle - from) >= -*reach) {
                    self.set(x as usize, y as usize, bits);
                }
                x += 1.0;
            }
            y += 1.0;
        }
    }

    fn set(&mut self, x: usize, y: usize, bits: u8) {
        if x / TILE >= self.columns || y / TILE >= self.rows {
            return;
        }
        let number = &mut self.numbers[y / TILE * self.columns + x / TILE];
        if *number == NONE {
            *number = (self.cells.len() / TILE_CELLS) as u32;
            self.cells.resize(self.cells.len() + TILE_CELLS, 0);
        }
        self.cells[*number as usize * TILE_CELLS + y % TILE * TILE + x % TILE] |= bits;
    }

    /// Returns the bits of the cell of a point of world space.
    #[inline]
    pub(crate) fn at(&self, point: Vec2) -> u8 {
        let at = (point - self.low) * self.cells_per_m;
        // Also false for what is not a number.
        if !(at.x >= 0.0 && at.y >= 0.0) {
            return 0;
        }
        let (x, y) = (at.x as usize, at.y as usize);
        if x / TILE >= self.columns || y / TILE >= self.rows {
            return 0;
        }
        match self.numbers[y / TILE * self.columns + x / TILE] {
            NONE => 0,
            number => self.cells[number as usize * TILE_CELLS + y % TILE * TILE + x % TILE],
        }
    }
}
