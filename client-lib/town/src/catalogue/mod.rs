//! Everything that can be spawned: CARLA's ids, true sizes, procedural meshes.

mod car;
mod fleet;
mod heavy;
mod prop;
mod signal;
mod two_wheels;
mod walker;
mod wheel;

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use glam::Vec3;
use road::{Mesh, Tag};

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
#[derive(Clone, Debug)]
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
    /// Half of length, width (mirrors included) and height. Metres.
    pub half_extents_m: Vec3,
    /// The middle of the box, in actor space. Metres.
    pub center_m: Vec3,
    /// The whole thing, in actor space; every face is of object 0.
    pub mesh: Mesh,
    /// Front left, front right, rear left, rear right; front, rear on two wheels; else none.
    pub wheels: Vec<Wheel>,
    /// Ready to drive. Kilograms.
    pub mass_kg: f32,
    /// Between the axles; 0 without wheels. Metres.
    pub wheelbase_m: f32,
    /// Of the paint, sRGB.
    pub default_color: [u8; 3],
}

/// Every blueprint; the index is the number by which actors name theirs.
pub fn catalogue() -> &'static [Blueprint] {
    static CATALOGUE: OnceLock<Vec<Blueprint>> = OnceLock::new();
    CATALOGUE.get_or_init(|| {
        let mut all = fleet::vehicles();
        all.extend(walker::walkers());
        all.extend(prop::props());
        all.push(signal::traffic_light());
        all
    })
}

/// The blueprint with this id, and its index.
pub fn blueprint(id: &str) -> Option<(u32, &'static Blueprint)> {
    let index = catalogue().iter().position(|blueprint| blueprint.id == id)?;
    Some((index as u32, &catalogue()[index]))
}
