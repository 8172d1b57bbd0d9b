//! Traffic lights as clients see them: names, groups, and for how long they have shown a colour.

use std::collections::BTreeMap;

use client_lib::{ActorState, World, kind};
use road::Network;

use crate::state::{Moment, Timing};

/// How long a light shows each colour where nothing better is known.
const GREEN_SECS: f32 = 10.0;
const YELLOW_SECS: f32 = 3.0;
const RED_SECS: f32 = 2.0;

/// All lights of the map.
pub(crate) struct Lights {
    /// OpenDRIVE's id and the controller of each signal.
    signals: Vec<(String, Option<u32>)>,
    by_actor: BTreeMap<u32, Light>,
    pub(crate) is_frozen: bool,
}

/// One lamp box.
#[derive(Clone, Copy, Debug)]
struct Light {
    signal: u32,
    phase: u32,
    since_nanos: u64,
    /// Green, yellow, red, as clients were told or set.
    secs: [f32; 3],
}

impl Lights {
    pub(crate) fn new(network: &Network) -> Lights {
        let signals = network.signals().iter().map(|s| (s.id.clone(), s.controller));
        Lights { signals: signals.collect(), by_actor: BTreeMap::new(), is_frozen: false }
    }

    /// Takes in the colours of a frame.
    pub(crate) fn follow(&mut self, world: &World) {
        let now = world.header().stamp.sim_time_nanos;
        for actor in world.actors().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT) {
            let light = self.by_actor.entry(actor.actor_id.0).or_insert(Light {
                signal: actor.signal,
                phase: actor.phase,
                since_nanos: now,
                secs: [GREEN_SECS, YELLOW_SECS, RED_SECS],
            });
            if light.phase != actor.phase {
                (light.phase, light.since_nanos) = (actor.phase, now);
            }
        }
    }

    /// The name, the place in its group, and the timing of a light.
    pub(crate) fn of(&self, actor: &ActorState, moment: &Moment) -> (&str, u32, Timing) {
        let name = self.signals.get(actor.signal as usize).map_or("", |(name, _)| name.as_str());
        let light = self.by_actor.get(&actor.actor_id.0);
        let secs = light.map_or([GREEN_SECS, YELLOW_SECS, RED_SECS], |l| l.secs);
        let since = light.map_or(0, |l| moment.sim_time_nanos.saturating_sub(l.since_nanos));
        let timing = Timing {
            green_secs: secs[0],
            yellow_secs: secs[1],
            red_secs: secs[2],
            elapsed_secs: since as f32 * 1e-9,
            is_frozen: self.is_frozen,
        };
        let group = self.group(actor.actor_id.0);
        let pole = group.iter().position(|id| *id == actor.actor_id.0).unwrap_or(0);
        (name, pole as u32, timing)
    }

    /// The lights that are switched together with one, itself among them.
    pub(crate) fn group(&self, id: u32) -> Vec<u32> {
        let controller =
            |light: &Light| self.signals.get(light.signal as usize).and_then(|(_, c)| *c);
        let Some(own) = self.by_actor.get(&id) else { return Vec::new() };
        let Some(group) = controller(own) else { return vec![id] };
        let members = self.by_actor.iter().filter(|(_, l)| controller(l) == Some(group));
        members.map(|(id, _)| *id).collect()
    }

    /// Whether this actor is a light of the map.
    pub(crate) fn contains(&self, id: u32) -> bool {
        self.by_actor.contains_key(&id)
    }

    /// All lights.
    pub(crate) fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.by_actor.keys().copied()
    }

    /// What clients are told of the length of a colour: 0 green, 1 yellow, 2 red.
    pub(crate) fn set_secs(&mut self, id: u32, colour: usize, secs: f32) {
        if let Some(light) = self.by_actor.get_mut(&id) {
            light.secs[colour] = secs;
        }
    }
}
