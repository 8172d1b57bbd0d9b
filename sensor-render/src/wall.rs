use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use mesh::Material;
use rayon::prelude::*;

use crate::triangle::Triangle;

/// Plane part of a façade, on which windows are laid out and which weathers from its top and its foot:
/// horizontal begin, width, height of its foot, and height of the wall. Metres.
///
/// Horizontal positions are measured from the world's origin along the direction (−y, x) of the
/// outward normal.
#[derive(Clone, Copy, Debug, Pod, Zeroable, PartialEq)]
#[repr(transparent)]
pub(crate) struct Wall(pub(crate) [f32; 4]);

impl Wall {
    /// Wall without size: anything that is not a façade.
    pub(crate) const NONE: Wall = Wall([0.0; 4]);
}

/// Plane of a wall: object, quantized x and y of its outward normal, and quantized distance.
type Key = (u32, i32, i32, i32);

/// Finds the walls of façades, appends them to `walls` and writes each triangle's wall
/// index.
pub(crate) fn find_walls(triangles: &mut [Triangle], walls: &mut Vec<Wall>) {
    let found = |(at, triangle): (usize, &Triangle)| {
        let (key, along) = key(triangle)?;
        let corner = Vec3::from(triangle.corner);
        let mut extent = NOTHING;
        for offset in [Vec3::ZERO, Vec3::from(triangle.edge1), Vec3::from(triangle.edge2)] {
            let at = corner + offset;
            extent = united(extent, [at.dot(along), at.dot(along), at.z, at.z]);
        }
        Some((key, at as u32, extent))
    };
    let mut sides: Vec<_> = triangles.par_iter().enumerate().filter_map(found).collect();
    sides.par_sort_unstable_by_key(|side| (side.0, side.1));
    for wall in sides.chunk_by(|a, b| a.0 == b.0) {
        let [left, right, low, high] = wall.iter().fold(NOTHING, |sum, side| united(sum, side.2));
        for (_, at, _) in wall {
            triangles[*at as usize].wall = walls.len() as u32;
        }
        walls.push(Wall([left, right - left, low, high - low]));
    }
}

/// Empty extent: lowest and highest horizontal position, lowest and highest z.
const NOTHING: [f32; 4] = [f32::MAX, f32::MIN, f32::MAX, f32::MIN];

fn united(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

/// Returns the plane of a triangle that is part of an upright façade, and the horizontal direction in it.
/// Gables without a colour of their own return `None`, since windows in their corners would be cut off.
fn key(triangle: &Triangle) -> Option<(Key, Vec3)> {
    const FACADES: [u8; 4] = [
        Material::FacadeBrick as u8,
        Material::FacadePlaster as u8,
        Material::FacadeGlass as u8,
        Material::FacadeConcrete as u8,
    ];
    if !FACADES.contains(&triangle.material()) {
        return None;
    }
    let [edge1, edge2] = [triangle.edge1, triangle.edge2].map(Vec3::from);
    let normal = edge1.cross(edge2).try_normalize()?;
    let upright = |edge: Vec3| edge.truncate().length() < 0.01 * edge.z.abs();
    // Façades in a colour of their own have windows of triangles.
    let has_windows = triangle.tint() == 0;
    let is_half = [edge1, edge2, edge2 - edge1].into_iter().any(upright);
    if normal.z.abs() > 0.01 || has_windows && !is_half {
        return None;
    }
    let along = Vec3::new(-normal.y, normal.x, 0.0).try_normalize()?;
    let step = |x: f32, per: f32| (x * per).round() as i32;
    let offset = normal.dot(Vec3::from(triangle.corner));
    Some(((triangle.object, step(normal.x, 50.0), step(normal.y, 50.0), step(offset, 8.0)), along))
}
