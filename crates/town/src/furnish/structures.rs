//! Structures and paint that the map's file describes: rails, walls, tunnels, parapets, buildings;
//! parking spaces and crosswalks.

use glam::{Quat, Vec3};
use mesh::{Mesh, Tag};
use road::{Solid, Structure};

use crate::{
    furnish::{
        plan::Plan,
        raster::{ground, rectangle},
        scene::Scene,
    },
    static_world::{Collider, Layer, Object},
};

/// The colour of structures without a colour of their own: concrete. sRGB.
const GREY: [u8; 3] = [150, 150, 148];

/// The height of paint above the surface below it, and the greatest distance of that surface from
/// the height in the file. Metres.
const COAT_M: f32 = 0.004;
const ASTRAY_M: f32 = 0.3;

/// Adds all structures; no other objects are placed on them.
pub(super) fn raise(plan: &mut Plan, scene: &mut Scene, structures: Vec<Structure>) {
    for structure in structures {
        if structure.is_ground {
            scene.lay(&structure.mesh);
            continue;
        }
        for solid in &structure.solids {
            let (center, half) = (solid.center.as_vec3(), solid.half_extents_m.as_vec3());
            let outline = rectangle(center.truncate(), half.truncate(), solid.yaw_rad as f32);
            plan.raster.stamp(&outline, ground::BUILT);
        }
        let yaw_rad = structure.solids.first().map_or(0.0, |solid| solid.yaw_rad as f32);
        let turn = Quat::from_rotation_z(yaw_rad);
        let own = |position: &[f32; 3]| turn.inverse() * Vec3::from_array(*position);
        let (low, high) = structure
            .mesh
            .positions
            .iter()
            .map(own)
            .fold((Vec3::MAX, Vec3::MIN), |(low, high), at| (low.min(at), high.max(at)));
        let object = Object {
            tag: structure.tag,
            layer: layer(structure.tag),
            center: turn * ((low + high) * 0.5),
            half_extents_m: (high - low) * 0.5,
            yaw_rad,
            color: GREY,
        };
        scene.adopt(object, &structure.mesh, structure.solids.iter().map(collider));
    }
}

/// Adds the paint.
pub(super) fn paint(plan: &Plan, scene: &mut Scene, mut paint: Mesh) {
    for position in &mut paint.positions {
        let at = Vec3::from_array(*position);
        let below = plan.topmost(at.truncate(), at.z + ASTRAY_M);
        let below = below.filter(|z| at.z - z < ASTRAY_M);
        position[2] = below.unwrap_or(at.z) + COAT_M;
    }
    scene.lay(&paint);
}

fn layer(tag: Tag) -> Layer {
    match tag {
        Tag::Building => Layer::Buildings,
        Tag::Vegetation => Layer::Foliage,
        Tag::Wall | Tag::Fence | Tag::GuardRail | Tag::Bridge => Layer::Walls,
        _ => Layer::Props,
    }
}

/// The scene sets the object of the faces.
fn collider(solid: &Solid) -> Collider {
    Collider {
        center: solid.center.as_vec3(),
        half_extents_m: solid.half_extents_m.as_vec3(),
        yaw_rad: solid.yaw_rad as f32,
        object: 0,
    }
}
