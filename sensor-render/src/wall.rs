use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use road::Material;

use crate::scene::Triangle;

/// One plane side of a building, on which windows are laid out: where it begins along itself,
/// how wide it is, its foot's height and how high it is. Metres.
///
/// "Along itself" counts from the world's origin in the direction (−y, x) of its outward normal.
#[derive(Clone, Copy, Debug, Pod, Zeroable, PartialEq)]
#[repr(transparent)]
pub(crate) struct Wall(pub(crate) [f32; 4]);

impl Wall {
    /// What is no wall, or too small for a window, has no size.
    pub(crate) const NONE: Wall = Wall([0.0; 4]);
}

/// A wall's plane: object, direction and distance of its outward normal, in steps.
type Key = (u32, i32, i32, i32);

/// Finds the walls that have windows, appends them to `walls` and writes each triangle's number.
pub(crate) fn find_walls(triangles: &mut [Triangle], walls: &mut Vec<Wall>) {
    let mut extents: BTreeMap<Key, [f32; 4]> = BTreeMap::new();
    for triangle in triangles.iter() {
        let Some((key, along)) = key(triangle) else { continue };
        let corner = Vec3::from(triangle.corner);
        let extent = extents.entry(key).or_insert([f32::MAX, f32::MIN, f32::MAX, f32::MIN]);
        for offset in [Vec3::ZERO, Vec3::from(triangle.edge1), Vec3::from(triangle.edge2)] {
            let at = corner + offset;
            let s = at.dot(along);
            *extent =
                [extent[0].min(s), extent[1].max(s), extent[2].min(at.z), extent[3].max(at.z)];
        }
    }
    let mut numbers = BTreeMap::new();
    for (key, [left, right, low, high]) in extents {
        numbers.insert(key, walls.len() as u32);
        walls.push(Wall([left, right - left, low, high - low]));
    }
    for triangle in triangles {
        if let Some((key, _)) = key(triangle) {
            triangle.wall = numbers[&key];
        }
    }
}

/// The plane of a triangle that is half an upright rectangle of a facade, and the direction along
/// it. Gables are none: a window in their corner would be cut.
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
    if normal.z.abs() > 0.01 || ![edge1, edge2, edge2 - edge1].into_iter().any(upright) {
        return None;
    }
    let along = Vec3::new(-normal.y, normal.x, 0.0).try_normalize()?;
    let step = |x: f32, per: f32| (x * per).round() as i32;
    let offset = normal.dot(Vec3::from(triangle.corner));
    Some(((triangle.object, step(normal.x, 50.0), step(normal.y, 50.0), step(offset, 8.0)), along))
}
