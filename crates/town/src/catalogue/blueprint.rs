//! What an actor is made from: sizes, masses, wheels.

use std::sync::OnceLock;

use glam::Vec3;
use mesh::Tag;

use super::{geometry::Geometry, mesh_source::MeshSource, rig::Rig};

/// The kind of actor that a blueprint makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A vehicle with wheels and a driver.
    Vehicle,
    /// A pedestrian.
    Walker,
    /// A static prop.
    Prop,
    /// The lamp box of a traffic light.
    TrafficLight,
}

/// A wheel of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// The middle of the hub at rest, in actor space. Metres.
    pub position_m: Vec3,
    /// The radius of the loaded tyre. Metres.
    pub radius_m: f32,
    /// The width of the tyre. Metres.
    pub width_m: f32,
    /// Whether the steering turns it.
    pub steered: bool,
    /// Whether the engine drives it.
    pub driven: bool,
}

/// A blueprint: what an actor is made from.
///
/// Actor space: the origin lies on the ground below the middle of the wheelbase (of the feet of a
/// walker, of the base of a prop), x forward, y left, z up.
#[derive(Debug)]
pub struct Blueprint {
    /// CARLA's id, such as `vehicle.tesla.model3`.
    pub id: &'static str,
    /// The kind of actor.
    pub kind: Kind,
    /// The semantic tag of the actor; riders and glass may have tags of their own.
    pub tag: Tag,
    /// How a vehicle is built: car, truck, van, bus, motorcycle, bicycle; empty for other actors.
    pub base_type: &'static str,
    /// CARLA's `special_type`: emergency, taxi, electric; empty for most vehicles.
    pub special_type: &'static str,
    /// CARLA's `generation`: 1 or 2.
    pub generation: u8,
    /// Half of length, width (with mirrors) and height, with closed doors and hanging arms. Metres.
    pub half_extents_m: Vec3,
    /// The middle of the bounding box, in actor space. Metres.
    pub center_m: Vec3,
    /// Front left, front right, rear left, rear right; front, rear on two wheels; otherwise empty.
    pub wheels: Vec<Wheel>,
    /// The mass, ready to drive. Kilograms.
    pub mass_kg: f32,
    /// The distance between the axles; 0 without wheels. Metres.
    pub wheelbase_m: f32,
    /// The default colour of the paint, sRGB.
    pub default_color: [u8; 3],
    pub(super) mesh_source: MeshSource,
    pub(super) rig: OnceLock<Rig>,
    pub(super) geometry: OnceLock<Geometry>,
}

impl Blueprint {
    /// Returns a blueprint without size, mass and wheels.
    pub(super) fn new(
        id: &'static str,
        kind: Kind,
        tag: Tag,
        mesh_source: MeshSource,
    ) -> Blueprint {
        Blueprint {
            id,
            kind,
            tag,
            base_type: "",
            special_type: "",
            generation: 1,
            half_extents_m: Vec3::ZERO,
            center_m: Vec3::ZERO,
            wheels: Vec::new(),
            mass_kg: 0.0,
            wheelbase_m: 0.0,
            default_color: [128; 3],
            mesh_source,
            rig: OnceLock::new(),
            geometry: OnceLock::new(),
        }
    }

    /// Returns whether a vehicle pushes the actor aside: a prop of at most 50 kg. Heavier ones are
    /// fixed to the ground or as good as that.
    pub fn is_light(&self) -> bool {
        const LIGHT_KG: f32 = 50.0;
        self.kind == Kind::Prop && self.mass_kg <= LIGHT_KG
    }

    /// Returns whether vehicles drive over the actor as if it were not there: a prop that is lower
    /// than the ground clearance of a car, or soft, as bags, litter and heaps of earth are.
    pub fn is_passable(&self) -> bool {
        const CLEARANCE_M: f32 = 0.101;
        const SOFT: [&str; 6] =
            ["dirtdebris", "garbage", "plasticbag", "purse", "shoppingbag", "trashbag"];
        let is_soft = || {
            let name = self.id.strip_prefix("static.prop.");
            name.is_some_and(|name| SOFT.iter().any(|soft| name.starts_with(soft)))
        };
        self.kind == Kind::Prop && (2.0 * self.half_extents_m.z < CLEARANCE_M || is_soft())
    }
}
