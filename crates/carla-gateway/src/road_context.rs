//! The speed limit and the traffic light that apply to a vehicle.

use std::{collections::BTreeMap, sync::Arc};

use client_lib::{
    World,
    wire::{ActorState, kind},
};
use road::{LaneIndex, LaneTypes, Network};

use crate::state::RoadContext;

/// The context of a vehicle is computed every this many frames.
const FRAMES_BETWEEN: u64 = 4;
/// The limit of roads that define none. Kilometres per hour.
const LIMIT_KMH: f32 = 30.0;
/// The distance before a stop line from which a light applies to a vehicle. Metres.
const BEFORE_M: f64 = 8.0;
/// The distance behind a stop line up to which a light applies to a vehicle. Metres.
const BEHIND_M: f64 = 1.0;

/// The limits and stop lines of a map, and the last context of each vehicle.
pub(crate) struct RoadContexts {
    network: Arc<Network>,
    /// By lane: where lights stop traffic, and the signals.
    stops: BTreeMap<LaneIndex, Vec<(f64, u32)>>,
    cached: BTreeMap<u32, (f32, Option<u32>)>,
}

impl RoadContexts {
    pub(crate) fn new(network: &Arc<Network>) -> RoadContexts {
        let mut stops: BTreeMap<LaneIndex, Vec<(f64, u32)>> = BTreeMap::new();
        for (index, signal) in network.signals().iter().enumerate().filter(|(_, s)| s.dynamic) {
            for (lane, along_m) in &signal.lanes {
                stops.entry(*lane).or_default().push((*along_m, index as u32));
            }
        }
        RoadContexts { network: Arc::clone(network), stops, cached: BTreeMap::new() }
    }

    /// Returns the context of a vehicle at this frame.
    pub(crate) fn of(&mut self, actor: &ActorState, world: &World, frame: u64) -> RoadContext {
        let id = actor.actor_id.0;
        if (frame + u64::from(id)).is_multiple_of(FRAMES_BETWEEN) || !self.cached.contains_key(&id)
        {
            let context = self.find(actor, world);
            self.cached.insert(id, context);
        }
        let (speed_limit_kmh, light) = self.cached[&id];
        let phase = |id: u32| world.state(client_lib::ActorId(id)).map(|light| (id, light.phase));
        RoadContext { speed_limit_kmh, light: light.and_then(phase) }
    }

    fn find(&self, actor: &ActorState, world: &World) -> (f32, Option<u32>) {
        let at = actor.pose.position().as_dvec3();
        let Some(point) = self.network.nearest(at, LaneTypes::DRIVING) else {
            return (LIMIT_KMH, None);
        };
        let lane = self.network.lane(point.lane);
        let limit = lane.speed_limit_mps.map_or(LIMIT_KMH, |mps| mps as f32 * 3.6);
        let stops = self.stops.get(&point.lane).into_iter().flatten();
        let ahead = |along: f64| (-BEHIND_M..=BEFORE_M).contains(&(along - point.along_m));
        let signal = stops.filter(|(along, _)| ahead(*along)).map(|(_, signal)| *signal).next();
        let shows = |signal: u32| {
            let mut lights = world.states().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT);
            lights.find(|light| light.signal == signal).map(|light| light.actor_id.0)
        };
        (limit, signal.and_then(shows))
    }
}
