//! The static world: ground, objects, colliders, lamps.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Quat, Vec3};
use mesh::{Mesh, Tag};

/// The level of detail of trees and buildings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// For maps of whole cities: about a third of the triangles of [`Detail::Standard`].
    Low,
    /// The default.
    Standard,
    /// Buildings of about three times the triangles of [`Detail::Standard`], and fine trees far from
    /// roads too.
    High,
}

/// The layer of an object: CARLA's map layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// Buildings.
    Buildings,
    /// Trees, bushes and hedges.
    Foliage,
    /// Parked cars.
    ParkedVehicles,
    /// Benches, bins, signs and signals.
    Props,
    /// Street lights.
    StreetLights,
    /// Walls and fences.
    Walls,
}

impl Layer {
    /// The layer as a mask with one bit: its place in [`Layer::ALL`].
    pub fn bit(self) -> u32 {
        1 << self as u32
    }

    /// The name of the layer on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Buildings => "buildings",
            Layer::Foliage => "foliage",
            Layer::ParkedVehicles => "parked-vehicles",
            Layer::Props => "props",
            Layer::StreetLights => "street-lights",
            Layer::Walls => "walls",
        }
    }

    /// Every layer, in the order of their bits.
    pub const ALL: [Layer; 6] = [
        Layer::Buildings,
        Layer::Foliage,
        Layer::ParkedVehicles,
        Layer::Props,
        Layer::StreetLights,
        Layer::Walls,
    ];
}

/// The static world around a road network.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Town {
    /// All static triangles but those of plants: roads, terrain, buildings. `Face.object` is 0 on
    /// roads and ground, otherwise one more than the index in `objects`.
    pub mesh: Mesh,
    /// All objects on the ground.
    pub objects: Vec<Object>,
    /// Solid boxes: walls, trunks, poles.
    pub colliders: Vec<Collider>,
    /// The lights of street lamps.
    pub lamps: Vec<Lamp>,
    /// Parked cars. They are not part of `mesh`.
    pub parked: Vec<Parked>,
    /// Trees and bushes. They are not part of `mesh`, except in towns of low detail.
    pub plants: Vec<Plant>,
    /// The positions of traffic light boxes, for actors of `traffic.traffic_light`.
    pub heads: Vec<Head>,
}

impl Town {
    /// Returns the part that decides physics: roads and ground of the mesh, solid boxes, lamps and
    /// heads of traffic lights. Objects keep their numbers; their triangles, parked cars and plants are
    /// left out.
    pub fn without_scenery(&self) -> Town {
        let mut mesh = Mesh::default();
        let mut renumbered = vec![u32::MAX; self.mesh.positions.len()];
        let ground = self.mesh.triangles.iter().zip(&self.mesh.faces);
        for (triangle, face) in ground.filter(|(_, face)| face.object == 0) {
            let corner = |corner: u32| {
                let number = &mut renumbered[corner as usize];
                if *number == u32::MAX {
                    *number = mesh.positions.len() as u32;
                    mesh.positions.push(self.mesh.positions[corner as usize]);
                }
                *number
            };
            mesh.triangles.push(triangle.map(corner));
            mesh.faces.push(*face);
        }
        Town {
            mesh,
            objects: self.objects.clone(),
            colliders: self.colliders.clone(),
            lamps: self.lamps.clone(),
            parked: Vec::new(),
            plants: Vec::new(),
            heads: self.heads.clone(),
        }
    }
}

/// A static object. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// The semantic tag of the object; its poles may have a tag of their own.
    pub tag: Tag,
    /// The layer that hides it.
    pub layer: Layer,
    /// The middle of its bounding box.
    pub center: Vec3,
    /// Half the size of the box along its own x, y and z.
    pub half_extents_m: Vec3,
    /// The rotation of the box about z.
    pub yaw_rad: f32,
    /// The colour of `Material::CarPaint` on it, sRGB.
    pub color: [u8; 3],
}

/// A solid box. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Collider {
    /// The middle.
    pub center: Vec3,
    /// Half the size along its own x, y and z.
    pub half_extents_m: Vec3,
    /// The rotation about z.
    pub yaw_rad: f32,
    /// The index of its object in [`Town::objects`].
    pub object: u32,
}

/// The light of a street lamp. World space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Lamp {
    /// The position of the light source; it shines downwards.
    pub position: Vec3,
    /// The index of its object in [`Town::objects`].
    pub object: u32,
}

/// The position of a traffic light's lamp box. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Head {
    /// The index of its signal in [`road::Network::signals`].
    pub signal: u32,
    /// The actor's origin: the middle of the lower edge of the box, at its back.
    pub position: Vec3,
    /// The bearing that the lamps face.
    pub yaw_rad: f32,
}

/// A parked vehicle, with the mesh of its blueprint. World space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Parked {
    /// The index in [`crate::catalogue()`].
    pub blueprint: u32,
    /// The index of its object in [`Town::objects`], which has the paint colour.
    pub object: u32,
    /// The position of the blueprint's origin.
    pub position: Vec3,
    /// `world_from_actor` as a quaternion: x, y, z, w.
    pub rotation: [f32; 4],
}

/// A tree or a bush, with a mesh that it shares with others. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Plant {
    /// The model; see [`crate::plant_mesh`].
    pub model: u32,
    /// The index of its object in [`Town::objects`].
    pub object: u32,
    /// The position of the model's origin.
    pub position: Vec3,
    /// The rotation about z.
    pub yaw_rad: f32,
    /// The size relative to that of the model.
    pub scale: f32,
}

impl Plant {
    /// Returns the transform from the space of the model to world space.
    pub fn world_from_model(&self) -> Affine3A {
        let turn = Quat::from_rotation_z(self.yaw_rad);
        Affine3A::from_scale_rotation_translation(Vec3::splat(self.scale), turn, self.position)
    }
}
