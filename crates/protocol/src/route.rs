//! Routes that clients give vehicles and walkers on autopilot.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::ActorId;

/// The most steps in one [`RouteCommand`]; a longer route takes several.
pub const ROUTE_STEPS: usize = 11;

/// Parameters of [`crate::Command::RouteCommand`]. After the last step the vehicle chooses its turns at random
/// again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteCommand {
    /// The vehicle, or a walker, whose steps are places only.
    pub actor_id: ActorId,
    /// 1: replaces the earlier route; 0: continues it.
    pub replace: u32,
    /// Number of valid `steps`; with `replace` and no step the route is removed.
    pub count: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// The steps, in order.
    pub steps: [RouteStep; ROUTE_STEPS],
}

/// One step of a route.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RouteStep {
    /// One of [`route_step`].
    pub kind: u32,
    /// For [`route_step::PLACE`]: the place in world space.
    pub position_m: [f32; 3],
}

impl RouteCommand {
    /// The commands that set a whole route; an empty route removes the earlier one.
    pub fn route(actor_id: ActorId, steps: &[RouteStep]) -> Vec<RouteCommand> {
        let part = |nth: usize, some: &[RouteStep]| {
            let replace = u32::from(nth == 0);
            let mut guide = RouteCommand {
                actor_id,
                replace,
                count: some.len() as u32,
                ..RouteCommand::default()
            };
            guide.steps[..some.len()].copy_from_slice(some);
            guide
        };
        if steps.is_empty() {
            return vec![part(0, &[])];
        }
        steps.chunks(ROUTE_STEPS).enumerate().map(|(nth, some)| part(nth, some)).collect()
    }
}

impl RouteStep {
    /// Drives by a place in world space, metres.
    pub fn place(position: Vec3) -> RouteStep {
        RouteStep { kind: route_step::PLACE, position_m: position.to_array() }
    }

    /// A turn or lane change: one of the other values of [`route_step`].
    pub fn turn(kind: u32) -> RouteStep {
        RouteStep { kind, ..RouteStep::default() }
    }
}

/// Values of [`RouteStep::kind`].
pub mod route_step {
    /// Drives by a place, on the nearest lane and the shortest way.
    pub const PLACE: u32 = 1;
    /// Turns left at the next junction, changing lanes for it where needed; takes the straightest
    /// connection where there is no turn to the left.
    pub const LEFT: u32 = 2;
    /// Turns right at the next junction, with the same rules.
    pub const RIGHT: u32 = 3;
    /// Goes straight on at the next junction.
    pub const STRAIGHT: u32 = 4;
    /// Changes to the lane on the left, if there is one.
    pub const LANE_LEFT: u32 = 5;
    /// Changes to the lane on the right, if there is one.
    pub const LANE_RIGHT: u32 = 6;
}
