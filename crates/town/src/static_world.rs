//! What a town is made of.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use mesh::{Mesh, Tag};

/// How finely trees and houses are modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detail {
    /// For maps as large as whole cities: about a third of the triangles of the standard.
    Low,
    /// For everyday work.
    Standard,
    /// About three times as many triangles.
    High,
}

/// What an object belongs to; CARLA's map layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// Houses.
    Buildings,
    /// Trees, bushes, hedges.
    Foliage,
    /// Cars that never move.
    ParkedVehicles,
    /// Benches, bins, signs and signals.
    Props,
    /// Street lamps.
    StreetLights,
    /// Walls and fences.
    Walls,
}

impl Layer {
    /// As a mask for [`crate::Visibility::set_layers`].
    pub fn bit(self) -> u32 {
        1 << self as u32
    }

    /// The word for it in commands.
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

    /// Every layer, in this order.
    pub const ALL: [Layer; 6] = [
        Layer::Buildings,
        Layer::Foliage,
        Layer::ParkedVehicles,
        Layer::Props,
        Layer::StreetLights,
        Layer::Walls,
    ];
}

/// The static world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Town {
    /// Every static triangle: roads, terrain, buildings, trees. `Face.object` is 0 on roads and
    /// ground, else one more than the index into `objects`.
    pub mesh: Mesh,
    /// All that stands on the ground.
    pub objects: Vec<Object>,
    /// Solid boxes: walls, trunks, poles.
    pub colliders: Vec<Collider>,
    /// What shines at night.
    pub lamps: Vec<Lamp>,
    /// Cars that never move. They are not in `mesh`.
    pub parked: Vec<Parked>,
    /// Where lamp boxes of traffic lights hang, for actors of `traffic.traffic_light`.
    pub heads: Vec<Head>,
}

/// A static thing. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// What a semantic camera calls it; its poles may carry a tag of their own.
    pub tag: Tag,
    /// What it can be switched off with.
    pub layer: Layer,
    /// The middle of its box.
    pub center: Vec3,
    /// Half the box's size along its own x, y and z.
    pub half_extents_m: Vec3,
    /// The box's turn about z.
    pub yaw_rad: f32,
    /// What `Material::CarPaint` means on it, sRGB.
    pub color: [u8; 3],
}

/// A solid box. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Collider {
    /// Its middle.
    pub center: Vec3,
    /// Half its size along its own x, y and z.
    pub half_extents_m: Vec3,
    /// Its turn about z.
    pub yaw_rad: f32,
    /// Which of [`Town::objects`] it belongs to.
    pub object: u32,
}

/// A street lamp's light. World space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Lamp {
    /// Where the light comes from; it falls downwards.
    pub position: Vec3,
    /// Which of [`Town::objects`].
    pub object: u32,
}

/// Where a lamp box of a traffic light hangs. World space, metres and radians.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Head {
    /// Which of [`road::Network::signals`] it shows.
    pub signal: u32,
    /// Of the actor's origin: the middle of the box's lower edge, at its back.
    pub position: Vec3,
    /// The lamps look along this bearing.
    pub yaw_rad: f32,
}

/// A vehicle that never moves, seen as its blueprint looks. World space, metres.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Parked {
    /// Index into [`crate::catalogue()`].
    pub blueprint: u32,
    /// Which of [`Town::objects`]; the paint is there.
    pub object: u32,
    /// Of the blueprint's origin.
    pub position: Vec3,
    /// `world_from_actor` as a quaternion: x, y, z, w.
    pub rotation: [f32; 4],
}
