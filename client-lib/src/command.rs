//! Commands for batches.

use glam::Vec3;
use protocol::{
    ActorId, Autopilot, Pose, SetDoors, SetPhysics, SetTrafficLight, SetVehicleLights, SetVelocity,
    Teleport, Weather,
};

use crate::{Doors, LightPhase, TrafficParam, VehicleLights};

/// A command to the world, for [`Client::request`](crate::Client::request),
/// [`submit`](crate::Client::submit) and [`send`](crate::Client::send). Each constructor is the
/// command of the [`Client`](crate::Client) method of the same name, where its errors stand.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a command acts when it is sent"]
pub struct Command(pub(crate) protocol::Command);

impl From<protocol::Command> for Command {
    fn from(command: protocol::Command) -> Command {
        Command(command)
    }
}

impl Command {
    /// Destroys an actor.
    pub fn destroy(actor_id: ActorId) -> Command {
        Command(protocol::Command::Destroy(actor_id))
    }

    /// Moves an actor to `world_from_actor`, at rest.
    pub fn teleport(actor_id: ActorId, pose: Pose) -> Command {
        Command(protocol::Command::Teleport(Teleport { actor_id, pose }))
    }

    /// Sets an actor's velocity (m/s) and angular velocity (rad/s), both in world space.
    pub fn set_velocity(actor_id: ActorId, velocity: Vec3, angular_velocity: Vec3) -> Command {
        Command(protocol::Command::SetVelocity(SetVelocity {
            actor_id,
            velocity_mps: velocity.to_array(),
            angular_velocity_radps: angular_velocity.to_array(),
        }))
    }

    /// Lets teleports and set velocities alone move an actor, or physics again.
    pub fn set_kinematic(actor_id: ActorId, is_kinematic: bool) -> Command {
        let on = (!is_kinematic).into();
        Command(protocol::Command::SetPhysics(SetPhysics { actor_id, on }))
    }

    /// Hands an actor to traffic, or takes it back.
    pub fn set_autopilot(actor_id: ActorId, on: bool) -> Command {
        Command(protocol::Command::Autopilot(Autopilot { actor_id, on: on.into() }))
    }

    /// Switches a vehicle's lights: those that are named on, all others off.
    pub fn set_vehicle_lights(actor_id: ActorId, lights: VehicleLights) -> Command {
        let lamps = lights.bits();
        Command(protocol::Command::SetVehicleLights(SetVehicleLights { actor_id, lamps }))
    }

    /// Opens a vehicle's doors that are named and closes all others.
    pub fn set_doors(actor_id: ActorId, open: Doors) -> Command {
        Command(protocol::Command::SetDoors(SetDoors { actor_id, open: open.bits() }))
    }

    /// Holds a traffic light at a phase.
    pub fn hold_light(actor_id: ActorId, phase: LightPhase) -> Command {
        let phase = phase as u32;
        Command(protocol::Command::SetTrafficLight(SetTrafficLight { actor_id, hold: 1, phase }))
    }

    /// Lets a traffic light show what traffic plans.
    pub fn release_light(actor_id: ActorId) -> Command {
        let light = SetTrafficLight { actor_id, hold: 0, phase: 0 };
        Command(protocol::Command::SetTrafficLight(light))
    }

    /// Sets how a vehicle on autopilot drives; [`ActorId::NONE`] stands for all.
    pub fn set_traffic_param(actor_id: ActorId, param: TrafficParam) -> Command {
        Command(protocol::Command::TrafficParam(param.to_wire(actor_id)))
    }

    /// Sets sun, clouds, rain and fog.
    pub fn set_weather(weather: Weather) -> Command {
        Command(protocol::Command::SetWeather(weather))
    }
}
