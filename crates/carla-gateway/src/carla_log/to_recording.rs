//! Converts frames of CARLA's log to the moments of a recording.

use std::collections::BTreeMap;

use client_lib::{
    ActorId,
    carla_axes::CarlaTransform,
    wire::{ActorState, Stamp, flag, kind},
};
use record::RecordedFrame;

use crate::carla_log::frame::{CreatedActor, Frame, NO_ACTOR};

/// A pass over the frames of a log: the last known state of each actor.
#[derive(Default)]
pub struct MomentBuilder {
    there: BTreeMap<u32, ActorState>,
    unknown_blueprints: Vec<String>,
    nanos: u64,
}

impl MomentBuilder {
    /// Returns the moment of the next frame. Actors whose blueprint has no counterpart are omitted,
    /// and so are those with a number that is not finite or beyond 1e10.
    pub fn moment(&mut self, frame: &Frame) -> RecordedFrame {
        let delta_nanos = (frame.duration_s * 1e9).round().clamp(1.0, 1e10) as u64;
        self.nanos += delta_nanos;
        let mut moment = RecordedFrame {
            stamp: Stamp {
                frame: client_lib::Frame(frame.number),
                sim_time_nanos: self.nanos,
                ..Stamp::default()
            },
            delta_nanos,
            substep_max_nanos: delta_nanos,
            ..RecordedFrame::default()
        };
        for id in &frame.destroyed {
            self.there.remove(id);
        }
        for created in &frame.created {
            match initial_state(created) {
                Some(state) => {
                    self.there.insert(created.id, state);
                }
                None => self.unknown_blueprints.push(created.blueprint.clone()),
            }
        }
        self.apply(frame);
        let known = |id: u32| if id == NO_ACTOR { ActorId::NONE } else { ActorId(id) };
        moment.collisions = frame
            .collisions
            .iter()
            .map(|touch| record::Collision {
                actor: known(touch.actors[0]),
                other: known(touch.actors[1]),
                ..record::Collision::default()
            })
            .collect();
        moment.actors = self.there.values().filter(|state| state.is_valid()).copied().collect();
        moment
    }

    /// Returns the blueprints of actors that were omitted.
    pub fn unknown_blueprints(&self) -> &[String] {
        &self.unknown_blueprints
    }

    fn apply(&mut self, frame: &Frame) {
        let there = &mut self.there;
        for place in &frame.places {
            if let Some(state) = there.get_mut(&place.id) {
                state.pose = pose(place.location, place.rotation);
            }
        }
        for motion in &frame.motions {
            if let Some(state) = there.get_mut(&motion.id) {
                let [x, y, z] = motion.velocity;
                state.velocity_mps = [x, 0.0 - y, z];
                let [roll, pitch, yaw] = motion.spin.map(f32::to_radians);
                state.angular_velocity_radps = [roll, 0.0 - pitch, 0.0 - yaw];
            }
        }
        for light in &frame.lights {
            if let Some(state) = there.get_mut(&light.id) {
                state.phase = light.state.into();
                state.flags =
                    state.flags & !flag::FROZEN | if light.frozen { flag::FROZEN } else { 0 };
            }
        }
        for pedals in &frame.pedals {
            if let Some(state) = there.get_mut(&pedals.id) {
                (state.steer, state.throttle) = (0.0 - pedals.steer, pedals.throttle);
                (state.brake, state.gear) = (pedals.brake, pedals.gear);
                let bit = if pedals.handbrake { flag::HANDBRAKE } else { 0 };
                state.flags = state.flags & !flag::HANDBRAKE | bit;
            }
        }
        for (id, lamps) in &frame.lamps {
            if let Some(state) = there.get_mut(id) {
                state.lamps = *lamps;
            }
        }
        for (id, door, open) in &frame.doors {
            if let Some(state) = there.get_mut(id) {
                // CARLA's last door means all doors.
                let bits = if *door < 4 { 1 << door } else { 0xf };
                state.doors = state.doors & !bits | if *open { bits } else { 0 };
            }
        }
    }
}

fn pose(location: [f32; 3], [roll_deg, pitch_deg, yaw_deg]: [f32; 3]) -> client_lib::Pose {
    let location_m = location.map(|cm| cm / 100.0);
    let pose = CarlaTransform { location_m, pitch_deg, yaw_deg, roll_deg }.to_pose();
    if pose.is_valid() { pose } else { client_lib::Pose::IDENTITY }
}

/// Returns the state of an actor when it is spawned. An unknown blueprint is replaced by the
/// default one of its kind.
fn initial_state(created: &CreatedActor) -> Option<ActorState> {
    let (kind, usual) = match created.kind {
        1 => (kind::VEHICLE, "vehicle.tesla.model3"),
        2 => (kind::WALKER, "walker.pedestrian.0001"),
        3 => (kind::TRAFFIC_LIGHT, "traffic.traffic_light"),
        _ => (kind::PROP, ""),
    };
    let (blueprint, _) = town::blueprint(&created.blueprint).or_else(|| town::blueprint(usual))?;
    let color = created.attribute("color").and_then(|text| {
        let parts: Vec<u8> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
        <[u8; 3]>::try_from(parts).ok()
    });
    let grey = if kind == kind::VEHICLE { u32::from_le_bytes([128, 128, 128, 255]) } else { 0 };
    let drives = created.attribute("role_name") == Some("autopilot");
    Some(ActorState {
        actor_id: ActorId(created.id),
        blueprint,
        kind,
        flags: flag::KINEMATIC | if drives { flag::AUTOPILOT } else { 0 },
        pose: pose(created.location, created.rotation),
        color: color.map_or(grey, |[r, g, b]| u32::from_le_bytes([r, g, b, 255])),
        ..ActorState::default()
    })
}
