//! What the gateway keeps about one episode. Another episode begins with a new one.

use std::{collections::BTreeMap, sync::Arc};

use client_lib::{
    Pose, World,
    wire::{Command, StandingState},
};
use road::Network;

use crate::{
    dead_ends::DeadEnds, friction::FrictionTriggers, motion::Motions,
    physics_control::PhysicsControl, proxy_actors::ProxyActors, replay::Replayer, respawn::Respawn,
    road_context::RoadContexts, rollover::Rollovers, street_lights::StreetLights,
    traffic_lights::TrafficLights, weather::CarlaWeather,
};

/// Frames after a spawn by which a snapshot must show the actor.
const SPAWN_FRAMES: u64 = 3;

/// The state of one episode as CARLA's clients see it.
pub(crate) struct EpisodeState {
    /// The number of the episode, as clients see it.
    pub(crate) number: u64,
    pub(crate) actors: ProxyActors,
    pub(crate) spawned: RecentSpawns,
    pub(crate) traffic_lights: TrafficLights,
    pub(crate) street_lights: StreetLights,
    pub(crate) road_contexts: RoadContexts,
    pub(crate) rollovers: Rollovers,
    pub(crate) friction: FrictionTriggers,
    /// Weather, street lights and whatever else persists in the world.
    pub(crate) standing: StandingState,
    /// The weather that a client of CARLA has set last, in CARLA's numbers.
    pub(crate) weather: Option<CarlaWeather>,
    pub(crate) motions: Motions,
    pub(crate) replayer: Replayer,
    pub(crate) respawn: Respawn,
    pub(crate) dead_ends: DeadEnds,
    pub(crate) vehicles: VehicleSwitches,
    /// The next snapshot informs clients that the map has changed.
    pub(crate) is_new_map: bool,
    /// The next snapshot informs clients that street lights were switched.
    pub(crate) has_new_lights: bool,
}

impl EpisodeState {
    /// Creates the state of an episode that has just begun.
    pub(crate) fn new(number: u64, network: &Arc<Network>, actors: ProxyActors) -> EpisodeState {
        EpisodeState {
            number,
            actors,
            spawned: RecentSpawns::default(),
            traffic_lights: TrafficLights::new(network),
            street_lights: StreetLights::default(),
            road_contexts: RoadContexts::new(network),
            rollovers: Rollovers::default(),
            friction: FrictionTriggers::default(),
            standing: StandingState::default(),
            weather: None,
            motions: Motions::default(),
            replayer: Replayer::default(),
            respawn: Respawn::default(),
            dead_ends: DeadEnds::default(),
            vehicles: VehicleSwitches::default(),
            is_new_map: false,
            has_new_lights: false,
        }
    }

    /// Returns the commands by which motions and switched lights hold for another frame.
    pub(crate) fn commands(&mut self, world: &World) -> Vec<Command> {
        let mut commands = self.motions.commands(world);
        commands.extend(self.traffic_lights.commands(world));
        commands
    }
}

/// Actors that were spawned and that no snapshot shows yet.
#[derive(Default)]
pub(crate) struct RecentSpawns {
    /// By actor: the last frame at which its absence is expected, and its pose.
    by_actor: BTreeMap<u32, (u64, Pose)>,
}

impl RecentSpawns {
    /// Adds an actor that was spawned at `frame`.
    pub(crate) fn add(&mut self, id: u32, frame: u64, pose: Pose) {
        self.by_actor.insert(id, (frame + SPAWN_FRAMES, pose));
    }

    /// Returns where an actor was spawned.
    pub(crate) fn pose(&self, id: u32) -> Option<Pose> {
        self.by_actor.get(&id).map(|(_, pose)| *pose)
    }

    /// Returns whether an actor was spawned recently.
    pub(crate) fn contains(&self, id: u32) -> bool {
        self.by_actor.contains_key(&id)
    }

    /// Drops the actors that a snapshot of this frame must show.
    pub(crate) fn expire(&mut self, frame: u64) {
        self.by_actor.retain(|_, (until, _)| *until > frame);
    }
}

/// What clients have set on vehicles and no snapshot shows: lights and doors that were just
/// switched, and physics controls in CARLA's numbers.
#[derive(Default)]
pub(crate) struct VehicleSwitches {
    /// By vehicle: its lights, and how many frames ago they were switched.
    lights: BTreeMap<u32, (u32, u32)>,
    /// By vehicle: its open doors, one bit each.
    doors: BTreeMap<u32, u32>,
    /// By vehicle: the last physics control that a client has set.
    physics: BTreeMap<u32, PhysicsControl>,
}

impl VehicleSwitches {
    /// Returns the lights of a vehicle that were just switched.
    pub(crate) fn lights(&self, id: u32) -> Option<u32> {
        self.lights.get(&id).map(|(lights, _)| *lights)
    }

    /// Sets the lights of a vehicle.
    pub(crate) fn set_lights(&mut self, id: u32, lights: u32) {
        self.lights.insert(id, (lights, 0));
    }

    /// Returns the doors of a vehicle, if a client has moved one.
    pub(crate) fn doors(&self, id: u32) -> Option<u32> {
        self.doors.get(&id).copied()
    }

    /// Sets the open doors of a vehicle.
    pub(crate) fn set_doors(&mut self, id: u32, doors: u32) {
        self.doors.insert(id, doors);
    }

    /// Returns the last physics control that a client has set.
    pub(crate) fn physics(&self, id: u32) -> Option<&PhysicsControl> {
        self.physics.get(&id)
    }

    /// Sets the physics control of a vehicle.
    pub(crate) fn set_physics(&mut self, id: u32, control: PhysicsControl) {
        self.physics.insert(id, control);
    }

    /// Forgets a vehicle that was destroyed.
    pub(crate) fn remove(&mut self, id: u32) {
        self.lights.remove(&id);
        self.doors.remove(&id);
        self.physics.remove(&id);
    }

    /// Ages the lights by a frame and drops those older than `keep` frames.
    pub(crate) fn age_lights(&mut self, keep: u32) {
        self.lights.retain(|_, (_, age)| {
            *age += 1;
            *age <= keep
        });
    }
}
