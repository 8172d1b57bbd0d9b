//! The file: one Detour tile, version 7 with 32-bit references, in CARLA's set of tiles.
//!
//! Detour's x, y, z are CARLA's x, z, y: metres, y up. In these axes, our triangles, which are
//! counter-clockwise from above, have the winding that Detour requires.

use glam::{Vec3, vec3};

use walkable::{Cell, Cells};

const SET_MAGIC: i32 = i32::from_be_bytes(*b"MSET");
const SET_VERSION: i32 = 1;
const TILE_MAGIC: i32 = i32::from_be_bytes(*b"DNAV");
const TILE_VERSION: i32 = 7;
/// Neighbours are numbered in 15 bits.
const POLYS_MAX: usize = 0x7ffe;
/// Vertices are numbered in 16 bits.
const CORNERS_MAX: usize = 0xfffe;
/// No link.
const NONE: u16 = 0;

const WALKER_HEIGHT_M: f32 = 2.0;
const WALKER_RADIUS_M: f32 = 0.3;
/// The height of a kerb and a margin.
const WALKER_CLIMB_M: f32 = 0.5;

/// Returns the bytes of the file. Ground with more vertices than a tile can number is truncated.
pub(super) fn file(cells: &Cells) -> Vec<u8> {
    let last = cells.positions.len().min(CORNERS_MAX) as u32;
    let fits = |cell: &&Cell| cell.corners.iter().all(|corner| *corner < last);
    // Vertices are numbered in the order of the triangles, so those that fit are the first ones.
    let count = cells.triangles.iter().take_while(fits).count().min(POLYS_MAX);
    let tile = tile(&cells.positions, &cells.triangles[..count]);
    let (low, high) = bounds(cells);
    let mut out = Out::default();
    out.i32(SET_MAGIC).i32(SET_VERSION).i32(1);
    out.vec(low).f32(high.x - low.x).f32(high.z - low.z);
    out.i32(1).i32(count.next_power_of_two() as i32);
    out.u32(first_reference(count)).i32(tile.len() as i32);
    out.0.extend_from_slice(&tile);
    out.0
}

/// Returns the reference of the tile: a salt of 1 above the bits of its polygon indices.
fn first_reference(polys: usize) -> u32 {
    1 << polys.next_power_of_two().trailing_zeros()
}

fn point(place: glam::DVec3) -> Vec3 {
    vec3(place.x as f32, place.z as f32, -place.y as f32)
}

fn bounds(cells: &Cells) -> (Vec3, Vec3) {
    let low = cells.positions.iter().fold(Vec3::INFINITY, |low, at| low.min(point(*at)));
    let high = cells.positions.iter().fold(Vec3::NEG_INFINITY, |high, at| high.max(point(*at)));
    (low - Vec3::Y, high + Vec3::splat(0.01) + Vec3::Y)
}

fn tile(positions: &[glam::DVec3], triangles: &[Cell]) -> Vec<u8> {
    let used = triangles.iter().flat_map(|cell| cell.corners).max().map_or(0, |last| last + 1);
    let corners: Vec<Vec3> = positions[..used as usize].iter().map(|at| point(*at)).collect();
    let low = corners.iter().fold(Vec3::INFINITY, |low, at| low.min(*at)) - Vec3::Y;
    let high = corners.iter().fold(Vec3::NEG_INFINITY, |high, at| high.max(*at)) + Vec3::Y;
    let scale = 65_000.0 / (high - low).max_element();
    let nodes = tree(&corners, triangles, low, scale);
    let count = triangles.len() as i32;
    let mut out = Out::default();
    out.i32(TILE_MAGIC).i32(TILE_VERSION).i32(0).i32(0).i32(0).u32(0);
    out.i32(count).i32(corners.len() as i32);
    // Two links for every side: one is needed.
    out.i32(count * 6).i32(count).i32(0).i32(count);
    out.i32(nodes.len() as i32).i32(0).i32(count);
    out.f32(WALKER_HEIGHT_M).f32(WALKER_RADIUS_M).f32(WALKER_CLIMB_M);
    out.vec(low).vec(high).f32(scale);
    corners.iter().for_each(|corner| {
        out.vec(*corner);
    });
    for cell in triangles {
        out.u32(u32::MAX);
        for index in 0..6 {
            out.u16(cell.corners.get(index).map_or(0, |corner| *corner as u16));
        }
        for index in 0..6 {
            let neighbours = cell.neighbours.get(index).copied().flatten();
            let exists = |other: &u32| (*other as usize) < triangles.len();
            out.u16(neighbours.filter(exists).map_or(NONE, |other| other as u16 + 1));
        }
        out.u16(cell.area.flag()).u8(3).u8(cell.area as u8);
    }
    out.zeros(triangles.len() * 6 * 12);
    for index in 0..triangles.len() {
        // The detail mesh of a polygon is its own triangle.
        out.u32(0).u32(index as u32).u8(0).u8(1).u16(0);
    }
    for _ in triangles {
        // All three sides are sides of the polygon.
        out.u8(0).u8(1).u8(2).u8(0b01_0101);
    }
    for node in nodes {
        node.low.iter().chain(&node.high).for_each(|v| {
            out.u16(*v);
        });
        out.i32(node.index);
    }
    out.0
}

/// A node of the bounding volume tree, in depth-first order.
struct Node {
    low: [u16; 3],
    high: [u16; 3],
    /// The index of a polygon, or minus the number of nodes to skip.
    index: i32,
}

fn tree(corners: &[Vec3], triangles: &[Cell], low: Vec3, scale: f32) -> Vec<Node> {
    let quantised =
        |at: Vec3| ((at - low) * scale).to_array().map(|v| v.clamp(0.0, 65_534.0) as u16);
    let mut leaves: Vec<Node> = triangles
        .iter()
        .zip(0..)
        .map(|(cell, index)| {
            let [a, b, c] = cell.corners.map(|corner| corners[corner as usize]);
            let high = quantised(a.max(b).max(c)).map(|v| v + 1);
            Node { low: quantised(a.min(b).min(c)), high, index }
        })
        .collect();
    let mut nodes = Vec::with_capacity(2 * leaves.len());
    if !leaves.is_empty() {
        subdivide(&mut leaves, &mut nodes);
    }
    nodes
}

fn subdivide(leaves: &mut [Node], nodes: &mut Vec<Node>) {
    if let [leaf] = leaves {
        nodes.push(Node { ..*leaf });
        return;
    }
    let mut whole = Node { low: [u16::MAX; 3], high: [0; 3], index: 0 };
    for leaf in leaves.iter() {
        for axis in 0..3 {
            whole.low[axis] = whole.low[axis].min(leaf.low[axis]);
            whole.high[axis] = whole.high[axis].max(leaf.high[axis]);
        }
    }
    let axis = (0..3).max_by_key(|axis| whole.high[*axis] - whole.low[*axis]).unwrap_or(0);
    leaves.sort_by_key(|leaf| (leaf.low[axis], leaf.index));
    let at = nodes.len();
    nodes.push(whole);
    let (front, back) = leaves.split_at_mut(leaves.len() / 2);
    subdivide(front, nodes);
    subdivide(back, nodes);
    nodes[at].index = -((nodes.len() - at) as i32);
}

/// Little-endian bytes that are being written.
#[derive(Default)]
struct Out(Vec<u8>);

impl Out {
    fn u8(&mut self, value: u8) -> &mut Out {
        self.0.push(value);
        self
    }

    fn u16(&mut self, value: u16) -> &mut Out {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Out {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn i32(&mut self, value: i32) -> &mut Out {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn f32(&mut self, value: f32) -> &mut Out {
        self.0.extend_from_slice(&value.to_le_bytes());
        self
    }

    fn vec(&mut self, value: Vec3) -> &mut Out {
        self.f32(value.x).f32(value.y).f32(value.z)
    }

    fn zeros(&mut self, count: usize) -> &mut Out {
        self.0.resize(self.0.len() + count, 0);
        self
    }
}
