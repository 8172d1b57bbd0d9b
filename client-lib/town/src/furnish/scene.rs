use glam::{Mat2, Vec3, vec3};
use road::{Material, Mesh, Tag};

use super::{Collider, Head, Lamp, Layer, Object, Town};
use crate::clay::Clay;

/// The town so far.
pub(super) struct Scene {
    clay: Clay,
    town: Town,
}

/// What is known of an object before it is modelled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brief {
    pub(super) tag: Tag,
    pub(super) layer: Layer,
    /// The turn of its box. Radians.
    pub(super) yaw_rad: f32,
    pub(super) color: [u8; 3],
}

impl Scene {
    /// On top of roads and terrain.
    pub(super) fn new(ground: Mesh) -> Scene {
        let mut clay = Clay::new(Tag::Static, Material::Concrete, 0);
        clay.mesh = ground;
        Scene { clay, town: Town::default() }
    }

    /// Adds what `model` makes, in world space; says its index and its box.
    pub(super) fn add(&mut self, brief: Brief, model: impl FnOnce(&mut Clay)) -> (u32, Object) {
        let first = self.clay.mesh.positions.len();
        self.clay.object(self.town.objects.len() as u32 + 1).paint(brief.tag, Material::Concrete);
        model(&mut self.clay);
        let turn = Mat2::from_angle(-brief.yaw_rad);
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for position in &self.clay.mesh.positions[first..] {
            let point = Vec3::from_array(*position);
            let point = (turn * point.truncate()).extend(point.z);
            (low, high) = (low.min(point), high.max(point));
        }
        let middle = (low + high) * 0.5;
        let object = Object {
            tag: brief.tag,
            layer: brief.layer,
            center: (turn.transpose() * middle.truncate()).extend(middle.z),
            half_extents_m: (high - low) * 0.5,
            yaw_rad: brief.yaw_rad,
            color: brief.color,
        };
        self.town.objects.push(object);
        (self.town.objects.len() as u32 - 1, object)
    }

    /// Makes an object's whole box solid.
    pub(super) fn solid(&mut self, object: &Object) {
        self.town.colliders.push(Collider {
            center: object.center,
            half_extents_m: object.half_extents_m,
            yaw_rad: object.yaw_rad,
        });
    }

    /// Makes a post of this radius solid, from its foot up.
    pub(super) fn solid_post(&mut self, foot: Vec3, radius: f32, height: f32) {
        self.town.colliders.push(Collider {
            center: foot + Vec3::Z * height * 0.5,
            half_extents_m: vec3(radius, radius, height * 0.5),
            yaw_rad: 0.0,
        });
    }

    pub(super) fn lamp(&mut self, lamp: Lamp) {
        self.town.lamps.push(lamp);
    }

    pub(super) fn head(&mut self, head: Head) {
        self.town.heads.push(head);
    }

    pub(super) fn finish(self) -> Town {
        Town { mesh: self.clay.mesh, ..self.town }
    }
}
