use glam::{Quat, Vec3, vec3};
use mesh::{Material, Mesh, Tag};

use crate::{
    catalogue::Blueprint,
    mesh_builder::MeshBuilder,
    plants::models,
    static_world::{Collider, Head, Lamp, Layer, Object, Parked, Plant, Town},
};

/// The town while it is built.
pub(super) struct Scene {
    builder: MeshBuilder,
    town: Town,
}

/// The properties of an object that do not depend on its mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectProperties {
    pub(super) tag: Tag,
    pub(super) layer: Layer,
    pub(super) color: [u8; 3],
}

/// The pose of an object: the origin of its own space, and the bearing of its x axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) foot: Vec3,
    pub(super) yaw_rad: f32,
}

impl Place {
    /// Transforms a point from the object's space to world space.
    pub(super) fn point(&self, local: Vec3) -> Vec3 {
        self.foot + Quat::from_rotation_z(self.yaw_rad) * local
    }
}

impl Scene {
    /// Starts a town on roads and terrain.
    pub(super) fn new(ground: Mesh) -> Scene {
        let mut builder = MeshBuilder::new(Tag::Static, Material::Concrete, 0);
        builder.mesh = ground;
        // Incremental growth would copy a large mesh repeatedly.
        let more = builder.mesh.triangles.len() * 3;
        builder.mesh.positions.reserve(more);
        builder.mesh.triangles.reserve(more);
        builder.mesh.faces.reserve(more);
        Scene { builder, town: Town::default() }
    }

    /// Adds an object that `model` builds in its own space; returns its index and its box.
    pub(super) fn add(
        &mut self,
        properties: ObjectProperties,
        place: Place,
        model: impl FnOnce(&mut MeshBuilder),
    ) -> (u32, Object) {
        let number = self.town.objects.len() as u32;
        let first = self.builder.mesh.positions.len();
        self.builder.object(number + 1).paint(properties.tag, Material::Concrete);
        model(&mut self.builder);
        let (sin, cos) = place.yaw_rad.sin_cos();
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for position in &mut self.builder.mesh.positions[first..] {
            let local = Vec3::from_array(*position);
            (low, high) = (low.min(local), high.max(local));
            let turned =
                vec3(local.x * cos - local.y * sin, local.x * sin + local.y * cos, local.z);
            *position = (place.foot + turned).to_array();
        }
        let object = Object {
            tag: properties.tag,
            layer: properties.layer,
            center: place.point((low + high) * 0.5),
            half_extents_m: (high - low) * 0.5,
            yaw_rad: place.yaw_rad,
            color: properties.color,
        };
        self.town.objects.push(object);
        (number, object)
    }

    /// Adds an object with a finished mesh, and its solid parts. World space.
    pub(super) fn adopt(
        &mut self,
        object: Object,
        mesh: &Mesh,
        solids: impl Iterator<Item = Collider>,
    ) {
        let number = self.town.objects.len() as u32;
        self.town.objects.push(object);
        let first = self.builder.mesh.faces.len();
        self.builder.mesh.append(mesh);
        for face in &mut self.builder.mesh.faces[first..] {
            face.object = number + 1;
        }
        self.town.colliders.extend(solids.map(|solid| Collider { object: number, ..solid }));
    }

    /// Adds a mesh to the ground. World space.
    pub(super) fn lay(&mut self, mesh: &Mesh) {
        self.builder.mesh.append(mesh);
    }

    /// Adds a quadrilateral of ground, counter-clockwise seen from above. World space.
    pub(super) fn ground(&mut self, material: Material, corners: [Vec3; 4]) {
        self.builder.object(0).paint(Tag::Ground, material).quad(corners);
    }

    /// Parks a vehicle permanently; its origin is the foot of the place.
    pub(super) fn park(
        &mut self,
        number: u32,
        vehicle: &Blueprint,
        place: Place,
        rotation: Quat,
        color: [u8; 3],
    ) {
        let (center, half) = (vehicle.center_m, vehicle.half_extents_m);
        self.town.parked.push(Parked {
            blueprint: number,
            object: self.town.objects.len() as u32,
            position: place.foot,
            rotation: rotation.to_array(),
        });
        self.town.objects.push(Object {
            tag: vehicle.tag,
            layer: Layer::ParkedVehicles,
            center: place.foot + rotation * center,
            half_extents_m: half,
            yaw_rad: place.yaw_rad,
            color,
        });
        self.solid(&place, center - half, center + half);
    }

    /// Plants a model of [`models`] as an object.
    pub(super) fn plant(
        &mut self,
        properties: ObjectProperties,
        place: Place,
        model: u32,
        scale: f32,
    ) {
        let (low, high) = models()[model as usize].bounds();
        self.town.plants.push(Plant {
            model,
            object: self.town.objects.len() as u32,
            position: place.foot,
            yaw_rad: place.yaw_rad,
            scale,
        });
        self.town.objects.push(Object {
            tag: properties.tag,
            layer: properties.layer,
            center: place.point((low + high) * (0.5 * scale)),
            half_extents_m: (high - low) * (0.5 * scale),
            yaw_rad: place.yaw_rad,
            color: properties.color,
        });
    }

    /// Adds a solid box to the newest object, in the object's space.
    pub(super) fn solid(&mut self, place: &Place, low: Vec3, high: Vec3) {
        self.town.colliders.push(Collider {
            center: place.point((low + high) * 0.5),
            half_extents_m: (high - low) * 0.5,
            yaw_rad: place.yaw_rad,
            object: (self.town.objects.len() - 1) as u32,
        });
    }

    /// Adds a solid post to the newest object, from half a metre below its foot.
    pub(super) fn solid_post(&mut self, place: &Place, radius: f32, height: f32) {
        self.solid(place, vec3(-radius, -radius, -0.5), vec3(radius, radius, height));
    }

    pub(super) fn lamp(&mut self, lamp: Lamp) {
        self.town.lamps.push(lamp);
    }

    pub(super) fn head(&mut self, head: Head) {
        self.town.heads.push(head);
    }

    pub(super) fn finish(self) -> Town {
        Town { mesh: self.builder.mesh, ..self.town }
    }
}
