//! What an actor is made from.

use std::sync::OnceLock;

use glam::Vec3;
use mesh::Tag;

use super::{looks::Looks, recipe::Recipe, rig::Rig};

/// What kind of thing a blueprint makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Something with wheels and a driver.
    Vehicle,
    /// Someone on foot.
    Walker,
    /// Anything that just stands there.
    Prop,
    /// The lamp box of a traffic light.
    TrafficLight,
}

/// A wheel of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// The hub's middle at rest, in actor space. Metres.
    pub position_m: Vec3,
    /// Of the loaded tyre. Metres.
    pub radius_m: f32,
    /// Of the tyre. Metres.
    pub width_m: f32,
    /// The steering turns it.
    pub steered: bool,
    /// The engine turns it.
    pub driven: bool,
}

/// What an actor is made from.
///
/// Actor space: the origin lies on the ground below the middle of the wheelbase (of the feet, of
/// the base), x forward, y left, z up.
#[derive(Debug)]
pub struct Blueprint {
    /// CARLA's id, such as `vehicle.tesla.model3`.
    pub id: &'static str,
    /// What it makes.
    pub kind: Kind,
    /// What a semantic camera calls it; riders and glass may carry a tag of their own.
    pub tag: Tag,
    /// CARLA's `base_type`: car, truck, van, bus, motorcycle, bicycle; empty for what has none.
    pub base_type: &'static str,
    /// CARLA's `special_type`: emergency, taxi, electric; empty for most.
    pub special_type: &'static str,
    /// CARLA's `generation`: 1 or 2.
    pub generation: u8,
    /// Half of length, width (mirrors included) and height, doors shut and arms at rest. Metres.
    pub half_extents_m: Vec3,
    /// The middle of the box, in actor space. Metres.
    pub center_m: Vec3,
    /// Front left, front right, rear left, rear right; front, rear on two wheels; else none.
    pub wheels: Vec<Wheel>,
    /// Ready to drive. Kilograms.
    pub mass_kg: f32,
    /// Between the axles; 0 without wheels. Metres.
    pub wheelbase_m: f32,
    /// Of the paint, sRGB.
    pub default_color: [u8; 3],
    pub(super) recipe: Recipe,
    pub(super) rig: OnceLock<Rig>,
    pub(super) looks: OnceLock<Looks>,
}

impl Blueprint {
    /// A blueprint without size, mass or wheels.
    pub(super) fn new(id: &'static str, kind: Kind, tag: Tag, recipe: Recipe) -> Blueprint {
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
            recipe,
            rig: OnceLock::new(),
            looks: OnceLock::new(),
        }
    }
}
