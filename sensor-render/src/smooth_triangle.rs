use glam::Vec3;

use crate::hit::NONE;
use crate::scene::Scene;
use crate::smooth::{LEAF, unpacked};
use crate::world::World;

/// What the normal of a triangle of an actor or a plant is, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Normals {
    /// Everywhere the same, of unit length.
    Leaf(Vec3),
    /// Between those at the corners.
    Corners(SmoothTriangle),
}

/// Plane coordinates and normals of a triangle of an actor, in world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SmoothTriangle {
    /// `for_u · (point − corner)` is the barycentric coordinate of the second corner, `for_v` that of the
    /// third.
    pub(crate) corner: Vec3,
    pub(crate) for_u: Vec3,
    pub(crate) for_v: Vec3,
    /// Normals at the corners, not of unit length.
    pub(crate) normals: [Vec3; 3],
}

impl Normals {
    /// Returns those of a triangle of a blueprint or of a plant; `None` for those of the town, which are flat.
    #[inline]
    pub(crate) fn of(scene: &Scene, world: &World, triangle: u32, instance: u32) -> Option<Self> {
        if instance == NONE {
            return None;
        }
        let words = scene.smooth.get(triangle.checked_sub(scene.smooth_from)? as usize)?;
        let [x, y, z] = world.instances[instance as usize].actor_from_world;
        let rows = [x, y, z].map(|row| Vec3::new(row[0], row[1], row[2]));
        let to_world = |v: Vec3| rows[0] * v.x + rows[1] * v.y + rows[2] * v.z;
        let to_unit = |word: u32| {
            let normal = unpacked(word);
            to_world(normal * (1.0 / normal.length_squared().max(1e-12).sqrt()))
        };
        if words[3] == LEAF {
            let normal = to_unit(words[0]);
            return Some(Normals::Leaf(normal * (1.0 / normal.length_squared().max(1e-12).sqrt())));
        }
        let triangle = &scene.triangles[triangle as usize];
        let shift = Vec3::new(x[3], y[3], z[3]);
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let (d11, d12, d22) = (edge1.dot(edge1), edge1.dot(edge2), edge2.dot(edge2));
        let inverse = 1.0 / (d11 * d22 - d12 * d12).max(1e-20);
        // Plants have a scale, by which the transpose of the rows is not their inverse.
        let inverse_square = rows[0].length_squared().max(1e-12);
        Some(Normals::Corners(SmoothTriangle {
            corner: to_world(corner - shift) / inverse_square,
            for_u: to_world((edge1 * d22 - edge2 * d12) * inverse),
            for_v: to_world((edge2 * d11 - edge1 * d12) * inverse),
            normals: [0, 1, 2].map(|at| to_unit(words[at])),
        }))
    }
}
