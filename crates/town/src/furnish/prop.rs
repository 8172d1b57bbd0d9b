//! Props of the catalogue that stand in the town.

use glam::Vec2;
use mesh::Tag;

use crate::{
    furnish::{
        plan::Plan,
        raster::rectangle,
        scene::{ObjectProperties, Place, Scene},
    },
    mesh_builder::MeshBuilder,
    static_world::{Detail, Layer},
};

/// The number of triangles above which a prop is too fine for low detail.
const BOXED_FROM: usize = 150;

/// Places a prop of the catalogue with its x axis along `yaw_rad`, if the prop exists and its place
/// has none of the bits in `taken`; returns whether it was placed.
pub(super) fn place_prop(
    plan: &mut Plan,
    scene: &mut Scene,
    id: &str,
    (at, yaw_rad): (Vec2, f32),
    taken: u8,
) -> bool {
    let Some((_, thing)) = crate::catalogue::blueprint(id) else { return false };
    let half = thing.half_extents_m;
    // The middle of the prop's box stands there, not its origin.
    let outline = rectangle(at, half.truncate() + 0.1, yaw_rad);
    if !plan.raster.is_free(&outline, taken) {
        return false;
    }
    plan.raster.stamp(&outline, super::raster::ground::FURNITURE);
    let origin = at - Vec2::from_angle(yaw_rad).rotate(thing.center_m.truncate());
    let place = Place { foot: plan.foot(origin), yaw_rad };
    let properties =
        ObjectProperties { tag: Tag::Static, layer: Layer::Props, color: thing.default_color };
    let (low, high) = (thing.center_m - half, thing.center_m + half);
    // In low detail a finely modelled prop becomes a box.
    let is_box = plan.detail == Detail::Low && thing.mesh().triangles.len() > BOXED_FROM;
    scene.add(properties, place, |builder: &mut MeshBuilder| {
        if is_box { builder.block(low, high) } else { builder.append(thing.mesh(), 1.0) }
    });
    scene.solid(&place, low, high);
    true
}
