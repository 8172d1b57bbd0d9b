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
    signals: Vec<SignalOfMap>,
    by_actor: BTreeMap<u32, Light>,
    pub(crate) is_frozen: bool,
}

/// What does not change about a signal.
struct SignalOfMap {
    /// The OpenDRIVE id.
    id: String,
    group: Option<Group>,
}

/// The lights that belong together. In CARLA these are all lights of a junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Group {
    Junction(u32),
    /// The controller of lights that belong to no junction.
    Controller(u32),
}

/// The state of one light box.
#[derive(Clone, Copy, Debug)]
struct Light {
    signal: u32,
    phase: u32,
    since_nanos: u64,
    /// The index of the light in its group.
    pole: u32,
    /// The durations of green, yellow and red that clients have set, or the defaults. Seconds.
    secs: [f32; 3],
    /// The client's switch that holds; `None`: traffic controls the light.
    held: Option<Hold>,
}

/// CARLA's state of a light that shows nothing of which it would know the meaning.
pub(crate) const UNKNOWN: u32 = 4;

/// A phase that a client has commanded. Snapshots show it from the next frame on.
#[derive(Clone, Copy, Debug)]
struct Hold {
    phase: u32,
    /// Simulated time.
    until_nanos: u64,
}

impl TrafficLights {
    pub(crate) fn new(network: &Network) -> TrafficLights {
        let signals = network.signals().iter().map(|signal| {
            let junction = network.junction_of(signal).map(Group::Junction);
            let group = junction.or(signal.controller.map(Group::Controller));
            SignalOfMap { id: signal.id.clone(), group }
        });
        TrafficLights { signals: signals.collect(), by_actor: BTreeMap::new(), is_frozen: false }
    }

    /// Takes over the phases of a frame.
    pub(crate) fn follow(&mut self, world: &World) {
        let now = world.header().stamp.sim_time_nanos;
        let count = self.by_actor.len();
        for actor in world.states().iter().filter(|a| a.kind == kind::TRAFFIC_LIGHT) {
            let light = self.by_actor.entry(actor.actor_id.0).or_insert(Light {
                signal: actor.signal,
                phase: actor.phase,
                since_nanos: now,
                pole: 0,
                secs: [GREEN_SECS, YELLOW_SECS, RED_SECS],
                held: None,
            });
            if light.phase != actor.phase {
                (light.phase, light.since_nanos) = (actor.phase, now);
            }
        }
        if self.by_actor.len() > count {
            self.number_poles();
        }
    }

    fn number_poles(&mut self) {
        for id in self.ids() {
            let before = self.group(id).into_iter().take_while(|member| *member != id).count();
            if let Some(light) = self.by_actor.get_mut(&id) {
                light.pole = before as u32;
            }
        }
    }

    /// Returns the name of a light, its index in its group, and its timing.
    pub(crate) fn of(&self, actor: &ActorState, moment: &Moment) -> (&str, u32, Timing) {
        let name = self.signals.get(actor.signal as usize).map_or("", |s| s.id.as_str());
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
        (name, light.map_or(0, |l| l.pole), timing)
    }

    /// Returns the phase that clients see: a light that they have switched to the unknown state is off.
    pub(crate) fn phase(&self, actor: &ActorState) -> u32 {
        let held = self.by_actor.get(&actor.actor_id.0).and_then(|light| light.held);
        match held {
            Some(Hold { phase: UNKNOWN, .. }) if actor.phase == light::OFF => UNKNOWN,
            _ => actor.phase,
        }
    }

    /// Returns the lights of the same junction, including the light itself, by id.
    pub(crate) fn group(&self, id: u32) -> Vec<u32> {
        let group = |light: &Light| self.signals.get(light.signal as usize).and_then(|s| s.group);
        let Some(own) = self.by_actor.get(&id) else { return Vec::new() };
        let Some(own) = group(own) else { return vec![id] };
        let members = self.by_actor.iter().filter(|(_, light)| group(light) == Some(own));
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
        let until_nanos = if is_frozen { u64::MAX } else { now.saturating_add(nanos) };
        light.held = Some(Hold { phase, until_nanos });
        Some(hold(id, phase))
    }

    /// Freezes all lights in the phases that were commanded last or that they show, or lets them
    /// continue. Returns the commands.
    pub(crate) fn freeze(&mut self, on: bool) -> Vec<Command> {
        self.is_frozen = on;
        let each = self.by_actor.iter_mut().map(|(id, light)| {
            let phase = light.held.map_or(light.phase, |held| held.phase);
            light.held = on.then_some(Hold { phase, until_nanos: u64::MAX });
            if on { hold(*id, phase) } else { release(*id) }
        });
        each.collect()
    }

    /// Lets traffic control these lights again. Returns the commands.
    pub(crate) fn reset(&mut self, ids: &[u32]) -> Vec<Command> {
        for id in ids {
            if let Some(light) = self.by_actor.get_mut(id) {
                light.held = None;
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
            if light.held.is_some_and(|held| now >= held.until_nanos) {
                light.held = None;
                commands.push(release(*id));
            }
        }
        commands
    }
}

fn hold(id: u32, phase: u32) -> Command {
    let phase = if phase == UNKNOWN { light::OFF } else { phase };
    Command::SetTrafficLight(SetTrafficLight { actor_id: ActorId(id), hold: 1, phase })
}

fn release(id: u32) -> Command {
    Command::SetTrafficLight(SetTrafficLight { actor_id: ActorId(id), hold: 0, phase: 0 })
}
