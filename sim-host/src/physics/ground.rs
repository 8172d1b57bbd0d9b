//! Where the ground is: the triangles that one can stand on, and a grid that finds them.
//!
//! Wheels ask many times a millisecond, so the ground is not a collider of the rigid-body world:
//! a query looks into one cell of two metres and tests the few triangles there.

use glam::{Vec2, Vec3};
use mesh::Material;

mod foothold;
mod seat;

pub(super) use foothold::Foothold;
use foothold::Tops;
use seat::{Reach, Seat};

/// Edge of a cell.
const CELL_M: f32 = 2.0;
/// Cells along the edge of a block. Blocks without ground take no memory, so that a long thin
/// map costs what its roads cost.
const BLOCK_CELLS: usize = 16;
/// A point this far outside a triangle still counts as on it, so that no seam lets a wheel fall.
const SEAM_M: f32 = 1e-3;
/// Steeper faces (kerb stones' sides, walls) are not ground.
const NORMAL_Z_MIN: f32 = 0.2;
/// The flat floor below everything lies this far under the lowest ground.
const FLOOR_DEPTH_M: f32 = 5.0;
/// A start point that is at most this far below a surface, and above none, is lifted onto it.
const RESCUE_M: f32 = 2.5;
/// Marks a block without ground.
const EMPTY: u32 = u32::MAX;

/// What lies under a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Height of the surface at the asked x and y.
    pub height_m: f32,
    /// Unit length, upwards.
    pub normal: Vec3,
    /// Factor on a tyre's grip; 1 is dry asphalt.
    pub friction: f32,
    /// False: there is no ground, and this is the flat floor under the whole map.
    pub on_map: bool,
}

/// One triangle, ready for the question whether it lies under a point and how high.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Triangle {
    a: Vec3,
    normal: Vec3,
    /// Inward unit normals of the edges; the first and the last pass through `a`.
    edge_ab: Vec2,
    edge_bc: Vec2,
    edge_ca: Vec2,
    /// `edge_bc · (p − a) + offset_bc` is the distance inside that edge.
    offset_bc: f32,
    /// dz/dx and dz/dy.
    gradient: Vec2,
    friction: f32,
}

const _: () = assert!(size_of::<Triangle>() == 64);

impl Triangle {
    fn new([a, b, c]: [Vec3; 3], friction: f32) -> Option<Triangle> {
        let normal = (b - a).cross(c - a).try_normalize()?;
        if normal.z < NORMAL_Z_MIN {
            return None;
        }
        // Counter-clockwise from above, so that the inside lies to the left of each edge.
        let inward = |from: Vec3, to: Vec3| (to - from).truncate().perp().try_normalize();
        let edge_bc = inward(b, c)?;
        Some(Triangle {
            a,
            normal,
            edge_ab: inward(a, b)?,
            edge_bc,
            edge_ca: inward(c, a)?,
            offset_bc: edge_bc.dot((a - b).truncate()),
            gradient: Vec2::new(-normal.x / normal.z, -normal.y / normal.z),
            friction,
        })
    }

    /// How far inside all three edges the point lies; negative outside.
    #[inline]
    fn inside(&self, from_a: Vec2) -> f32 {
        let bc = self.edge_bc.dot(from_a) + self.offset_bc;
        self.edge_ab.dot(from_a).min(self.edge_ca.dot(from_a)).min(bc)
    }

    #[inline]
    fn height(&self, from_a: Vec2) -> f32 {
        self.a.z + self.gradient.dot(from_a)
    }

    #[inline]
    fn hit(&self, height_m: f32) -> Hit {
        Hit { height_m, normal: self.normal, friction: self.friction, on_map: true }
    }
}

/// The ground of one map. Immutable.
pub struct Ground {
    triangles: Vec<Triangle>,
    /// Lower corner of the grid.
    origin: Vec2,
    blocks: [usize; 2],
    /// Number of each block among those with ground, or [`EMPTY`].
    block_numbers: Vec<u32>,
    /// Where each cell's list begins in `lists`; one more at the end.
    cell_starts: Vec<u32>,
    lists: Vec<u32>,
    /// In the same order: how much of its cell each triangle may cover.
    reaches: Vec<Reach>,
    tops: Tops,
    floor_m: f32,
}

impl Ground {
    /// Takes the upward-facing triangles of object 0 (roads, sidewalks, terrain).
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
        let origin = low.truncate() - 1.0;
        let extent = high.truncate() + 1.0 - origin;
        let edge_m = CELL_M * BLOCK_CELLS as f32;
        let blocks = [(extent.x / edge_m) as usize + 1, (extent.y / edge_m) as usize + 1];
        let mut ground = Ground {
            triangles,
            origin,
            blocks,
            block_numbers: vec![EMPTY; blocks[0] * blocks[1]],
            cell_starts: Vec::new(),
            lists: Vec::new(),
            reaches: Vec::new(),
            tops: Tops::default(),
            floor_m: low.z - FLOOR_DEPTH_M,
        };
        ground.fill(&corners);
        ground.tops = Tops::unknown(ground.lists.len());
        ground
    }

    /// A plane at `height_m`, 4 km wide: for tests and measurements.
    pub fn flat(height_m: f32) -> Ground {
        let mut mesh = mesh::Mesh::default();
        let face = mesh::Face::new(mesh::Tag::Roads, Material::Asphalt, 0);
        let corner = |x: f32, y: f32| [x * 2000.0, y * 2000.0, height_m];
        mesh.quad(
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            face,
        );
        Ground::new(&mesh)
    }

    /// Sorts the triangles into cells: counts, sums, then writes.
    fn fill(&mut self, corners: &[[Vec2; 3]]) {
        let mut numbered = 0;
        let mut counts: Vec<u32> = Vec::new();
        let cells_in_block = BLOCK_CELLS * BLOCK_CELLS;
        for (triangle, points) in self.triangles.iter().zip(corners) {
            for [x, y] in cells_under(self.origin, triangle, points) {
                let block = y / BLOCK_CELLS * self.blocks[0] + x / BLOCK_CELLS;
                if self.block_numbers[block] == EMPTY {
                    self.block_numbers[block] = numbered;
                    numbered += 1;
                    counts.resize(numbered as usize * cells_in_block, 0);
                }
                let cell = y % BLOCK_CELLS * BLOCK_CELLS + x % BLOCK_CELLS;
                counts[self.block_numbers[block] as usize * cells_in_block + cell] += 1;
            }
        }
        let mut total = 0;
        self.cell_starts = Vec::with_capacity(counts.len() + 1);
        for count in &counts {
            self.cell_starts.push(total);
            total += count;
        }
        self.cell_starts.push(total);
        self.lists = vec![0; total as usize];
        self.reaches = vec![Reach::default(); total as usize];
        let mut next = self.cell_starts.clone();
        for (index, (triangle, points)) in self.triangles.iter().zip(corners).enumerate() {
            let low = points[0].min(points[1]).min(points[2]) - 2.0 * SEAM_M;
            let high = points[0].max(points[1]).max(points[2]) + 2.0 * SEAM_M;
            for [x, y] in cells_under(self.origin, triangle, points) {
                let block = self.block_numbers[y / BLOCK_CELLS * self.blocks[0] + x / BLOCK_CELLS];
                let cell = y % BLOCK_CELLS * BLOCK_CELLS + x % BLOCK_CELLS;
                let at = &mut next[block as usize * cells_in_block + cell];
                self.lists[*at as usize] = index as u32;
                let cell = [x as u32, y as u32];
                self.reaches[*at as usize] = Reach::new(self.origin, cell, low, high);
                *at += 1;
            }
        }
    }

    /// How many triangles one can stand on.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Where the triangles of a cell stand in the lists.
    #[inline]
    fn range(&self, cell: [u32; 2]) -> std::ops::Range<usize> {
        let [cell_x, cell_y] = cell.map(|c| c as usize);
        let (block_x, block_y) = (cell_x / BLOCK_CELLS, cell_y / BLOCK_CELLS);
        if block_x >= self.blocks[0] || block_y >= self.blocks[1] {
            return 0..0;
        }
        let block = self.block_numbers[block_y * self.blocks[0] + block_x];
        if block == EMPTY {
            return 0..0;
        }
        let cell = block as usize * (BLOCK_CELLS * BLOCK_CELLS)
            + cell_y % BLOCK_CELLS * BLOCK_CELLS
            + cell_x % BLOCK_CELLS;
        self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize
    }

    /// The highest surface at or below `z_from`.
    ///
    /// If there is none, the lowest one within 2.5 m above (a wheel that a step has swallowed
    /// comes up again); else the floor under the map.
    #[inline]
    pub fn below(&self, x: f32, y: f32, z_from: f32) -> Hit {
        let point = Vec2::new(x, y);
        let Some(seat) = Seat::of(self.origin, point) else { return self.floor() };
        let (height_m, entry) = self.find(&seat, point, z_from);
        if entry == EMPTY {
            return self.floor();
        }
        self.triangles[self.lists[entry as usize] as usize].hit(height_m)
    }

    /// The height of that surface, and which entry of the lists it is; [`EMPTY`] for the floor.
    #[inline]
    fn find(&self, seat: &Seat, point: Vec2, z_from: f32) -> (f32, u32) {
        let range = self.range(seat.cell);
        let mut below = (f32::NEG_INFINITY, EMPTY);
        let mut above = (z_from + RESCUE_M, EMPTY);
        let first = range.start as u32;
        for (entry, reach) in (first..).zip(&self.reaches[range]) {
            if !reach.covers(seat) {
                continue;
            }
            let triangle = &self.triangles[self.lists[entry as usize] as usize];
            let from_a = point - triangle.a.truncate();
            if triangle.inside(from_a) < -SEAM_M {
                continue;
            }
            let height = triangle.height(from_a);
            if height <= z_from {
                if height > below.0 {
                    below = (height, entry);
                }
            } else if height < above.0 {
                above = (height, entry);
            }
        }
        if below.1 != EMPTY { below } else { above }
    }

    fn floor(&self) -> Hit {
        Hit { height_m: self.floor_m, normal: Vec3::Z, friction: 0.6, on_map: false }
    }
}

/// Every cell that the triangle touches, with the seam's margin.
fn cells_under<'a>(
    origin: Vec2,
    triangle: &'a Triangle,
    points: &[Vec2; 3],
) -> impl Iterator<Item = [usize; 2]> + use<'a> {
    let low = points[0].min(points[1]).min(points[2]) - 2.0 * SEAM_M - origin;
    let high = points[0].max(points[1]).max(points[2]) + 2.0 * SEAM_M - origin;
    let cell = |m: f32| (m / CELL_M) as usize;
    let half = CELL_M / 2.0;
    let points = points.map(|p| p - origin);
    (cell(low.y)..=cell(high.y)).flat_map(move |y| {
        let (from, to) = reach_in_row(&points, y as f32 * CELL_M);
        // A long slanting triangle touches few of the cells in its bounding box.
        let columns = cell(from.max(low.x))..=cell(to.min(high.x).max(0.0));
        columns.filter_map(move |x| {
            let center = origin + (Vec2::new(x as f32, y as f32) + 0.5) * CELL_M;
            let from_a = center - triangle.a.truncate();
            // The cell lies wholly outside an edge if even its nearest corner does.
            let reach = |edge: Vec2| half * (edge.x.abs() + edge.y.abs()) + 4.0 * SEAM_M;
            let touches = triangle.edge_ab.dot(from_a) >= -reach(triangle.edge_ab)
                && triangle.edge_bc.dot(from_a) + triangle.offset_bc >= -reach(triangle.edge_bc)
                && triangle.edge_ca.dot(from_a) >= -reach(triangle.edge_ca);
            touches.then_some([x, y])
        })
    })
}

/// From where to where along x the triangle lies in the row of cells that begins at `y`, with a
/// cell's margin.
fn reach_in_row(points: &[Vec2; 3], y: f32) -> (f32, f32) {
    let (low, high) = (y - CELL_M, y + 2.0 * CELL_M);
    let mut reach = (f32::INFINITY, f32::NEG_INFINITY);
    for index in 0..3 {
        let (a, b) = (points[index], points[(index + 1) % 3]);
        if a.y.max(b.y) < low || a.y.min(b.y) > high {
            continue;
        }
        // The part of the edge between the two lines.
        let along = |line: f32| ((line - a.y) / (b.y - a.y)).clamp(0.0, 1.0);
        let ends = if a.y == b.y { [0.0, 1.0] } else { [along(low), along(high)] };
        for share in ends {
            let x = a.x + (b.x - a.x) * share;
            reach = (reach.0.min(x - CELL_M), reach.1.max(x + CELL_M));
        }
    }
    reach
}

/// Factor on a tyre's grip: dry asphalt is 1. After the tables of Wong, Theory of Ground Vehicles.
fn friction_of(material: u8) -> f32 {
    match Material::from_code(material) {
        Some(Material::Asphalt | Material::Concrete) => 1.0,
        Some(Material::Paving | Material::Kerb | Material::FacadeConcrete) => 0.95,
        Some(Material::PaintWhite | Material::PaintYellow) => 0.9,
        Some(Material::Soil) => 0.65,
        Some(Material::Grass) => 0.55,
        Some(Material::Metal) => 0.5,
        Some(Material::Water) => 0.4,
        _ => 0.8,
    }
}
