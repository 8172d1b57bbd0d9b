//! Static props: CARLA's 95 ids, each with a realistic size.

mod garden;
mod litter;
mod parts;
mod street;

use glam::{Vec3, vec3};
use mesh::{Material, Mesh, Tag};

use crate::{
    catalogue::{
        blueprint::{Blueprint, Kind},
        mesh_source::{MeshSource, Shape},
        prop::parts::Row,
    },
    mesh_builder::{self, MeshBuilder},
};

fn rows() -> impl Iterator<Item = &'static Row> {
    litter::ROWS.iter().chain(garden::ROWS).chain(street::ROWS)
}

/// Returns all props, sorted by id.
pub(super) fn props() -> Vec<Blueprint> {
    let mut all: Vec<Blueprint> = rows().map(prop).collect();
    all.sort_by_key(|blueprint| blueprint.id);
    all
}

fn prop(&(id, tag, size_m, mass_kg, shape): &Row) -> Blueprint {
    let size = Vec3::from_array(size_m);
    Blueprint {
        half_extents_m: size * 0.5,
        center_m: Vec3::Z * size.z * 0.5,
        mass_kg,
        default_color: [200, 90, 30],
        ..Blueprint::new(id, Kind::Prop, tag, MeshSource::Prop(tag, size_m, shape))
    }
}

/// Builds the mesh of a prop of exactly this size: centred over the origin, standing on the ground.
pub(super) fn build_mesh(tag: Tag, size_m: [f32; 3], shape: Shape) -> Mesh {
    let mut builder = MeshBuilder::new(tag, Material::Plastic, 0);
    shape(&mut builder);
    let (low, high) = mesh_builder::bounds(&builder.mesh);
    let scale = Vec3::from_array(size_m) / (high - low);
    let foot = vec3((low.x + high.x) * 0.5, (low.y + high.y) * 0.5, low.z);
    for position in &mut builder.mesh.positions {
        *position = ((Vec3::from_array(*position) - foot) * scale).to_array();
    }
    builder.mesh
}
