//! What the file says stands on and along roads: rails, walls, tunnels, parapets.

use glam::{Quat, Vec3};
use road::{Solid, Structure, Tag};

use super::scene::Scene;
use super::{Collider, Layer, Object};

/// What nobody told the colour of is like concrete. sRGB.
const GREY: [u8; 3] = [150, 150, 148];

/// Adds all of them.
pub(super) fn raise(scene: &mut Scene, structures: Vec<Structure>) {
    for structure in structures {
        if structure.is_ground {
            scene.lay(&structure.mesh);
            continue;
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

fn layer(tag: Tag) -> Layer {
    match tag {
        Tag::Building => Layer::Buildings,
        Tag::Vegetation => Layer::Foliage,
        Tag::Wall | Tag::Fence | Tag::GuardRail | Tag::Bridge => Layer::Walls,
        _ => Layer::Props,
    }
}

/// The scene says which object it belongs to.
fn collider(solid: &Solid) -> Collider {
    Collider {
        center: solid.center.as_vec3(),
        half_extents_m: solid.half_extents_m.as_vec3(),
        yaw_rad: solid.yaw_rad as f32,
        object: 0,
    }
}
