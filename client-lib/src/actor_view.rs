//! An actor of a snapshot, with typed accessors.

use bytemuck::TransparentWrapper;
use glam::Vec3;
use protocol::{ActorId, ActorState, Pose, STRIDE};

use crate::{ActorFlags, ActorKind, Doors, LightPhase, VehicleLights};

/// One actor at one frame, read in the snapshot's own memory.
///
/// World space is right-handed: x east, y north, z up. Vehicle space is x forward, y left, z up, with
/// its origin on the ground below the middle of the wheelbase.
#[derive(Clone, Copy, Debug, PartialEq, TransparentWrapper)]
#[repr(transparent)]
pub struct Actor(ActorState);

impl Actor {
    /// Its id, never reused within an episode.
    #[must_use]
    pub fn id(&self) -> ActorId {
        self.0.actor_id
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> ActorKind {
        ActorKind::from_wire(self.0.kind)
    }

    /// The index of its blueprint in [`Client::blueprints`](crate::Client::blueprints).
    #[must_use]
    pub fn blueprint(&self) -> usize {
        self.0.blueprint as usize
    }

    /// Its states.
    #[must_use]
    pub fn flags(&self) -> ActorFlags {
        ActorFlags::from_bits_truncate(self.0.flags)
    }

    /// `world_from_actor`.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.0.pose
    }

    /// The position of its origin in world space, metres.
    #[must_use]
    pub fn position(&self) -> Vec3 {
        self.0.pose.position()
    }

    /// The velocity of its origin in world space, m/s.
    #[must_use]
    pub fn velocity(&self) -> Vec3 {
        self.0.velocity()
    }

    /// Its speed, m/s.
    #[must_use]
    pub fn speed_mps(&self) -> f32 {
        self.0.velocity().length()
    }

    /// Its angular velocity in world space, rad/s.
    #[must_use]
    pub fn angular_velocity(&self) -> Vec3 {
        Vec3::from_array(self.0.angular_velocity_radps)
    }

    /// Its mean acceleration over the frame in world space, without gravity, m/s².
    #[must_use]
    pub fn acceleration(&self) -> Vec3 {
        Vec3::from_array(self.0.acceleration_mps2)
    }

    /// Its paint: red, green, blue, sRGB.
    #[must_use]
    pub fn color(&self) -> [u8; 3] {
        let [r, g, b, _] = self.0.color.to_le_bytes();
        [r, g, b]
    }

    /// What only vehicles have.
    #[must_use]
    pub fn vehicle(&self) -> Option<VehicleState> {
        (self.kind() == ActorKind::Vehicle).then(|| VehicleState {
            throttle: self.0.throttle,
            brake: self.0.brake,
            steer: self.0.steer,
            gear: self.0.gear,
            engine_rpm: self.0.engine_rpm,
            wheel_steer_rad: self.0.wheel_steer_rad,
            wheel_spin_rad: self.0.wheel_spin_rad,
            lights: VehicleLights::from_bits_truncate(self.0.lamps),
            doors: Doors::from_bits_truncate(self.0.doors),
        })
    }

    /// What only traffic lights have.
    #[must_use]
    pub fn traffic_light(&self) -> Option<TrafficLightState> {
        (self.kind() == ActorKind::TrafficLight).then(|| TrafficLightState {
            phase: LightPhase::from_wire(self.0.phase),
            is_held: self.flags().contains(ActorFlags::FROZEN),
            signal: self.0.signal as usize,
        })
    }

    /// How much of a walker's stride is done, 0 to 1.
    #[must_use]
    pub fn stride(&self) -> Option<f32> {
        (self.kind() == ActorKind::Walker).then(|| self.0.phase as f32 / STRIDE as f32)
    }
}

/// What only vehicles have.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VehicleState {
    /// Accelerator pedal, 0 to 1.
    pub throttle: f32,
    /// Brake pedal, 0 to 1.
    pub brake: f32,
    /// Steering wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Engine speed, revolutions per minute.
    pub engine_rpm: f32,
    /// Angle of the front wheels, positive to the left, rad.
    pub wheel_steer_rad: f32,
    /// Rotation of the wheels modulo one turn, rad.
    pub wheel_spin_rad: f32,
    /// Lights that are on.
    pub lights: VehicleLights,
    /// Doors that are open.
    pub doors: Doors,
}

/// What only traffic lights have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TrafficLightState {
    /// What it shows.
    pub phase: LightPhase,
    /// Whether a client holds it at this phase.
    pub is_held: bool,
    /// Its signal: an index into `road::Network::signals`.
    pub signal: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actor_has_only_the_state_of_its_kind() {
        let car = ActorState { kind: protocol::kind::VEHICLE, doors: 2, ..ActorState::default() };
        let car = Actor::wrap_ref(&car);
        assert_eq!(car.vehicle().unwrap().doors, Doors::FRONT_RIGHT);
        assert_eq!((car.traffic_light(), car.stride()), (None, None));
        let light = ActorState {
            kind: protocol::kind::TRAFFIC_LIGHT,
            phase: protocol::light::GREEN,
            flags: protocol::flag::FROZEN,
            ..ActorState::default()
        };
        let state = Actor::wrap_ref(&light).traffic_light().unwrap();
        assert_eq!((state.phase, state.is_held), (LightPhase::Green, true));
    }
}
