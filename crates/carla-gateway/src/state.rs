//! The message of stream 1: the state of every actor at one frame.

use client_lib::{
    Pose,
    wire::{ActorState, flag, light},
};

use crate::{
    motion::WalkerControl,
    wire::{Bytes, flip, flip_turn, message},
};

/// The type of the message; a client reads a message of an unknown type as an image.
const TYPE: u64 = 17;
const HEADER: usize = 36;
const ACTOR: usize = 119;
/// The offset of the part whose meaning depends on the kind of actor. Bytes.
const UNION: usize = 65;

/// The contents of the header beside the frame.
pub(crate) struct Moment {
    pub(crate) frame: u64,
    pub(crate) sim_time_nanos: u64,
    pub(crate) delta_nanos: u64,
    pub(crate) episode: u64,
    /// Wall-clock time since the server started. Seconds.
    pub(crate) platform_secs: f64,
    /// The map has changed.
    pub(crate) is_new_map: bool,
    /// Street lights have changed.
    pub(crate) has_new_lights: bool,
}

/// The speed limit and the traffic light that apply to a vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RoadContext {
    pub(crate) speed_limit_kmh: f32,
    /// The light at whose stop line the vehicle is, and its phase.
    pub(crate) light: Option<(u32, u32)>,
}

/// The timing of a traffic light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Timing {
    pub(crate) green_secs: f32,
    pub(crate) yellow_secs: f32,
    pub(crate) red_secs: f32,
    pub(crate) elapsed_secs: f32,
    pub(crate) is_frozen: bool,
}

/// A message that is being written.
pub(crate) struct StateMessage {
    bytes: Bytes,
}

impl StateMessage {
    pub(crate) fn new(moment: &Moment, spectator: &Pose, actors: usize) -> StateMessage {
        let body = HEADER + ACTOR * actors;
        let mut bytes = message(TYPE, moment.frame, moment.sim_time_nanos, spectator, body);
        bytes.put(moment.episode.to_le_bytes()).put(moment.platform_secs.to_le_bytes());
        bytes.f32((moment.delta_nanos as f64 * 1e-9) as f32).put([0; 12]);
        bytes.u32(u32::from(moment.is_new_map) | u32::from(moment.has_new_lights) << 1);
        StateMessage { bytes }
    }

    /// Appends an actor without state of its own: a sensor, a traffic sign, the spectator.
    pub(crate) fn fixture(&mut self, id: u32, pose: &Pose, velocity: [f32; 3], sign: &str) {
        self.bytes.u32(id).put([1]).transform(pose).vector(flip(velocity)).put([0; 24]);
        self.sign(sign);
        self.bytes.put([0; ACTOR - UNION - 32]);
    }

    /// Appends an actor of the bus without state of its own.
    pub(crate) fn actor(&mut self, actor: &ActorState) {
        self.moving(actor);
        self.bytes.put([0; ACTOR - UNION]);
    }

    /// Appends a walker with the control that a client has applied; without one, with its motion.
    pub(crate) fn walker(&mut self, actor: &ActorState, control: Option<&WalkerControl>) {
        self.moving(actor);
        let measured = || {
            let velocity = actor.velocity();
            let direction = velocity.normalize_or_zero();
            WalkerControl { direction, speed_mps: velocity.length(), jumps: false }
        };
        let control = control.copied().unwrap_or_else(measured);
        self.bytes.vector(flip(control.direction.to_array())).f32(control.speed_mps);
        self.bytes.put([control.jumps.into()]).put([0; ACTOR - UNION - 17]);
    }

    /// Appends a traffic light.
    pub(crate) fn light(&mut self, actor: &ActorState, sign: &str, pole: u32, timing: &Timing) {
        self.moving(actor);
        self.sign(sign);
        let Timing { green_secs, yellow_secs, red_secs, elapsed_secs, is_frozen } = *timing;
        self.bytes.f32(green_secs).f32(yellow_secs).f32(red_secs).f32(elapsed_secs);
        self.bytes.u32(pole).put([is_frozen.into(), light_state(actor.phase)]);
    }

    fn moving(&mut self, actor: &ActorState) {
        let turn = flip_turn(actor.angular_velocity_radps).map(f32::to_degrees);
        self.bytes.u32(actor.actor_id.0).put([1]).transform(&actor.pose);
        self.bytes.vector(flip(actor.velocity_mps)).vector(turn);
        self.bytes.vector(flip(actor.acceleration_mps2));
    }

    /// Appends a vehicle with CARLA's number of its failure state.
    pub(crate) fn vehicle(&mut self, actor: &ActorState, road_context: RoadContext, failure: u8) {
        self.moving(actor);
        let is = |bit: u32| u8::from(actor.has(bit));
        self.bytes.f32(actor.throttle).f32(-actor.steer).f32(actor.brake);
        self.bytes.put([is(flag::HANDBRAKE), is(flag::REVERSE), is(flag::MANUAL_GEAR)]);
        self.bytes.put(actor.gear.to_le_bytes()).f32(road_context.speed_limit_kmh);
        let (id, phase) = road_context.light.unwrap_or((0, light::GREEN));
        self.bytes.put([light_state(phase), road_context.light.is_some().into()]).u32(id);
        self.bytes.put([failure]).put([0; ACTOR - UNION - 30]);
    }

    fn sign(&mut self, id: &str) {
        let mut name = [0; 32];
        // The last byte stays zero.
        let len = id.len().min(31);
        name[..len].copy_from_slice(&id.as_bytes()[..len]);
        self.bytes.put(name);
    }

    pub(crate) fn into_message(self) -> crate::stream::Message {
        self.bytes.into_message()
    }
}

/// Returns CARLA's number of a phase.
pub(crate) fn light_state(phase: u32) -> u8 {
    match phase {
        light::RED => 0,
        light::YELLOW => 1,
        light::GREEN => 2,
        light::OFF => 3,
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_actor_takes_119_bytes() {
        let moment = Moment {
            frame: 7,
            sim_time_nanos: 0,
            delta_nanos: 50_000_000,
            episode: 1,
            platform_secs: 0.0,
            is_new_map: false,
            has_new_lights: false,
        };
        let timing = Timing {
            green_secs: 1.0,
            yellow_secs: 1.0,
            red_secs: 1.0,
            elapsed_secs: 0.0,
            is_frozen: false,
        };
        let mut state = StateMessage::new(&moment, &Pose::IDENTITY, 5);
        let long = "a name that is much longer than thirty-two bytes";
        state.fixture(1, &Pose::IDENTITY, [0.0; 3], long);
        state.light(&ActorState::default(), long, 0, &timing);
        state.vehicle(&ActorState::default(), RoadContext::default(), 1);
        state.walker(&ActorState::default(), None);
        state.actor(&ActorState::default());
        let message = state.into_message();
        assert_eq!(message.len(), 4 + 48 + HEADER + 5 * ACTOR);
        assert_eq!(message[..4], ((message.len() - 4) as u32).to_le_bytes());
        assert_eq!(message[4], 17);
    }
}
