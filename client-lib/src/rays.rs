//! Rays through the static world and the bounding boxes of actors.
//!
//! Triangles are sorted into the cells of a level grid; a ray visits the cells below it.

use glam::{IVec2, Vec2, Vec3};
use mesh::Mesh;
use protocol::{ActorId, BlueprintInfo};

use crate::World;

/// The size of a cell, metres.
const CELL_M: f32 = 8.0;
/// The most cells on a side of the grid: on larger maps, cells are larger.
const SIDE_MAX: f32 = 2048.0;
/// Rays visit cells that are at most this far beside them, metres: more than the rounding errors of places
/// 20 km from the origin, and than the slack of [`meet`] on triangles of 100 m.
const SLACK_M: f32 = 0.01;
/// Rays are cut off at this length, metres.
const REACH_M: f32 = 20_000.0;
/// Hits nearer to each other than this are one, metres.
const APART_M: f32 = 0.01;

/// What a ray hit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RayHit {
    /// Where on the ray, 0 at its beginning and 1 at its end.
    pub share: f32,
    /// Where in world space, metres.
    pub position: Vec3,
    /// The semantic tag of what was hit: a code of [`Tag`](mesh::Tag).
    pub tag: u8,
    /// The actor whose bounding box was hit; `None` for the static world.
    pub actor: Option<ActorId>,
}

/// The triangles of a static world, sorted for rays. Those of cell `i` are
/// `triangles[starts[i]..starts[i + 1]]`.
#[derive(Debug)]
pub struct RayGrid {
    low: Vec2,
    cell_m: f32,
    columns: i32,
    rows: i32,
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl RayGrid {
    /// Returns all hits from one place to another, in world space, the nearest first: triangles of
    /// the mesh that the grid was made of, and bounding boxes of actors.
    #[must_use]
    pub fn cast(
        &self,
        mesh: &Mesh,
        [from, to]: [Vec3; 2],
        world: &World,
        blueprints: &[BlueprintInfo],
    ) -> Vec<RayHit> {
        let along = (to - from).clamp_length_max(REACH_M);
        let hit = |share: f32, tag, actor| {
            let position = from + along * share;
            RayHit { share, position, tag, actor }
        };
        // Each with the number of its triangle: of equally near hits, the lowest comes first.
        let mut hits = Vec::new();
        for triangle in self.below(from.truncate(), (from + along).truncate()) {
            let corner = |i: usize| {
                let index = mesh.triangles[triangle as usize][i];
                Vec3::from_array(mesh.positions[index as usize])
            };
            if let Some(share) = meet(from, along, [corner(0), corner(1), corner(2)]) {
                hits.push((hit(share, mesh.faces[triangle as usize].tag, None), triangle));
            }
        }
        for actor in world.actors() {
            let Some(info) = blueprints.get(actor.blueprint()) else { continue };
            let half = Vec3::from_array(info.half_extents_m);
            let pose = actor.pose();
            let center = pose.affine().transform_point3(Vec3::from_array(info.center_m));
            if let Some(share) = enter(from, along, 1.0, center, pose.rotation(), half) {
                hits.push((hit(share, info.tag, Some(actor.id())), u32::MAX));
            }
        }
        hits.sort_by(|(a, a_at), (b, b_at)| a.share.total_cmp(&b.share).then(a_at.cmp(b_at)));
        let mut hits: Vec<_> = hits.into_iter().map(|(hit, _)| hit).collect();
        let apart = APART_M / along.length().max(APART_M);
        hits.dedup_by(|later, earlier| later.share - earlier.share < apart);
        hits
    }

    /// Sorts the triangles of a mesh.
    #[must_use]
    pub fn new(mesh: &Mesh) -> RayGrid {
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
        let mut grid = RayGrid {
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

    /// The triangles in the cells below a ray; one that lies in several cells comes several times.
    fn below(&self, from: Vec2, to: Vec2) -> impl Iterator<Item = u32> + '_ {
        let (low, high) = (self.cell(from.min(to) - SLACK_M), self.cell(from.max(to) + SLACK_M));
        let along = to - from;
        (low.y..=high.y).flat_map(move |row| {
            // The part of the ray above this row of cells. Beyond the grid belongs to its outer rows.
            let side = |row: i32| (row as f32).mul_add(self.cell_m, self.low.y);
            let south = if row == 0 { f32::NEG_INFINITY } else { side(row) - SLACK_M };
            let north = if row + 1 == self.rows { f32::INFINITY } else { side(row + 1) + SLACK_M };
            let (mut begin, mut end) = (0.0, 1.0f32);
            if along.y != 0.0 {
                let [a, b] = [south, north].map(|y| (y - from.y) / along.y);
                (begin, end) = (a.min(b).max(begin), a.max(b).min(end));
            }
            let [a, b] = [begin, end].map(|share| along.x.mul_add(share, from.x));
            let first = self.cell(Vec2::new(a.min(b) - SLACK_M, 0.0)).x;
            let last = self.cell(Vec2::new(a.max(b) + SLACK_M, 0.0)).x;
            let index = |column: i32| (row * self.columns + column) as usize;
            // The cells of a row lie one after another.
            let range = self.starts[index(first)] as usize..self.starts[index(last) + 1] as usize;
            self.triangles[range].iter().copied()
        })
    }
}

/// The share of the ray at which it hits a triangle, from either side: T. Möller and B. Trumbore,
/// *Fast, Minimum Storage Ray-Triangle Intersection*, 1997.
fn meet(from: Vec3, along: Vec3, [a, b, c]: [Vec3; 3]) -> Option<f32> {
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
    let share = other.dot(q) / determinant;
    let is_inside = u >= -1e-5 && v >= -1e-5 && u + v <= 1.0 + 1e-5;
    (is_inside && (0.0..=1.0).contains(&share)).then_some(share)
}

/// The multiple of `along`, at most `reach`, at which a turned box is entered.
fn enter(
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
    fn a_ray_down_hits_the_ground_where_it_lies() {
        let mut mesh = Mesh::default();
        let face = Face::new(Tag::Roads, Material::Asphalt, 0);
        let corner = |x: f32, y: f32| [x * 100.0, y * 100.0, 2.0];
        mesh.quad([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)], face);
        let grid = RayGrid::new(&mesh);
        let near = grid.below(Vec2::new(33.0, 60.0), Vec2::new(33.0, 60.0));
        let from = Vec3::new(33.0, 60.0, 10.0);
        let corners = |t: u32| {
            mesh.triangles[t as usize].map(|c| Vec3::from_array(mesh.positions[c as usize]))
        };
        let hits: Vec<f32> =
            near.filter_map(|t| meet(from, Vec3::NEG_Z * 16.0, corners(t))).collect();
        assert!(hits.iter().any(|share| (share - 0.5).abs() < 1e-5), "{hits:?}");
    }

    #[test]
    fn a_ray_finds_every_triangle_that_it_hits() {
        let mut random = mesh::RandomStream::from_state(7);
        let mut between = |low: f32, high: f32| random.between(low, high);
        let mut mesh = Mesh::default();
        let face = Face::new(Tag::Roads, Material::Asphalt, 0);
        for _ in 0..2000 {
            let at = [between(-200.0, 200.0), between(-90.0, 90.0), between(0.0, 20.0)];
            let mut corner = || [0, 1, 2].map(|axis| at[axis] + between(-6.0, 6.0));
            let corners = [corner(), corner(), corner(), corner()];
            mesh.quad(corners, face);
        }
        let grid = RayGrid::new(&mesh);
        let mut hits = 0;
        for round in 0..500 {
            // Some begin or end beyond the grid, and some are level with its axes or vertical.
            let mut end =
                || Vec3::new(between(-300.0, 300.0), between(-150.0, 150.0), between(-5.0, 25.0));
            let (from, mut to) = (end(), end());
            match round % 4 {
                0 => to.x = from.x,
                1 => to.y = from.y,
                2 => (to.x, to.y) = (from.x, from.y),
                _ => {}
            }
            let found: Vec<_> = grid.below(from.truncate(), to.truncate()).collect();
            for (index, triangle) in mesh.triangles.iter().enumerate() {
                let corners = triangle.map(|c| Vec3::from_array(mesh.positions[c as usize]));
                if meet(from, to - from, corners).is_some() {
                    hits += 1;
                    assert!(found.contains(&(index as u32)), "{index} from {from} to {to}");
                }
            }
        }
        assert!(hits > 1000, "{hits}");
    }
}
