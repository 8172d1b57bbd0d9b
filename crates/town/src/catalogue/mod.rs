//! Everything that can be spawned: CARLA's ids, true sizes, procedural meshes.
//!
//! Sizes are tables; what a thing looks like is made when somebody first asks.

mod attribute;
mod car;
mod fleet;
mod gltf;
mod heavy;
mod looks;
mod prop;
mod rig;
mod signal;
mod skeleton;
mod trim;
mod two_wheels;
mod walker;
mod wheel;

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use glam::Vec3;
use mesh::{Mesh, Tag};

pub use attribute::{Attribute, AttributeType};
pub use gltf::{MeshFault, replaced};
pub use looks::Looks;
pub use rig::{Given, Joint, Motion, Posture, Rig};
pub use skeleton::{Bone, LIMB_BONES, Skeleton, stride_m};

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
    recipe: Recipe,
    rig: OnceLock<Rig>,
    looks: OnceLock<Looks>,
}

/// How a blueprint's looks are made.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Recipe {
    /// By its place in the table of vehicles.
    Vehicle(usize),
    /// By its number.
    Walker(usize),
    Prop(Tag, [f32; 3], prop::Shape),
    Signal,
}

impl Blueprint {
    fn new(id: &'static str, kind: Kind, tag: Tag, recipe: Recipe) -> Blueprint {
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

    /// The whole thing at rest, in actor space; every face is of object 0.
    pub fn mesh(&self) -> &Mesh {
        &self.looks().whole
    }

    /// What it looks like, in the pieces that move by themselves: one for each of its
    /// [`Blueprint::rig`]'s joints.
    pub fn looks(&self) -> &Looks {
        self.looks.get_or_init(|| {
            let mesh = match self.recipe {
                Recipe::Vehicle(row) => fleet::sculpt(row, self),
                Recipe::Walker(number) => walker::sculpt(number),
                Recipe::Prop(tag, size_m, shape) => prop::sculpt(tag, size_m, shape),
                Recipe::Signal => signal::sculpt(),
            };
            Looks::of(self.rig(), mesh)
        })
    }

    /// How its pieces move.
    pub fn rig(&self) -> &Rig {
        self.rig.get_or_init(|| match self.recipe {
            Recipe::Vehicle(row) => fleet::rig(row, self),
            Recipe::Walker(number) => walker::rig(number),
            Recipe::Prop(..) | Recipe::Signal => Rig::still(),
        })
    }

    /// A walker's bones.
    pub fn skeleton(&self) -> Option<&Skeleton> {
        self.rig().skeleton.as_ref()
    }

    /// CARLA's attributes, in CARLA's order.
    pub fn attributes(&self) -> Vec<Attribute> {
        attribute::attributes_of(self)
    }
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
