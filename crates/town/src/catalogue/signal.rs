use glam::{Vec3, vec3};
use mesh::{Material, Mesh, Tag};

use crate::{
    catalogue::{
        blueprint::{Blueprint, Kind},
        mesh_source::MeshSource,
    },
    mesh_builder::MeshBuilder,
};

/// The height of the lamp box. Metres.
pub(crate) const HEAD_HEIGHT_M: f32 = 0.96;

/// Returns the blueprint of a lamp box with three lamps. The origin is the middle of its lower edge
/// at its back, where the pole holds it. The lamps face along x.
pub(super) fn traffic_light() -> Blueprint {
    let (low, high) = (
        vec3(0.0, -HALF_M - 0.10, -0.10),
        vec3(DEPTH_M + 0.20, HALF_M + 0.10, HEAD_HEIGHT_M + 0.10),
    );
    Blueprint {
        half_extents_m: (high - low) * 0.5,
        center_m: (high + low) * 0.5,
        mass_kg: 30.0,
        default_color: [30, 32, 34],
        ..Blueprint::new(
            "traffic.traffic_light",
            Kind::TrafficLight,
            Tag::TrafficLight,
            MeshSource::Signal,
        )
    }
}

/// Half the width and the depth of the box, without its backing board. Metres.
const HALF_M: f32 = 0.16;
const DEPTH_M: f32 = 0.22;

pub(super) fn build_mesh() -> Mesh {
    let mut builder = MeshBuilder::new(Tag::TrafficLight, Material::Plastic, 0);
    builder.block(vec3(0.0, -HALF_M, 0.0), vec3(DEPTH_M, HALF_M, HEAD_HEIGHT_M));
    // A backing board makes the lamps visible against the sky.
    builder
        .block(vec3(0.02, -HALF_M - 0.10, -0.10), vec3(0.04, HALF_M + 0.10, HEAD_HEIGHT_M + 0.10));
    for (row, material) in
        [Material::SignalGreen, Material::SignalYellow, Material::SignalRed].into_iter().enumerate()
    {
        let center = vec3(DEPTH_M, 0.0, HEAD_HEIGHT_M * (row as f32 + 0.5) / 3.0);
        builder.material(material);
        builder.cone(center - Vec3::X * 0.01, center + Vec3::X * 0.03, [0.115, 0.09], 16);
        builder.material(Material::Plastic);
        visor(&mut builder, center, 0.13, 0.20);
    }
    builder.mesh
}

/// A hood over a lamp, open below and visible from both sides.
fn visor(builder: &mut MeshBuilder, center: Vec3, radius: f32, reach: f32) {
    let at = |step: u32, x: f32, radius: f32| {
        let angle = -0.35 + (std::f32::consts::PI + 0.7) * step as f32 / 8.0;
        center + vec3(x, angle.cos() * radius, angle.sin() * radius)
    };
    for step in 0..8 {
        let outer = [at(step, 0.0, radius), at(step, reach, radius)];
        let next = [at(step + 1, 0.0, radius), at(step + 1, reach, radius)];
        builder.quad([outer[0], next[0], next[1], outer[1]]);
        builder.quad([
            at(step, 0.0, radius - 0.006),
            at(step, reach, radius - 0.006),
            at(step + 1, reach, radius - 0.006),
            at(step + 1, 0.0, radius - 0.006),
        ]);
    }
}
