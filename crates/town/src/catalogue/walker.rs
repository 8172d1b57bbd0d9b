//! Pedestrians: CARLA's 49 ids, adults and children of several builds, each with different clothes.
//!
//! Bodies, clothes and hair are control cages in `walker/cages`, fitted to the body of each person
//! and subdivided when its mesh is built.

mod body;
mod face;
mod figure;
mod garment;
mod outfit;
mod palette;
mod people;

#[cfg(test)]
mod tests;

use glam::vec3;
use mesh::{Material, Mesh, Tag};

use crate::{
    catalogue::{
        blueprint::{Blueprint, Kind},
        mesh_source::MeshSource,
        rig::{Joint, Motion, Rig},
        skeleton::{Skeleton, bone},
        walker::{
            figure::Figure,
            people::{PEOPLE, Person},
        },
    },
    mesh_builder::MeshBuilder,
};

/// Returns all walkers, sorted by id.
pub(super) fn walkers() -> Vec<Blueprint> {
    (0..PEOPLE.len()).map(walker).collect()
}

/// The description of a walker's blueprint.
pub(super) fn person(blueprint: &Blueprint) -> &'static Person {
    match blueprint.mesh_source {
        MeshSource::Walker(number) => &PEOPLE[number],
        _ => &PEOPLE[0],
    }
}

fn walker(number: usize) -> Blueprint {
    let Person { id, height_m, girth, colors, .. } = PEOPLE[number];
    let (half_m, middle_x) = Figure::new(number).half_size();
    Blueprint {
        generation: 2,
        half_extents_m: half_m,
        center_m: vec3(middle_x, 0.0, half_m.z),
        mass_kg: 22.0 * girth * girth * height_m * height_m,
        default_color: colors[0],
        ..Blueprint::new(id, Kind::Walker, Tag::Pedestrian, MeshSource::Walker(number))
    }
}

/// The pieces: their names, and the bone that each follows.
const PIECES: [(&str, usize); 13] = [
    ("crl_hips__C", bone::HIPS),
    ("crl_spine01__C", bone::CHEST),
    ("crl_Head__C", bone::HEAD),
    ("crl_arm__L", bone::ARM[0]),
    ("crl_foreArm__L", bone::FOREARM[0]),
    ("crl_arm__R", bone::ARM[1]),
    ("crl_foreArm__R", bone::FOREARM[1]),
    ("crl_thigh__L", bone::THIGH[0]),
    ("crl_leg__L", bone::LEG[0]),
    ("crl_thigh__R", bone::THIGH[1]),
    ("crl_leg__R", bone::LEG[1]),
    ("crl_foot__L", bone::FOOT[0]),
    ("crl_foot__R", bone::FOOT[1]),
];

pub(super) fn rig(number: usize) -> Rig {
    let Person { height_m, girth, .. } = PEOPLE[number];
    let joint = |(name, bone): (&'static str, usize)| Joint { name, motion: Motion::Bone(bone) };
    Rig { joints: PIECES.map(joint).to_vec(), skeleton: Some(Skeleton::new(height_m, girth)) }
}

pub(super) fn build_mesh(number: usize) -> Mesh {
    let mut builder = MeshBuilder::new(Tag::Pedestrian, Material::Cloth, 0);
    Figure::new(number).build_mesh(&mut builder);
    builder.mesh
}
