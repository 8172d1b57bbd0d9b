//! The catalogue of blueprints: CARLA's ids, real sizes, procedural meshes.
//!
//! Sizes are tables. A mesh is built when it is first asked for.

mod attribute;
mod blueprint;
mod bus;
mod cabin;
mod cage;
mod car;
mod cargo;
mod chassis;
mod details;
mod end;
mod fittings;
mod fleet;
mod geometry;
mod gltf;
mod heavy;
mod lamp;
mod mesh_source;
mod number_plate;
mod obj;
mod paint;
mod posture;
mod profile;
mod prop;
mod rig;
mod seals;
mod signal;
mod silhouettes;
mod skeleton;
mod tall;
mod trim;
mod two_wheels;
mod walker;
mod wheel;

#[cfg(test)]
mod tests;

use std::sync::OnceLock;

use mesh::Mesh;

use crate::catalogue::mesh_source::MeshSource;
pub use attribute::{Attribute, AttributeType};
pub use blueprint::{Blueprint, Kind, Wheel};
pub use geometry::Geometry;
pub use gltf::{MeshError, replaced};
pub use posture::{GivenPose, Posture};
pub use rig::{Joint, Motion, Rig};
pub use skeleton::{Bone, LIMB_BONES, Skeleton, stride_m};

impl Blueprint {
    /// The whole mesh at rest without occupants, in actor space; every face has object 0.
    pub fn mesh(&self) -> &Mesh {
        &self.geometry().whole
    }

    /// The mesh in the pieces that move independently: one for each joint of [`Blueprint::rig`].
    pub fn geometry(&self) -> &Geometry {
        self.geometry.get_or_init(|| {
            let mesh = match self.mesh_source {
                MeshSource::Vehicle(row) => fleet::build_mesh(row, self),
                MeshSource::Walker(number) => walker::build_mesh(number),
                MeshSource::Prop(tag, size_m, shape) => prop::build_mesh(tag, size_m, shape),
                MeshSource::Signal => signal::build_mesh(),
            };
            Geometry::of(self.rig(), mesh)
        })
    }

    /// How the pieces move.
    pub fn rig(&self) -> &Rig {
        self.rig.get_or_init(|| match self.mesh_source {
            MeshSource::Vehicle(row) => fleet::rig(row, self),
            MeshSource::Walker(number) => walker::rig(number),
            MeshSource::Prop(..) | MeshSource::Signal => Rig::still(),
        })
    }

    /// The bones of a walker; `None` for other kinds.
    pub fn skeleton(&self) -> Option<&Skeleton> {
        self.rig().skeleton.as_ref()
    }

    /// The attributes of this blueprint, in CARLA's order.
    pub fn attributes(&self) -> Vec<Attribute> {
        attribute::attributes_of(self)
    }
}

/// Returns every blueprint. The index is [`Blueprint`]'s number in actor states.
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

/// Returns the blueprint with this id, and its index.
pub fn blueprint(id: &str) -> Option<(u32, &'static Blueprint)> {
    let index = catalogue().iter().position(|blueprint| blueprint.id == id)?;
    Some((index as u32, &catalogue()[index]))
}
