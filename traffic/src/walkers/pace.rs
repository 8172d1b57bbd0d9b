//! What distinguishes a walker from others: its speed, the side that it prefers, where it crosses.

use walkable::{Area, Walk};

use super::view::View;
use crate::random::{Purpose, stream, unit};

/// Speed of walkers on level ground (Weidmann, *Transporttechnik der Fussgänger*, 1993): mean and
/// deviation, metres per second.
const SPEED_MPS: (f32, f64) = (1.34, 0.26);
/// Bounds of the speed.
const SPEED_BOUNDS_MPS: (f32, f32) = (0.7, 2.1);
/// Largest change of velocity, metres per second squared.
pub(super) const ACCELERATION_MPS2: f32 = 3.5;
/// A walker that would be slower stands.
pub(super) const STANDING_MPS: f32 = 0.06;
/// Speed of the first step.
pub(super) const FIRST_MPS: f32 = 0.12;
/// A walker that is slower than this has not come forward.
pub(super) const SLOW_MPS: f32 = 0.2;

/// Returns the speed at which a walker walks where nothing hinders it.
pub(super) fn speed(view: &View<'_>, id: u32) -> f32 {
    let (low, high) = SPEED_BOUNDS_MPS;
    view.params.walker_speed_mps(id).unwrap_or_else(|| {
        let off = stream(view.seed, id, Purpose::WalkerPace, 0).normal(SPEED_MPS.1) as f32;
        (SPEED_MPS.0 + off).clamp(low, high)
    })
}

/// Returns whether the way of a walker from a triangle crosses quiet streets away from crosswalks. One that has
/// come onto such a street, over the edge of a sidewalk for example, has no other way.
pub(super) fn crosses(view: &View<'_>, id: u32, cell: u32) -> bool {
    view.ground.surface.cell(cell).area == Area::Road
        || unit(view.seed, id, Purpose::WalkerCrosses, 0) < view.params.cross_factor()
}

/// Returns how a walker walks from a triangle. Most keep to the right half of the width.
pub(super) fn walk(view: &View<'_>, id: u32, cell: u32) -> Walk {
    let side = 0.12 + 0.5 * unit(view.seed, id, Purpose::WalkerSide, 0);
    Walk { crosses: crosses(view, id, cell), side }
}
