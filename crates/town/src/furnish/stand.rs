//! Things of the catalogue that stand about.

use glam::Vec2;
use mesh::Tag;

use crate::{
    furnish::{
        plan::Plan,
        raster::rectangle,
        scene::{Brief, Place, Scene},
    },
    mesh_builder::MeshBuilder,
    static_world::{Detail, Layer},
};

/// Triangles from which on a prop is too fine for low detail.
const BOXED_FROM: usize = 150;

/// Puts a prop of the catalogue down, its x along `yaw_rad`, if it is known and none of `taken` is
/// there; says whether.
pub(super) fn stand(
    plan: &mut Plan,
    scene: &mut Scene,
    id: &str,
    (at, yaw_rad): (Vec2, f32),
    taken: u8,
) -> bool {
    let Some((_, thing)) = crate::catalogue::blueprint(id) else { return false };
    let half = thing.half_extents_m;
    // The middle of the box stands there, not the origin.
    let outline = rectangle(at, half.truncate() + 0.1, yaw_rad);
    if !plan.raster.is_free(&outline, taken) {
        return false;
    }
    plan.raster.stamp(&outline, super::raster::ground::FURNITURE);
    let origin = at - Vec2::from_angle(yaw_rad).rotate(thing.center_m.truncate());
    let place = Place { foot: plan.foot(origin), yaw_rad };
    let brief = Brief { tag: Tag::Static, layer: Layer::Props, color: thing.default_color };
    let (low, high) = (thing.center_m - half, thing.center_m + half);
    // In a whole city, what is finely made is a box.
    let is_box = plan.detail == Detail::Low && thing.mesh().triangles.len() > BOXED_FROM;
    scene.add(brief, place, |builder: &mut MeshBuilder| {
        if is_box { builder.block(low, high) } else { builder.append(thing.mesh(), 1.0) }
    });
    scene.solid(&place, low, high);
    true
}
