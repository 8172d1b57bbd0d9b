//! The ground: the surfaces that carry wheels and feet, and vertical queries of them.
//!
//! Wheels query the ground many times per millisecond, so it is no collider of the rigid-body
//! world: a query reads one cell of two metres and tests the few triangles in it.

use glam::{Vec2, Vec3};

use cell::CellPoint;
use grid::{EMPTY, Grid};
use topmost::TopmostCache;
use triangle::{Triangle, friction_of};

mod baked;
mod cell;
mod grid;
mod topmost;
mod triangle;

pub(super) use topmost::CachedTriangle;
pub use triangle::Hit;

/// Depth of the flat floor below the lowest ground.
const FLOOR_DEPTH_M: f32 = 5.0;
/// A query that starts further below the floor than this finds no floor: an actor that was spawned
/// or teleported there falls. Its springs would otherwise be compressed by that depth.
const FLOOR_REACH_M: f32 = 2.5;
/// Depth below a query of the surface that stands for no surface.
const NO_SURFACE_DEPTH_M: f32 = 100.0;

/// The ground of one map. It does not change.
pub struct Ground {
    grid: Grid,
    topmost: TopmostCache,
    /// Height of the floor below the map, in world space.
    floor_m: f32,
}

impl Ground {
    /// Creates the ground from the upward-facing triangles of object 0 (roads, sidewalks, terrain).
    pub fn new(mesh: &mesh::Mesh) -> Ground {
        let mut corners = Vec::new();
        let mut triangles = Vec::new();
        for (indices, face) in mesh.triangles.iter().zip(&mesh.faces) {
            if face.object != 0 {
                continue;
            }
            let points = indices.map(|i| Vec3::from_array(mesh.positions[i as usize]));
            if points.iter().all(|p| p.is_finite())
                && let Some(triangle) = Triangle::new(points, friction_of(face.material))
            {
                triangles.push(triangle);
                corners.push(points.map(Vec3::truncate));
            }
        }
        let mut low = Vec3::splat(f32::INFINITY);
        let mut high = Vec3::splat(f32::NEG_INFINITY);
        for (triangle, points) in triangles.iter().zip(&corners) {
            for p in points {
                let height = triangle.a.z + triangle.gradient.dot(*p - triangle.a.truncate());
                low = low.min(p.extend(height));
                high = high.max(p.extend(height));
            }
        }
        if triangles.is_empty() {
            (low, high) = (Vec3::ZERO, Vec3::ZERO);
        }
        let grid = Grid::new(triangles, &corners, low.truncate(), high.truncate());
        let topmost = TopmostCache::unknown(grid.lists.len());
        Ground { grid, topmost, floor_m: low.z - FLOOR_DEPTH_M }
    }

    /// Creates a plane at `height_m`, 4 km wide, for tests and benchmarks.
    pub fn flat(height_m: f32) -> Ground {
        let mut mesh = mesh::Mesh::default();
        let face = mesh::Face::new(mesh::Tag::Roads, mesh::Material::Asphalt, 0);
        let corner = |x: f32, y: f32| [x * 2000.0, y * 2000.0, height_m];
        mesh.quad(
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            face,
        );
        Ground::new(&mesh)
    }

    /// Returns the number of triangles that can carry a wheel or a foot.
    pub fn triangle_count(&self) -> usize {
        self.grid.triangles.len()
    }

    /// Returns the highest surface at or below `z_from`.
    ///
    /// If there is none, the result is the lowest surface within 2.5 m above, so that a wheel that
    /// a step has swallowed comes up again; otherwise it is the floor below the map. A query that
    /// starts more than 2.5 m below that floor finds a surface 100 m further down.
    #[inline]
    pub fn below(&self, x: f32, y: f32, z_from: f32) -> Hit {
        let point = Vec2::new(x, y);
        let Some(at) = CellPoint::of(self.grid.origin, point) else { return self.floor(z_from) };
        let (height_m, entry) = self.grid.find(&at, point, z_from);
        if entry == EMPTY {
            return self.floor(z_from);
        }
        self.grid.triangles[self.grid.lists[entry as usize] as usize].hit(height_m)
    }

    /// Returns the result of [`Ground::below`], without a search while `cached` still holds.
    #[inline]
    pub(super) fn below_cached(
        &self,
        x: f32,
        y: f32,
        z_from: f32,
        cached: &mut Option<CachedTriangle>,
    ) -> Hit {
        let point = Vec2::new(x, y);
        let Some(at) = CellPoint::of(self.grid.origin, point) else { return self.floor(z_from) };
        if let Some(hit) = self.topmost.hit(&self.grid, &at, point, z_from, cached) {
            return hit;
        }
        self.topmost
            .search(&self.grid, &at, point, z_from, cached)
            .unwrap_or_else(|| self.floor(z_from))
    }

    fn floor(&self, z_from: f32) -> Hit {
        let is_below = z_from < self.floor_m - FLOOR_REACH_M;
        let height_m = if is_below { z_from - NO_SURFACE_DEPTH_M } else { self.floor_m };
        Hit { height_m, normal: Vec3::Z, friction: 0.6, on_map: false }
    }
}
