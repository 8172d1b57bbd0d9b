//! Commands for batches.

use std::path::Path;

use glam::Vec3;
use protocol::{
    ActorId, Autopilot, FilePath, LoadMap, Nothing, Pose, SetDoors, SetPhysics, SetTrafficLight,
    SetVehicleLights, SetVelocity, StartRecorder, StartReplay, StopReplay, Teleport, Weather, load,
};

use crate::{
    ClientError, Doors, Layers, LightPhase, Profile, Replay, TrafficParam, VehicleLights,
    file::{absolute, saved_path, wire_path},
};

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

    /// Loads a map in the place of the world, or the running map again if `name` is empty. Its
    /// outcome is the number of the new world.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if the path is too long.
    pub fn load_world(
        name: &str,
        seed: Option<u64>,
        hidden_layers: Layers,
    ) -> Result<Command, ClientError> {
        let path = Path::new(name);
        let is_path = name.ends_with(".xodr") || path.is_absolute();
        let map = match name {
            "" => FilePath::default(),
            _ if is_path && path.exists() => wire_path(&absolute(path)?)?,
            _ => wire_path(path)?,
        };
        Ok(Command(protocol::Command::LoadMap(LoadMap {
            map,
            seed: seed.unwrap_or_default(),
            hidden_layers: hidden_layers.bits(),
            flags: if seed.is_some() { load::SEED } else { 0 },
        })))
    }

    /// Records from the next frame on.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if the name is empty or its path too long.
    pub fn start_recorder(name: &str, profile: Profile) -> Result<Command, ClientError> {
        let path = wire_path(&saved_path(name)?)?;
        let start = StartRecorder { path, profile: profile as u32, reserved: 0 };
        Ok(Command(protocol::Command::StartRecorder(start)))
    }

    /// Closes the recording. Its outcome is the number of recorded frames.
    pub fn stop_recorder() -> Command {
        Command(protocol::Command::StopRecorder(Nothing::default()))
    }

    /// Replays a recording beside the actors that exist.
    ///
    /// # Errors
    ///
    /// [`ClientError::BadArgument`] if the name is empty or its path too long.
    pub fn start_replay(name: &str, replay: Replay) -> Result<Command, ClientError> {
        let nanos = |seconds: f64| (seconds * 1e9) as i64;
        Ok(Command(protocol::Command::StartReplay(StartReplay {
            path: wire_path(&saved_path(name)?)?,
            from_nanos: nanos(replay.from_s),
            duration_nanos: nanos(replay.duration_s).max(0) as u64,
            time_factor: replay.time_factor,
            ignore_hero: replay.ignore_hero.into(),
        })))
    }

    /// Ends the replay; its actors stay or are destroyed.
    pub fn stop_replay(keep_actors: bool) -> Command {
        let stop = StopReplay { keep_actors: keep_actors.into(), reserved: 0 };
        Command(protocol::Command::StopReplay(stop))
    }

    /// Sets sun, clouds, rain and fog.
    pub fn set_weather(weather: Weather) -> Command {
        Command(protocol::Command::SetWeather(weather))
    }
}
