//! Everything that can be spawned: CARLA's ids, true sizes, procedural meshes.
//!
//! Sizes are tables; what a thing looks like is made when somebody first asks.

mod attribute;
mod blueprint;
mod car;
mod fittings;
mod fleet;
mod gltf;
mod heavy;
mod looks;
mod posture;
mod profile;
mod prop;
mod recipe;
mod rig;
mod signal;
mod silhouettes;
mod skeleton;
mod trim;
mod two_wheels;
mod walker;
mod wheel;

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use mesh::Mesh;

use crate::catalogue::recipe::Recipe;
pub use attribute::{Attribute, AttributeType};
pub use blueprint::{Blueprint, Kind, Wheel};
pub use gltf::{MeshFault, replaced};
pub use looks::Looks;
pub use posture::{Given, Posture};
pub use rig::{Joint, Motion, Rig};
pub use skeleton::{Bone, LIMB_BONES, Skeleton, stride_m};

impl Blueprint {
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
