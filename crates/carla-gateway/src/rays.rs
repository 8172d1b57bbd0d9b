//! Ray casts through the static world and the boxes of actors.
//!
//! Triangles are sorted into the cells of a horizontal grid; a ray tests the triangles of the cells
//! that it crosses.

use client_lib::{BlueprintInfo, World};
use glam::{IVec2, Vec2, Vec3};
use mesh::Mesh;

/// Edge of a cell. Metres.
const CELL_M: f32 = 8.0;
/// Largest number of cells on a side of a grid; the cells of larger maps are larger.
const SIDE_MAX: f32 = 2048.0;
/// Longest ray; longer ones are shortened. Metres.
const REACH_M: f32 = 20_000.0;
/// Hits nearer to each other than this are one hit. Metres.
const APART_M: f32 = 0.01;

/// The triangles of the static world, by cell.
pub(crate) struct Rays<'a> {
    mesh: &'a Mesh,
    grid: &'a Grid,
}

/// The triangles that touch each cell: those of cell `i` are `triangles[starts[i]..starts[i + 1]]`.
pub(crate) struct Grid {
    low: Vec2,
    cell_m: f32,
    columns: i32,
    rows: i32,
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl<'a> Rays<'a> {
    /// Creates a ray caster over a mesh and the grid of its triangles.
    pub(crate) fn new(mesh: &'a Mesh, grid: &'a Grid) -> Rays<'a> {
        Rays { mesh, grid }
    }

    /// Returns all hits between two points, nearest first: the fraction of the distance, and the
    /// tag.
    pub(crate) fn hits(
        &self,
        from: Vec3,
        to: Vec3,
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Vec<(f32, u8)> {
        let along = (to - from).clamp_length_max(REACH_M);
        let mut hits = Vec::new();
        for triangle in self.grid.triangles_near(from.truncate(), (from + along).truncate()) {
            let corner = |i: usize| {
                let index = self.mesh.triangles[triangle as usize][i];
                Vec3::from_array(self.mesh.positions[index as usize])
            };
            if let Some(fraction) =
                intersect_triangle(from, along, [corner(0), corner(1), corner(2)])
            {
                hits.push((fraction, self.mesh.faces[triangle as usize].tag));
            }
        }
        for actor in world.states() {
            let Some(info) = blueprints.get(actor.blueprint as usize) else { continue };
            let half = Vec3::from_array(info.half_extents_m);
            let center = actor.pose.affine().transform_point3(Vec3::from_array(info.center_m));
            if let Some(fraction) =
                intersect_box(from, along, 1.0, center, actor.pose.rotation(), half)
            {
                hits.push((fraction, info.tag));
            }
        }
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let apart = APART_M / along.length().max(APART_M);
        hits.dedup_by(|later, earlier| later.0 - earlier.0 < apart);
        hits
    }
}

impl Grid {
    pub(crate) fn new(mesh: &Mesh) -> Grid {
        let (mut low, mut high) = (Vec2::splat(f32::INFINITY), Vec2::splat(f32::NEG_INFINITY));
        for position in &mesh.positions {
            let at = Vec3::from_array(*position).truncate();
            (low, high) = (low.min(at), high.max(at));
        }
        if !low.is_finite() {
            (low, high) = (Vec2::ZERO, Vec2::ZERO);
        }
        let cell_m = CELL_M.max((high - low).max_element() / SIDE_MAX);
        let size = ((high - low) / cell_m).as_ivec2() + 1;
        let mut grid = Grid {
            low,
            cell_m,
            columns: size.x,
            rows: size.y,
            starts: vec![0; (size.x * size.y) as usize + 1],
            triangles: Vec::new(),
        };
        let mut entries = Vec::new();
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let at = corners.map(|c| Vec3::from_array(mesh.positions[c as usize]).truncate());
            let low = grid.cell(at[0].min(at[1]).min(at[2]));
            let high = grid.cell(at[0].max(at[1]).max(at[2]));
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    entries.push(((y * grid.columns + x) as u32, index as u32));
                }
            }
        }
        entries.sort_unstable();
        for (cell, _) in &entries {
            grid.starts[*cell as usize + 1] += 1;
        }
        for cell in 1..grid.starts.len() {
            grid.starts[cell] += grid.starts[cell - 1];
        }
        grid.triangles = entries.into_iter().map(|(_, triangle)| triangle).collect();
        grid
    }

    fn cell(&self, at: Vec2) -> IVec2 {
        let cell = ((at - self.low) / self.cell_m).floor().as_ivec2();
        cell.clamp(IVec2::ZERO, IVec2::new(self.columns - 1, self.rows - 1))
    }

    /// Returns the triangles in the cells that a segment crosses, each once.
    fn triangles_near(&self, from: Vec2, to: Vec2) -> Vec<u32> {
        let mut found = Vec::new();
        let steps = ((to - from).length() / (self.cell_m * 0.5)).ceil().max(1.0) as u32;
        let mut cells = Vec::new();
        for step in 0..=steps {
            let at = self.cell(from.lerp(to, step as f32 / steps as f32));
            // A step of half a cell may skip a cell at its corner, so neighbours are included.
            for offset in [IVec2::ZERO, IVec2::X, IVec2::Y, IVec2::NEG_X, IVec2::NEG_Y] {
                let near =
                    (at + offset).clamp(IVec2::ZERO, IVec2::new(self.columns - 1, self.rows - 1));
                cells.push(near.y * self.columns + near.x);
            }
        }
        cells.sort_unstable();
        cells.dedup();
        for cell in cells {
            let (begin, end) = (self.starts[cell as usize], self.starts[cell as usize + 1]);
            found.extend_from_slice(&self.triangles[begin as usize..end as usize]);
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Returns the fraction of a segment at which it meets a triangle, from either side (Möller and
/// Trumbore, "Fast, minimum storage ray-triangle intersection", 1997).
fn intersect_triangle(from: Vec3, along: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
    let (edge, other) = (b - a, c - a);
    let p = along.cross(other);
    let determinant = edge.dot(p);
    if determinant.abs() < 1e-12 {
        return None;
    }
    let t = from - a;
    let u = t.dot(p) / determinant;
    let q = t.cross(edge);
    let v = along.dot(q) / determinant;
    let fraction = other.dot(q) / determinant;
    let is_inside = u >= -1e-5 && v >= -1e-5 && u + v <= 1.0 + 1e-5;
    (is_inside && (0.0..=1.0).contains(&fraction)).then_some(fraction)
}

/// Returns the fraction of a segment, at most `reach`, at which it enters a rotated box (slab
/// method).
fn intersect_box(
    from: Vec3,
    along: Vec3,
    reach: f32,
    center: Vec3,
    turn: glam::Quat,
    half: Vec3,
) -> Option<f32> {
    let back = turn.inverse();
    let (origin, along) = (back * (from - center), back * along);
    let (mut near, mut far) = (0.0f32, reach);
    for axis in 0..3 {
        let (o, d, h) = (origin[axis], along[axis], half[axis]);
        if d.abs() < 1e-12 {
            if o.abs() > h {
                return None;
            }
            continue;
        }
        let (a, b) = ((-h - o) / d, (h - o) / d);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    (near <= far).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::{Face, Material, Tag};

    #[test]
    fn a_ray_down_meets_the_ground_where_it_lies() {
        let mut mesh = Mesh::default();
        let face = Face::new(Tag::Roads, Material::Asphalt, 0);
        let corner = |x: f32, y: f32| [x * 100.0, y * 100.0, 2.0];
        mesh.quad([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], face);
        let grid = Grid::new(&mesh);
        let near = grid.triangles_near(Vec2::new(33.0, 60.0), Vec2::new(33.0, 60.0));
        assert!(!near.is_empty());
        let from = Vec3::new(33.0, 60.0, 10.0);
        let corners = |t: u32| {
            mesh.triangles[t as usize].map(|c| Vec3::from_array(mesh.positions[c as usize]))
        };
        let hits: Vec<f32> = near
            .iter()
            .filter_map(|t| intersect_triangle(from, Vec3::NEG_Z * 16.0, corners(*t)))
            .collect();
        assert!(hits.iter().any(|fraction| (fraction - 0.5).abs() < 1e-5), "{hits:?}");
    }
}
