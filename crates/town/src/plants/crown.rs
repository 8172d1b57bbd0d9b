//! Coarse plants: a trunk and a closed crown.

use glam::Vec3;
use mesh::{Material, RandomStream};

use crate::mesh_builder::MeshBuilder;

use super::species::{Shape, Species};

const RINGS: u32 = 3;
const SIDES: u32 = 5;
/// The number of whorls of a conifer.
const TIERS: u32 = 3;

/// Builds a coarse plant.
pub(super) fn build(builder: &mut MeshBuilder, shape: &Shape, random: &mut RandomStream) {
    let (center, radii) = shape.crown();
    if shape.trunk_radius_m > 0.0 {
        let radius = shape.trunk_radius_m;
        builder.cone(Vec3::Z * -0.4, Vec3::Z * 0.5, [radius * 1.5, radius], 3);
        builder.cone(Vec3::Z * 0.5, Vec3::Z * center.z, [radius, radius * 0.45], 3);
    }
    let first = builder.mesh.positions.len();
    if shape.species == Species::Spruce {
        builder.material(Material::Needles);
        let long = shape.height_m - shape.crown_from_m;
        for tier in 0..TIERS {
            let fraction = tier as f32 / TIERS as f32;
            let low = shape.crown_from_m + long * fraction;
            let high = (low + long / TIERS as f32 * 1.9).min(shape.height_m);
            let reach = shape.crown_radius_m * (1.0 - fraction * 0.86);
            builder.cone(Vec3::Z * low, Vec3::Z * high, [reach, 0.0], 5);
        }
    } else {
        builder.material(Material::Leaves);
        builder.ball(center, radii * 0.94, RINGS, SIDES);
        // All crowns differ.
        for point in &mut builder.mesh.positions[first..] {
            let p = Vec3::from_array(*point);
            *point = (center + (p - center) * random.between(0.92, 1.06)).to_array();
        }
    }
}
