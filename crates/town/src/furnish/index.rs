use glam::{IVec2, Vec2, Vec3};
use mesh::Mesh;

use super::raster::coarsest_m;

/// Finds the triangles above or below a point of the plan.
///
/// A hierarchy of grids of growing cell size; a triangle is listed in the finest grid in which it
/// covers few cells.
#[derive(Debug)]
pub(super) struct TriangleIndex {
    low: Vec2,
    grids: Vec<Grid>,
    corners: Vec<[Vec3; 3]>,
}

#[derive(Debug)]
struct Grid {
    cell_m: f32,
    columns: usize,
    rows: usize,
    /// The start of each cell's list in `members`.
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// The most rows and columns of cells in which a triangle is listed.
const SPAN_MAX: usize = 6;
/// The ratio of the cell sizes of two consecutive grids.
const COARSER: f32 = 5.0;

impl TriangleIndex {
    /// Creates the index of the upward triangles of `mesh` for whose numbers `keep` holds.
    pub(super) fn new(mesh: &Mesh, keep: impl Fn(usize) -> bool) -> TriangleIndex {
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            if keep(number) && (b - a).truncate().perp_dot((c - a).truncate()) > 1e-6 {
                corners.push([a, b, c]);
            }
        }
        let (mut low, mut high) = (Vec2::splat(1e9), Vec2::splat(-1e9));
        for corner in corners.iter().flatten() {
            (low, high) = (low.min(corner.truncate()), high.max(corner.truncate()));
        }
        let size = (high - low).max(Vec2::ONE);
        // Roads cover a small part of the plan, in several layers where they cross.
        let mut cell_m =
            (size.x * size.y / (corners.len() as f32 + 1.0) * 0.4).sqrt().clamp(0.8, 25.0);
        cell_m = cell_m.max(coarsest_m(size));
        let mut grids = Vec::new();
        let mut rest: Vec<u32> = (0..corners.len() as u32).collect();
        while !rest.is_empty() {
            let is_last = cell_m > size.max_element();
            let fits = |number: &u32| {
                let [a, b, c] = corners[*number as usize].map(|p| p.truncate());
                let extent = a.max(b).max(c) - a.min(b).min(c);
                is_last || extent.max_element() < (SPAN_MAX - 1) as f32 * cell_m
            };
            let (here, larger): (Vec<u32>, Vec<u32>) = rest.iter().partition(|n| fits(n));
            grids.push(Grid::new(low, size, cell_m, &corners, &here));
            rest = larger;
            cell_m *= COARSER;
        }
        TriangleIndex { low, grids, corners }
    }

    /// Calls `visit` with the height of every triangle that covers `point`, borders included.
    pub(super) fn heights(&self, point: Vec2, visit: impl FnMut(f32)) {
        self.found(point).for_each(visit);
    }

    /// The heights of all triangles that cover `point`.
    fn found(&self, point: Vec2) -> impl Iterator<Item = f32> {
        let near = self.grids.iter().flat_map(move |grid| grid.at(point - self.low));
        near.filter_map(move |number| {
            let [a, b, c] = self.corners[*number as usize];
            let (ab, ac, ap) = ((b - a).truncate(), (c - a).truncate(), point - a.truncate());
            let area = ab.perp_dot(ac);
            let (v, w) = (ap.perp_dot(ac) / area, ab.perp_dot(ap) / area);
            let covers = v >= -1e-5 && w >= -1e-5 && v + w <= 1.0 + 1e-5;
            covers.then_some(a.z + (b.z - a.z) * v + (c.z - a.z) * w)
        })
    }

    /// Whether any triangle covers `point`.
    pub(super) fn covers(&self, point: Vec2) -> bool {
        self.found(point).next().is_some()
    }

    /// The height of the lowest triangle at `point`.
    pub(super) fn lowest(&self, point: Vec2) -> Option<f32> {
        let mut lowest = None;
        self.heights(point, |z| lowest = Some(lowest.map_or(z, |other: f32| other.min(z))));
        lowest
    }

    /// The height of the highest triangle at `point` that is not above `limit`.
    pub(super) fn topmost(&self, point: Vec2, limit: f32) -> Option<f32> {
        let mut topmost: Option<f32> = None;
        self.heights(point, |z| {
            if z <= limit && topmost.is_none_or(|other| z > other) {
                topmost = Some(z);
            }
        });
        topmost
    }

    /// The height at `point` of the triangle nearest to `z`.
    pub(super) fn nearest(&self, point: Vec2, z: f32) -> Option<f32> {
        TriangleIndex::nearest_of(std::slice::from_ref(self), point, z)
    }

    /// The height at `point` of the triangle of any index nearest to `z`.
    pub(super) fn nearest_of(all: &[TriangleIndex], point: Vec2, z: f32) -> Option<f32> {
        let mut nearest: Option<f32> = None;
        for index in all {
            index.heights(point, |height| {
                if nearest.is_none_or(|other| (height - z).abs() < (other - z).abs()) {
                    nearest = Some(height);
                }
            });
        }
        nearest
    }
}

impl Grid {
    fn new(low: Vec2, size: Vec2, cell_m: f32, corners: &[[Vec3; 3]], numbers: &[u32]) -> Grid {
        let (columns, rows) = ((size.x / cell_m) as usize + 1, (size.y / cell_m) as usize + 1);
        let cells = |number: u32, visit: &mut dyn FnMut(usize)| {
            let [a, b, c] = corners[number as usize].map(|p| (p.truncate() - low) / cell_m);
            let (from, to) = (a.min(b).min(c).as_ivec2(), a.max(b).max(c).as_ivec2());
            let to = to.min(IVec2::new(columns as i32 - 1, rows as i32 - 1));
            for row in from.y..=to.y {
                for column in from.x..=to.x {
                    visit(row as usize * columns + column as usize);
                }
            }
        };
        let mut starts = vec![0u32; columns * rows + 1];
        for number in numbers {
            cells(*number, &mut |cell| starts[cell + 1] += 1);
        }
        for cell in 0..columns * rows {
            starts[cell + 1] += starts[cell];
        }
        let mut members = vec![0u32; starts[columns * rows] as usize];
        let mut next = starts.clone();
        for number in numbers {
            cells(*number, &mut |cell| {
                members[next[cell] as usize] = *number;
                next[cell] += 1;
            });
        }
        Grid { cell_m, columns, rows, starts, members }
    }

    /// The triangles whose boxes may contain a point, given relative to the lowest corner.
    fn at(&self, point: Vec2) -> &[u32] {
        let p = point / self.cell_m;
        if p.x < 0.0 || p.y < 0.0 || p.x as usize >= self.columns || p.y as usize >= self.rows {
            return &[];
        }
        let cell = p.y as usize * self.columns + p.x as usize;
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}
