//! Teleports actors, sets their velocities, and controls walkers.

use client_lib::{
    ActorId, Pose,
    wire::{ActorState, Command, SetPhysics, SetVelocity, Teleport, flag},
};
use glam::Vec3;

use crate::{
    args::{Args, RpcError},
    bridge::Bridge,
    calls::{actors::unknown, call::Call},
    motion::WalkerControl,
    proxy_actors::{PROXY_MAX_M, ProxyActors},
    shared_bridge::LockedBridge,
    wire::{flip_turn, location, transform as read_transform},
};

pub(super) fn transform(call: &mut Call) -> Result<(), RpcError> {
    let (id, pose) = (call.args.u32()?, read_transform(&mut call.args)?);
    call.bridge.teleport(id, pose)
}

pub(super) fn locate(call: &mut Call) -> Result<(), RpcError> {
    let (id, to) = (call.args.u32()?, location(&mut call.args)?);
    call.bridge.move_to(id, to)
}

pub(super) fn target_velocity(call: &mut Call) -> Result<(), RpcError> {
    let (id, velocity) = (call.args.u32()?, location(&mut call.args)?);
    call.bridge.set_velocity(id, velocity)
}

pub(super) fn target_angular_velocity(call: &mut Call) -> Result<(), RpcError> {
    let (id, turn) = (call.args.u32()?, call.args.vector()?);
    call.bridge.set_angular_velocity(id, turn)
}

pub(super) fn hold(call: &mut Call) -> Result<(), RpcError> {
    let (id, velocity) = (call.args.u32()?, location(&mut call.args)?);
    if !call.bridge.exists(id) {
        return Err(unknown("enable_actor_constant_velocity", id));
    }
    call.bridge.episode.motions.hold(id, velocity);
    Ok(())
}

/// Ends a constant velocity.
pub(super) fn release(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.episode.motions.release(id);
    Ok(())
}

pub(super) fn walk(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let mut control = call.args.list()?;
    call.bridge.apply_walker_control(id, &mut control)
}

pub(super) fn walker_state(call: &mut Call) -> Result<(), RpcError> {
    let (id, pose) = (call.args.u32()?, read_transform(&mut call.args)?);
    let speed_mps = call.args.f32()?;
    call.bridge.set_walker_state(id, pose, speed_mps)
}

pub(super) fn simulate_physics(call: &mut Call) -> Result<(), RpcError> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    call.bridge.set_simulate_physics(id, on)
}

impl LockedBridge<'_> {
    /// Sets whether physics moves an actor, or only its client.
    pub(crate) fn set_simulate_physics(&mut self, id: u32, on: bool) -> Result<(), RpcError> {
        if ProxyActors::is_proxy(id) {
            return Ok(());
        }
        let command = Command::SetPhysics(SetPhysics { actor_id: ActorId(id), on: on.into() });
        self.request_one("physics", command).map(drop)
    }

    /// Returns the id of an actor's blueprint.
    pub(crate) fn blueprint_id(&mut self, id: u32) -> Option<String> {
        let Bridge { episode, client, .. } = &mut **self;
        let actor = episode.actors.actor(id, client.world(), client.blueprints())?;
        Some(actor.description.id.clone())
    }

    fn existing_state(&self, id: u32) -> Result<ActorState, RpcError> {
        self.actor_state(id).ok_or_else(|| unknown("actor", id))
    }

    /// Moves a walker so that it is at this pose after the next step, walking at this speed. A
    /// fallen walker lies until it is removed or stands up, whatever its controller plans.
    pub(crate) fn set_walker_state(
        &mut self,
        id: u32,
        pose: Pose,
        speed_mps: f32,
    ) -> Result<(), RpcError> {
        if self.actor_state(id).is_some_and(|state| state.has(flag::FALLEN)) {
            return Ok(());
        }
        let velocity = pose.rotation() * Vec3::X * speed_mps;
        let step = velocity * (self.client.wire_settings().delta_nanos as f32 * 1e-9);
        self.teleport(id, Pose::new(pose.position() - step, pose.rotation()))?;
        self.set_velocity(id, velocity)?;
        let direction = pose.rotation() * Vec3::X;
        self.episode.motions.walk(id, WalkerControl { direction, speed_mps, jumps: false });
        Ok(())
    }

    /// Teleports an actor, which is at rest afterwards. The pose of a proxy is relative to its
    /// parent.
    pub(crate) fn teleport(&mut self, id: u32, pose: Pose) -> Result<(), RpcError> {
        if !ProxyActors::is_proxy(id) {
            if !self.exists(id) {
                return Err(unknown("set_actor_transform", id));
            }
            self.command(Command::Teleport(Teleport { actor_id: ActorId(id), pose }));
            return Ok(());
        }
        pose.check(PROXY_MAX_M)?;
        self.episode.actors.proxy_mut(id)?.pose = pose;
        self.episode.friction.place(id, pose);
        // A bundle is created with the pose of its sensor in the world; the former one is destroyed
        // here.
        let proxies = &mut self.episode.actors.proxies;
        let moved = proxies.iter_mut().filter(|(one, proxy)| **one == id || proxy.parent == id);
        let with_bundle: Vec<u32> = moved
            .filter_map(|(one, proxy)| proxy.sensor.as_mut()?.bundle.take().map(|_| *one))
            .collect();
        with_bundle.into_iter().try_for_each(|one| self.create_bundle(one))
    }

    pub(crate) fn move_to(&mut self, id: u32, to: Vec3) -> Result<(), RpcError> {
        let now = match self.episode.actors.proxies.get(&id) {
            Some(proxy) => proxy.pose,
            None => self.existing_state(id)?.pose,
        };
        self.teleport(id, Pose::new(to, now.rotation()))
    }

    pub(crate) fn set_velocity(&mut self, id: u32, velocity: Vec3) -> Result<(), RpcError> {
        let turn = self.actor_state(id).map_or([0.0; 3], |actor| actor.angular_velocity_radps);
        self.queue_velocity(id, velocity, Vec3::from_array(turn))
    }

    /// Sets an angular velocity: degrees per second in CARLA's axes.
    pub(crate) fn set_angular_velocity(&mut self, id: u32, turn: [f32; 3]) -> Result<(), RpcError> {
        let velocity = self.actor_state(id).map_or(Vec3::ZERO, |actor| actor.velocity());
        self.queue_velocity(id, velocity, Vec3::from_array(flip_turn(turn.map(f32::to_radians))))
    }

    fn queue_velocity(&mut self, id: u32, velocity: Vec3, turn: Vec3) -> Result<(), RpcError> {
        if !self.exists(id) {
            return Err(unknown("set_actor_target_velocity", id));
        }
        self.command(Command::SetVelocity(SetVelocity {
            actor_id: ActorId(id),
            velocity_mps: velocity.to_array(),
            angular_velocity_radps: turn.to_array(),
        }));
        Ok(())
    }

    /// Lets a walker move with a velocity until another control, and jump if the control says so.
    pub(crate) fn apply_walker_control(
        &mut self,
        id: u32,
        control: &mut Args,
    ) -> Result<(), RpcError> {
        let (direction, speed_mps) = (location(control)?, control.f32()?);
        let jumps = control.bool()?;
        let velocity = direction.normalize_or_zero() * speed_mps;
        if !self.exists(id) {
            return Err(unknown("apply_control_to_walker", id));
        }
        self.episode.motions.walk(id, WalkerControl { direction, speed_mps, jumps });
        if jumps {
            self.command(Command::Jump(ActorId(id)));
        }
        self.command(Command::SetVelocity(SetVelocity {
            actor_id: ActorId(id),
            velocity_mps: velocity.to_array(),
            angular_velocity_radps: [0.0; 3],
        }));
        Ok(())
    }
}
