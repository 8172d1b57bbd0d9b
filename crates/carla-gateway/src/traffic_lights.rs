//! Traffic lights as clients see them: names, groups, and how long they have shown a phase.

use std::collections::BTreeMap;

use client_lib::{
    ActorId, World,
    wire::{ActorState, Command, SetTrafficLight, kind, light},
};
use road::Network;

use crate::state::{Moment, Timing};

/// The durations of phases that no client has set. Seconds.
const GREEN_SECS: f32 = 10.0;
const YELLOW_SECS: f32 = 3.0;
const RED_SECS: f32 = 2.0;

/// All traffic lights of a map.
pub(crate) struct TrafficLights {
    /// The OpenDRIVE id and the controller of each signal.
    signals: Vec<(String, Option<u32>)>,
    by_actor: BTreeMap<u32, Light>,
    pub(crate) is_frozen: bool,
}

/// The state of one light box.
#[derive(Clone, Copy, Debug)]
struct Light {
    signal: u32,
    phase: u32,
    since_nanos: u64,
    /// The durations of green, yellow and red that clients have set, or the defaults. Seconds.
    secs: [f32; 3],
    /// The simulated time until which a client's switch holds; `None`: traffic controls the light.
    held_until_nanos: Option<u64>,
}

impl TrafficLights {
    pub(crate) fn new(network: &Network) -> TrafficLights {
        let signals = network.signals().iter().map(|s| (s.id.clone(), s.controller));
        TrafficLights { signals: signals.collect(), by_actor: BTreeMap::new(), is_frozen: false }
    }

    /// Takes over the phases of a frame.
    pub(crate) fn follow(&mut self, world: &World) {
        let now = world.header().stamp.sim_time_nanos;
        for actor in world.states().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT) {
            let light = self.by_actor.entry(actor.actor_id.0).or_insert(Light {
                signal: actor.signal,
                phase: actor.phase,
                since_nanos: now,
                secs: [GREEN_SECS, YELLOW_SECS, RED_SECS],
                held_until_nanos: None,
            });
            if light.phase != actor.phase {
                (light.phase, light.since_nanos) = (actor.phase, now);
            }
        }
    }

    /// Returns the name of a light, its index in its group, and its timing.
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

    /// Returns the lights of the same controller, including the light itself.
    pub(crate) fn group(&self, id: u32) -> Vec<u32> {
        let controller =
            |light: &Light| self.signals.get(light.signal as usize).and_then(|(_, c)| *c);
        let Some(own) = self.by_actor.get(&id) else { return Vec::new() };
        let Some(group) = controller(own) else { return vec![id] };
        let members = self.by_actor.iter().filter(|(_, l)| controller(l) == Some(group));
        members.map(|(id, _)| *id).collect()
    }

    /// Returns whether an actor is a traffic light.
    pub(crate) fn contains(&self, id: u32) -> bool {
        self.by_actor.contains_key(&id)
    }

    /// Sets the duration of a phase, which clients can read: 0 green, 1 yellow, 2 red.
    pub(crate) fn set_secs(&mut self, id: u32, colour: usize, secs: f32) {
        if let Some(light) = self.by_actor.get_mut(&id) {
            light.secs[colour] = secs;
        }
    }

    /// Switches all boxes of a light's signal to a phase for the duration of that phase, or without
    /// limit while all lights are frozen. Returns the commands.
    pub(crate) fn switch(&mut self, id: u32, phase: u32, world: &World) -> Vec<Command> {
        let signal = self.by_actor.get(&id).map(|light| light.signal);
        let boxes = self.by_actor.iter().filter(|(_, light)| Some(light.signal) == signal);
        let ids: Vec<u32> = boxes.map(|(id, _)| *id).collect();
        let now = world.header().stamp.sim_time_nanos;
        ids.into_iter().filter_map(|id| self.switch_box(id, phase, now)).collect()
    }

    fn switch_box(&mut self, id: u32, phase: u32, now: u64) -> Option<Command> {
        let is_frozen = self.is_frozen;
        let light = self.by_actor.get_mut(&id)?;
        let secs = match phase {
            light::GREEN => light.secs[0],
            light::YELLOW => light.secs[1],
            light::RED => light.secs[2],
            _ => f32::INFINITY,
        };
        let nanos = (secs.max(0.0) * 1e9) as u64;
        let until = if is_frozen { u64::MAX } else { now.saturating_add(nanos) };
        light.held_until_nanos = Some(until);
        Some(hold(id, phase))
    }

    /// Freezes all lights in their phases, or lets them continue. Returns the commands.
    pub(crate) fn freeze(&mut self, on: bool) -> Vec<Command> {
        self.is_frozen = on;
        let each = self.by_actor.iter_mut().map(|(id, light)| {
            light.held_until_nanos = on.then_some(u64::MAX);
            if on { hold(*id, light.phase) } else { release(*id) }
        });
        each.collect()
    }

    /// Lets traffic control these lights again. Returns the commands.
    pub(crate) fn reset(&mut self, ids: &[u32]) -> Vec<Command> {
        for id in ids {
            if let Some(light) = self.by_actor.get_mut(id) {
                light.held_until_nanos = None;
            }
        }
        ids.iter().map(|id| release(*id)).collect()
    }

    /// Returns the ids of all lights.
    pub(crate) fn ids(&self) -> Vec<u32> {
        self.by_actor.keys().copied().collect()
    }

    /// Returns the commands for lights whose switch has expired.
    pub(crate) fn commands(&mut self, world: &World) -> Vec<Command> {
        let now = world.header().stamp.sim_time_nanos;
        let mut commands = Vec::new();
        for (id, light) in &mut self.by_actor {
            if light.held_until_nanos.is_some_and(|until| now >= until) {
                light.held_until_nanos = None;
                commands.push(release(*id));
            }
        }
        commands
    }
}

fn hold(id: u32, phase: u32) -> Command {
    Command::SetTrafficLight(SetTrafficLight { actor_id: ActorId(id), hold: 1, phase })
}

fn release(id: u32) -> Command {
    Command::SetTrafficLight(SetTrafficLight { actor_id: ActorId(id), hold: 0, phase: 0 })
}
