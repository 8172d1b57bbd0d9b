//! Converts the moments of a recording to frames of CARLA's log.

use std::collections::{BTreeMap, BTreeSet};

use client_lib::{
    ActorId,
    carla_axes::CarlaTransform,
    wire::{ActorState, Command, flag, kind},
};
use record::{RecordedFrame, Recording};

use crate::carla_log::frame::{
    Collision, CreatedActor, Frame, Kinematics, NO_ACTOR, Position, TrafficLight, VehicleAnimation,
};

/// CARLA's types of attributes.
const TEXT: u8 = 3;
const COLOR: u8 = 4;
/// The number of doors of a vehicle.
const DOORS: u8 = 4;

/// A pass over the moments of a recording.
pub(crate) struct FrameBuilder {
    blueprints: Vec<String>,
    roles: BTreeMap<ActorId, String>,
    there: BTreeSet<ActorId>,
    heroes: BTreeSet<ActorId>,
    /// By light: its phase, and since when. Seconds.
    phases: BTreeMap<ActorId, (u32, f64)>,
    lamps: BTreeMap<ActorId, u32>,
    doors: BTreeMap<ActorId, u32>,
    frame: Frame,
}

impl FrameBuilder {
    pub(crate) fn new(recording: &Recording) -> FrameBuilder {
        let info = recording.info();
        FrameBuilder {
            blueprints: info.blueprints.clone(),
            roles: info.roles.iter().cloned().collect(),
            there: BTreeSet::new(),
            heroes: BTreeSet::new(),
            phases: BTreeMap::new(),
            lamps: BTreeMap::new(),
            doors: BTreeMap::new(),
            frame: Frame::default(),
        }
    }

    /// Returns the frame of the next moment. Frames count from 1; time counts from the first frame.
    pub(crate) fn frame(&mut self, moment: &RecordedFrame) -> &Frame {
        let duration_s = moment.delta_nanos as f64 / 1e9;
        let Frame { number, elapsed_s, .. } = self.frame;
        let elapsed_s = if number == 0 { 0.0 } else { elapsed_s + duration_s };
        self.frame = Frame { number: number + 1, duration_s, elapsed_s, ..Frame::default() };
        for entry in moment.journal.iter().filter(|e| e.outcome.result().is_ok()) {
            if let Some(Command::Spawn(spawn)) = entry.command.decode()
                && !spawn.role.as_str().is_empty()
            {
                self.roles.insert(ActorId(entry.outcome.id), spawn.role.to_string());
            }
        }
        self.update_actors(moment);
        let hero = |id: ActorId| self.heroes.contains(&id);
        let collisions = moment.collisions.iter().zip(0..).map(|(hit, id)| Collision {
            id,
            actors: [hit.actor, hit.other]
                .map(|id| if id == ActorId::NONE { NO_ACTOR } else { id.0 }),
            heroes: [hero(hit.actor), hero(hit.other)],
        });
        self.frame.collisions = collisions.collect();
        moment.actors.iter().for_each(|state| self.add_state(state));
        &self.frame
    }

    fn update_actors(&mut self, moment: &RecordedFrame) {
        let now: BTreeSet<_> = moment.actors.iter().map(|a| a.actor_id).collect();
        self.frame.destroyed = self.there.difference(&now).map(|id| id.0).collect();
        for state in moment.actors.iter().filter(|a| !self.there.contains(&a.actor_id)) {
            let id = state.actor_id;
            let place = place(state);
            let autopilot = state.has(flag::AUTOPILOT).then_some("autopilot");
            let role = self.roles.get(&id).map(String::as_str);
            if role == Some("hero") {
                self.heroes.insert(id);
            }
            let mut attributes = Vec::new();
            if state.kind == kind::VEHICLE {
                let [r, g, b, _] = state.color.to_le_bytes();
                attributes.push((COLOR, "color".to_owned(), format!("{r},{g},{b}")));
            }
            if let Some(role) = role.or(autopilot) {
                attributes.push((TEXT, "role_name".to_owned(), role.to_owned()));
            }
            self.frame.created.push(CreatedActor {
                id: id.0,
                kind: kind_of(state),
                location: place.location,
                rotation: place.rotation,
                uid: state.blueprint,
                blueprint: self
                    .blueprints
                    .get(state.blueprint as usize)
                    .cloned()
                    .unwrap_or_default(),
                attributes,
            });
        }
        self.there = now;
    }

    fn add_state(&mut self, state: &ActorState) {
        let (id, frame) = (state.actor_id, &mut self.frame);
        if state.kind == kind::TRAFFIC_LIGHT {
            let since = self.phases.entry(id).or_insert((state.phase, frame.elapsed_s));
            if since.0 != state.phase {
                *since = (state.phase, frame.elapsed_s);
            }
            frame.lights.push(TrafficLight {
                id: id.0,
                frozen: state.has(flag::FROZEN),
                elapsed_s: (frame.elapsed_s - since.1) as f32,
                state: state.phase as u8,
            });
            return;
        }
        frame.places.push(place(state));
        let [x, y, z] = state.velocity_mps;
        let [roll, pitch, yaw] = state.angular_velocity_radps.map(f32::to_degrees);
        let spin = [roll, 0.0 - pitch, 0.0 - yaw];
        frame.motions.push(Kinematics { id: id.0, velocity: [x, 0.0 - y, z], spin });
        match state.kind {
            kind::VEHICLE => {
                frame.pedals.push(VehicleAnimation {
                    id: id.0,
                    steer: 0.0 - state.steer,
                    throttle: state.throttle,
                    brake: state.brake,
                    handbrake: state.has(flag::HANDBRAKE),
                    gear: state.gear,
                });
                if self.lamps.insert(id, state.lamps).unwrap_or(0) != state.lamps {
                    frame.lamps.push((id.0, state.lamps));
                }
                let changed = self.doors.insert(id, state.doors).unwrap_or(0) ^ state.doors;
                let doors = (0..DOORS).filter(|door| changed >> door & 1 != 0);
                frame.doors.extend(doors.map(|door| (id.0, door, state.doors >> door & 1 != 0)));
            }
            kind::WALKER => {
                frame.walkers.push((id.0, state.velocity().truncate().length() * 100.0));
            }
            _ => {}
        }
    }
}

fn place(state: &ActorState) -> Position {
    let turn = CarlaTransform::from_pose(&state.pose);
    Position {
        id: state.actor_id.0,
        location: turn.location_m.map(|m| m * 100.0),
        rotation: [turn.roll_deg, turn.pitch_deg, turn.yaw_deg],
    }
}

fn kind_of(state: &ActorState) -> u8 {
    match state.kind {
        kind::VEHICLE => 1,
        kind::WALKER => 2,
        kind::TRAFFIC_LIGHT => 3,
        _ => 0,
    }
}
