//! The ground between roads, joined to their edges.
//!
//! The edges of roads on the ground are constraints of a Delaunay triangulation, whose faces below
//! roads are left out. Terrain and roads share vertices, so there are neither gaps nor overlaps.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Vec2, vec2};
use mesh::{Face, Material, Mesh, Tag};
use rayon::prelude::*;
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::{
    bridge::ABUTMENT_M,
    index::TriangleIndex,
    raster::{Raster, ground},
    relief::Relief,
};

/// Returns the edges that belong to only one of the kept triangles, in that triangle's direction,
/// as vertex indices of `mesh`. Vertices within half a millimetre of each other count as one.
pub(super) fn borders(mesh: &Mesh, keep: &[bool]) -> Vec<[u32; 2]> {
    let key = |corner: u32| mesh.positions[corner as usize].map(|x| (x * 1024.0).round() as i32);
    let mut corners: Vec<([i32; 3], u32)> =
        (0..mesh.positions.len() as u32).map(|corner| (key(corner), corner)).collect();
    corners.sort_unstable();
    let mut same = vec![0u32; mesh.positions.len()];
    let mut first = 0;
    for (index, (place, corner)) in corners.iter().enumerate() {
        if *place != corners[first].0 {
            first = index;
        }
        same[*corner as usize] = corners[first].1;
    }
    // Each edge under its smaller vertex, with its direction, in one number.
    let mut edges: Vec<u64> = Vec::with_capacity(mesh.triangles.len() * 3);
    for (triangle, _) in mesh.triangles.iter().zip(keep).filter(|(_, keep)| **keep) {
        let [a, b, c] = triangle.map(|corner| same[corner as usize]);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from != to {
                let (low, high) = (u64::from(from.min(to)), u64::from(from.max(to)));
                edges.push(low << 33 | high << 1 | u64::from(from < to));
            }
        }
    }
    edges.sort_unstable();
    edges
        .chunk_by(|one, other| one >> 1 == other >> 1)
        .filter(|uses| uses.len() == 1)
        .map(|uses| {
            let (low, high) = ((uses[0] >> 33) as u32, (uses[0] >> 1) as u32);
            if uses[0] & 1 == 1 { [low, high] } else { [high, low] }
        })
        .collect()
}

struct Corner {
    position: Point2<f64>,
    /// Unknown where edges were found to cross.
    z: Option<f32>,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// The greatest depth by which roads reach below each other where they meet. Metres.
const TONGUE_M: f32 = 0.6;

/// The input of the terrain.
pub(super) struct Site<'a> {
    pub(super) roads: &'a Mesh,
    /// The edges of the roads that lie on the ground.
    pub(super) edges: &'a [[u32; 2]],
    /// The vertices of bridges, as bits of x and y; the ground passes below them.
    pub(super) sunk: &'a BTreeSet<(u32, u32)>,
    /// The roads on the ground.
    pub(super) covered: &'a TriangleIndex,
    pub(super) relief: &'a Relief,
    pub(super) raster: &'a Raster,
    /// The corners of the town.
    pub(super) town: (Vec2, Vec2),
    /// The distance between points of the open ground. Metres.
    pub(super) spacing_m: f32,
}

/// Returns the ground as faces of object 0: grass, and paving on islands between lanes.
pub(super) fn terrain(site: &Site) -> Mesh {
    let mut builder = Builder::default();
    let joined =
        |edge: &[u32; 2]| {
            let ends = edge.map(|corner| site.roads.positions[corner as usize]);
            if !borders_open_ground(site, ends.map(|[x, y, _]| vec2(x, y))) {
                return None;
            }
            // An edge below another road is hidden: the ground joins the upper road.
            Some(ends.map(|[x, y, z]| {
                [x, y, site.covered.topmost(vec2(x, y), z + TONGUE_M).unwrap_or(z)]
            }))
        };
    let joined: Vec<_> = site.edges.par_iter().map(joined).collect();
    for ends in joined.into_iter().flatten() {
        let [a, b] = ends.map(|end| builder.corner(end));
        if a != b {
            builder.edges.push([a.min(b), a.max(b)]);
        }
    }
    open_ground(site, &mut builder);
    far_ground(site, &mut builder);
    builder.mesh(site)
}

/// Whether no other road lies just outside the edge from a to b, which has its road on the left.
fn borders_open_ground(site: &Site, [a, b]: [Vec2; 2]) -> bool {
    let out = -(b - a).perp().normalize_or_zero() * 0.03;
    [0.08, 0.5, 0.92].iter().any(|fraction| !site.covered.covers(a + (b - a) * *fraction + out))
}

/// Returns points of a grid wherever no road is near.
fn open_ground(site: &Site, builder: &mut Builder) {
    let (low, high) = site.town;
    let step = site.spacing_m;
    let rows = ((high.y - low.y) / step) as i32;
    let columns = ((high.x - low.x) / step) as i32;
    for row in 0..=rows {
        for column in 0..=columns {
            // Every other row is shifted, which makes triangles nearly equilateral.
            let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
            let point = low + vec2(column as f32 + shift, row as f32) * step;
            let near = [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)];
            let road = near
                .iter()
                .any(|(x, y)| site.raster.at(point + vec2(*x, *y) * step) & ground::ROAD != 0);
            if !road {
                builder.corner([point.x, point.y, site.relief.at(point)]);
            }
        }
    }
}

/// Returns rings of points round the town, out to hills at the horizon.
fn far_ground(site: &Site, builder: &mut Builder) {
    let (low, high) = site.town;
    let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let edge = (0..32).map(|k| {
        let around = Vec2::from_angle(k as f32 / 32.0 * std::f32::consts::TAU);
        site.relief.at(middle + around * half)
    });
    let level = edge.sum::<f32>() / 32.0;
    for (out, hill) in [(40.0, 0.0), (110.0, 0.5), (260.0, 5.0), (600.0, 22.0), (1300.0, 55.0)] {
        let count = 48;
        for k in 0..count {
            let angle = (k as f32 + 0.5 * (out % 3.0)) / count as f32 * std::f32::consts::TAU;
            let round = Vec2::from_angle(angle);
            // Square close to the town, round far from it.
            let square = half / round.abs().max_element().max(1e-6);
            let reach = square.min_element().max(half.max_element()) + out;
            let point = middle + round * reach;
            let roll = 0.5 + 0.5 * (angle * 3.0 + out * 0.01).sin() * (angle * 7.0 + 1.3).cos();
            let near = site.relief.at(middle + round * half.max_element());
            let height = near + (level - near) * (out / 260.0).min(1.0) + hill * roll;
            builder.corner([point.x, point.y, height]);
        }
    }
}

#[derive(Default)]
struct Builder {
    corners: Vec<[f32; 3]>,
    /// Vertices by the bits of x and y, so that no two vertices coincide.
    places: BTreeMap<(u32, u32), usize>,
    edges: Vec<[usize; 2]>,
}

impl Builder {
    fn corner(&mut self, position: [f32; 3]) -> usize {
        // Adding zero turns -0 into 0.
        let place = ((position[0] + 0.0).to_bits(), (position[1] + 0.0).to_bits());
        let corner = *self.places.entry(place).or_insert_with(|| {
            self.corners.push(position);
            self.corners.len() - 1
        });
        self.corners[corner][2] = self.corners[corner][2].max(position[2]);
        corner
    }

    fn mesh(mut self, site: &Site) -> Mesh {
        for (place, corner) in &self.places {
            if site.sunk.contains(place) {
                self.corners[*corner][2] -= ABUTMENT_M;
            }
        }
        let corners = self
            .corners
            .iter()
            .map(|[x, y, z]| Corner {
                position: Point2::new(f64::from(*x), f64::from(*y)),
                z: Some(*z),
            })
            .collect();
        self.edges.sort_unstable();
        self.edges.dedup();
        let mut crossing = Vec::new();
        let loaded = ConstrainedDelaunayTriangulation::<Corner>::try_bulk_load_cdt(
            corners,
            self.edges,
            |edge| {
                crossing.push(edge);
            },
        );
        // Vertices are finite and of moderate size, so bulk loading cannot fail.
        let Ok(mut plan) = loaded else { return Mesh::default() };
        for [from, to] in crossing {
            let handle = spade::handles::FixedVertexHandle::from_index;
            plan.add_constraint_and_split(handle(from), handle(to), |position| Corner {
                position,
                z: None,
            });
        }
        let mut mesh = Mesh::default();
        for corner in plan.vertices() {
            let at = vec2(corner.position().x as f32, corner.position().y as f32);
            let z = corner.data().z.unwrap_or_else(|| {
                let near = site.relief.at(at);
                site.covered.nearest(at, near).unwrap_or(near)
            });
            mesh.vertex([at.x, at.y, z]);
        }
        let faces: Vec<[u32; 3]> = plan
            .inner_faces()
            .map(|face| face.vertices().map(|corner| corner.index() as u32))
            .collect();
        let open = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|corner| {
                let [x, y, _] = mesh.positions[corner as usize];
                vec2(x, y)
            });
            let middle = (a + b + c) / 3.0;
            let is_open = (b - a).perp_dot(c - a) > 0.0 && !site.covered.covers(middle);
            is_open.then(|| (*corners, cover(site.raster, middle)))
        };
        let open: Vec<_> = faces.par_iter().map(open).collect();
        for (corners, face) in open.into_iter().flatten() {
            mesh.triangle(corners, face);
        }
        mesh
    }
}

fn cover(raster: &Raster, at: Vec2) -> Face {
    // Beside a road the cell itself belongs to the road; its neighbours decide the kind of ground.
    let round = [(0.0, 0.0), (1.2, 0.0), (0.0, 1.2), (-1.2, 0.0), (0.0, -1.2)];
    let bits = round.iter().fold(0, |bits, (x, y)| bits | raster.at(at + vec2(*x, *y)));
    if bits & ground::CLEAR != 0 {
        Face::new(Tag::SideWalks, Material::Concrete, 0)
    } else if bits & ground::PAVED != 0 {
        Face::new(Tag::Ground, Material::Concrete, 0)
    } else {
        Face::new(Tag::Terrain, Material::Grass, 0)
    }
}
