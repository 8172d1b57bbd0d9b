//! CARLA's OSM mode: vehicles that traffic drives are removed where their lane ends without a successor.

use client_lib::{
    World,
    wire::{ActorState, Command, flag, kind},
};
use road::{Lane, LaneTypes, Network};

/// Distance to the end of a lane in which a vehicle is at it. Metres; traffic stops up to 9 m before the
/// end to turn round, and a position is that of the middle of a vehicle.
const NEAR_M: f64 = 16.0;
/// Speed below which a vehicle has stopped there; at half of it traffic begins to turn round.
const STOPPED_MPS: f32 = 1.0;

/// Whether vehicles at dead ends are removed.
#[derive(Default)]
pub(crate) struct DeadEnds {
    pub(crate) is_on: bool,
}

impl DeadEnds {
    /// Returns the commands that remove vehicles before the next frame.
    pub(crate) fn commands(&self, world: &World, network: &Network) -> Vec<Command> {
        if !self.is_on {
            return Vec::new();
        }
        let ended = world.states().iter().filter(|actor| is_at_dead_end(actor, network));
        ended.map(|actor| Command::Destroy(actor.actor_id)).collect()
    }
}

fn is_at_dead_end(actor: &ActorState, network: &Network) -> bool {
    if actor.kind != kind::VEHICLE
        || !actor.has(flag::AUTOPILOT)
        || actor.velocity().length() > STOPPED_MPS
    {
        return false;
    }
    let Some(at) = network.nearest(actor.pose.position().as_dvec3(), LaneTypes::DRIVABLE) else {
        return false;
    };
    let lane = network.lane(at.lane);
    lane.length_m - at.along_m < NEAR_M && is_dead_end(lane, network)
}

/// Returns whether neither the lane nor one beside it in its direction has a successor.
fn is_dead_end(lane: &Lane, network: &Network) -> bool {
    let ends = |lane: &Lane| {
        lane.successors.iter().all(|next| !LaneTypes::DRIVABLE.contains(network.lane(*next).kind))
    };
    let mut beside = network.lanes().iter().filter(|other| {
        (other.road, other.section, other.forward) == (lane.road, lane.section, lane.forward)
            && LaneTypes::DRIVABLE.contains(other.kind)
    });
    beside.all(ends)
}
