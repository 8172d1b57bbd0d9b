//! What the road tells a vehicle: its speed limit, and the light that it stands at.

use std::collections::BTreeMap;

use client_lib::{ActorState, World, kind};
use road::{LaneIndex, LaneTypes, Network};

use crate::state::Roadside;

/// A vehicle is asked after every so many frames.
const EVERY: u64 = 4;
/// Where no limit is posted.
const LIMIT_KMH: f32 = 30.0;
/// So far before the line a light begins to matter to CARLA's clients. Metres.
const BEFORE_M: f64 = 8.0;
/// So far behind it, it still does. Metres.
const BEHIND_M: f64 = 1.0;

/// The map's limits and stop lines, and what vehicles were last told.
pub(crate) struct Roadsides {
    network: Network,
    /// Where each lane's lights stop traffic, and which signal that is.
    stops: BTreeMap<LaneIndex, Vec<(f64, u32)>>,
    told: BTreeMap<u32, (f32, Option<u32>)>,
}

impl Roadsides {
    pub(crate) fn new(network: &Network) -> Roadsides {
        let mut stops: BTreeMap<LaneIndex, Vec<(f64, u32)>> = BTreeMap::new();
        for (index, signal) in network.signals().iter().enumerate().filter(|(_, s)| s.dynamic) {
            for (lane, along_m) in &signal.lanes {
                stops.entry(*lane).or_default().push((*along_m, index as u32));
            }
        }
        Roadsides { network: network.clone(), stops, told: BTreeMap::new() }
    }

    /// For one vehicle at this frame.
    pub(crate) fn of(&mut self, actor: &ActorState, world: &World, frame: u64) -> Roadside {
        let id = actor.actor_id.0;
        if (frame + u64::from(id)).is_multiple_of(EVERY) || !self.told.contains_key(&id) {
            let told = self.look(actor, world);
            self.told.insert(id, told);
        }
        let (speed_limit_kmh, light) = self.told[&id];
        let phase = |id: u32| world.actor(client_lib::ActorId(id)).map(|light| (id, light.phase));
        Roadside { speed_limit_kmh, light: light.and_then(phase) }
    }

    fn look(&self, actor: &ActorState, world: &World) -> (f32, Option<u32>) {
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
            let mut lights = world.actors().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT);
            lights.find(|light| light.signal == signal).map(|light| light.actor_id.0)
        };
        (limit, signal.and_then(shows))
    }
}
