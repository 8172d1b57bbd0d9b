//! One triangle of the ground, prepared for vertical queries.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use mesh::Material;

/// A point this far outside a triangle still counts as on it, so that a wheel does not fall through
/// the seam between two triangles.
pub(super) const SEAM_M: f32 = 1e-3;
/// Steeper faces (sides of kerb stones, walls) are not ground.
const NORMAL_Z_MIN: f32 = 0.2;

/// The result of a query for the ground under a point, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Height of the surface at the x and y of the query.
    pub height_m: f32,
    /// Unit normal of the surface, upwards.
    pub normal: Vec3,
    /// Factor on the grip of a tyre; 1 is dry asphalt.
    pub friction: f32,
    /// Whether the surface belongs to the map; otherwise it is the flat floor below the map.
    pub on_map: bool,
}

/// A triangle with what a vertical query needs: whether a point lies on it, and at which height.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Triangle {
    /// One corner, in world space.
    pub a: Vec3,
    /// Unit normal, upwards.
    pub normal: Vec3,
    /// Inward unit normals of the edges; the first and the last pass through `a`.
    pub edge_ab: Vec2,
    pub edge_bc: Vec2,
    pub edge_ca: Vec2,
    /// `edge_bc · (p − a) + offset_bc` is the distance inside that edge.
    pub offset_bc: f32,
    /// dz/dx and dz/dy.
    pub gradient: Vec2,
    /// Factor on the grip of a tyre.
    pub friction: f32,
}

const _: () = assert!(size_of::<Triangle>() == 64);

impl Triangle {
    /// Returns a triangle, or `None` if it is degenerate or too steep to stand on.
    pub(super) fn new([a, b, c]: [Vec3; 3], friction: f32) -> Option<Triangle> {
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

    /// Returns the distance from the nearest edge to a point, negative outside. Metres.
    #[inline]
    pub(super) fn inside(&self, from_a: Vec2) -> f32 {
        let bc = self.edge_bc.dot(from_a) + self.offset_bc;
        self.edge_ab.dot(from_a).min(self.edge_ca.dot(from_a)).min(bc)
    }

    /// Returns the height of the triangle's plane at a point. Metres, in world space.
    #[inline]
    pub(super) fn height(&self, from_a: Vec2) -> f32 {
        self.a.z + self.gradient.dot(from_a)
    }

    /// Returns the result of a query that found this triangle at a height.
    #[inline]
    pub(super) fn hit(&self, height_m: f32) -> Hit {
        Hit { height_m, normal: self.normal, friction: self.friction, on_map: true }
    }
}

/// Returns the factor of a material on the grip of a tyre; dry asphalt has 1. After the tables of
/// Wong, Theory of Ground Vehicles.
pub(super) fn friction_of(material: u8) -> f32 {
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
