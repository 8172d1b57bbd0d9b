//! The ground below a point: the topmost triangle of roads and terrain, found through a grid.

use glam::{DVec2, Vec3};
use mesh::{Mesh, Tag};

/// Edge of a grid cell, in metres.
const CELL_M: f64 = 4.0;
/// A point at most this far below a surface stands on it, in metres.
const STEP_M: f64 = 0.5;

/// Upward-facing triangles, by the cells that they cross.
pub(super) struct Ground {
    triangles: Vec<([Vec3; 3], Tag)>,
    low: DVec2,
    columns: usize,
    rows: usize,
    cells: Vec<Vec<u32>>,
}

/// The ground at a point.
pub(super) struct Hit {
    pub(super) height_m: f64,
    /// Unit normal, pointing up.
    pub(super) normal: Vec3,
    pub(super) tag: Tag,
}

impl Ground {
    /// Builds the grid of the upward-facing triangles of object 0.
    pub(super) fn new(mesh: &Mesh) -> Ground {
        let mut triangles = Vec::new();
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for (corners, face) in mesh.triangles.iter().zip(&mesh.faces) {
            let points = corners.map(|corner| Vec3::from_array(mesh.positions[corner as usize]));
            let [a, b, c] = points;
            if face.object == 0 && (b - a).cross(c - a).z > 0.0 {
                for point in points {
                    low = low.min(point.truncate().as_dvec2());
                    high = high.max(point.truncate().as_dvec2());
                }
                triangles.push((points, Tag::from_code(face.tag).unwrap_or(Tag::Unlabeled)));
            }
        }
        if triangles.is_empty() {
            (low, high) = (DVec2::ZERO, DVec2::ZERO);
        }
        let size = (high - low) / CELL_M;
        let (columns, rows) = (size.x as usize + 1, size.y as usize + 1);
        let cells = vec![Vec::new(); columns * rows];
        let mut ground = Ground { triangles, low, columns, rows, cells };
        for index in 0..ground.triangles.len() {
            let points = ground.triangles[index].0.map(|point| point.truncate().as_dvec2());
            let from = (points[0].min(points[1]).min(points[2]) - low) / CELL_M;
            let to = (points[0].max(points[1]).max(points[2]) - low) / CELL_M;
            for row in from.y as usize..=(to.y as usize).min(rows - 1) {
                for column in from.x as usize..=(to.x as usize).min(columns - 1) {
                    ground.cells[row * columns + column].push(index as u32);
                }
            }
        }
        ground
    }

    /// Returns the topmost surface at (x, y), or the topmost one that is not above `z`.
    pub(super) fn below(&self, x: f64, y: f64, z: Option<f64>) -> Option<Hit> {
        let at = (DVec2::new(x, y) - self.low) / CELL_M;
        if at.min_element() < 0.0 || at.x >= self.columns as f64 || at.y >= self.rows as f64 {
            return None;
        }
        let cell = &self.cells[at.y as usize * self.columns + at.x as usize];
        let mut best: Option<Hit> = None;
        for index in cell {
            let (points, tag) = &self.triangles[*index as usize];
            let Some(height_m) = height(points, DVec2::new(x, y)) else { continue };
            let is_reached = z.is_none_or(|z| height_m <= z + STEP_M);
            if is_reached && best.as_ref().is_none_or(|best| height_m > best.height_m) {
                let [a, b, c] = *points;
                let normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
                best = Some(Hit { height_m, normal, tag: *tag });
            }
        }
        best
    }
}

/// Returns the height of the triangle at a point inside it, edges included.
fn height(points: &[Vec3; 3], at: DVec2) -> Option<f64> {
    let [a, b, c] = points.map(|point| point.as_dvec3());
    let part =
        |from: glam::DVec3, to: glam::DVec3| (to - from).truncate().perp_dot(at - from.truncate());
    let (of_c, of_a, of_b) = (part(a, b), part(b, c), part(c, a));
    let all = of_a + of_b + of_c;
    let is_inside = all > 0.0 && of_a.min(of_b).min(of_c) >= -1e-6 * all;
    is_inside.then(|| (a.z * of_a + b.z * of_b + c.z * of_c) / all)
}
