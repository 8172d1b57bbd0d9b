//! What clients have told actors to do, and holds until they say otherwise: constant velocities, and
//! the controls of walkers.

use std::collections::BTreeMap;

use client_lib::{
    ActorId, World,
    wire::{Command, SetVelocity},
};
use glam::Vec3;

/// A control of a walker, as a client has applied it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WalkerControl {
    /// Of any length.
    pub(crate) direction: Vec3,
    pub(crate) speed_mps: f32,
    pub(crate) jumps: bool,
}

/// The actors that move with a constant velocity, and the controls of walkers.
#[derive(Debug, Default)]
pub(crate) struct Motions {
    /// Metres per second in the actor's own space.
    constant: BTreeMap<u32, Vec3>,
    walkers: BTreeMap<u32, WalkerControl>,
}

impl Motions {
    pub(crate) fn hold(&mut self, id: u32, velocity_mps: Vec3) {
        self.constant.insert(id, velocity_mps);
    }

    pub(crate) fn release(&mut self, id: u32) {
        self.constant.remove(&id);
    }

    /// Keeps the control of a walker, which snapshots repeat.
    pub(crate) fn walk(&mut self, id: u32, control: WalkerControl) {
        self.walkers.insert(id, control);
    }

    /// Returns the last control of a walker; `None`: no client of CARLA has controlled it.
    pub(crate) fn walker(&self, id: u32) -> Option<&WalkerControl> {
        self.walkers.get(&id)
    }

    /// Forgets the controls of walkers that do not exist.
    pub(crate) fn keep_walkers(&mut self, exists: impl Fn(u32) -> bool) {
        self.walkers.retain(|id, _| exists(*id));
    }

    /// Returns the commands for the next frame. Actors that no longer exist are released.
    pub(crate) fn commands(&mut self, world: &World) -> Vec<Command> {
        self.constant.retain(|id, _| world.state(ActorId(*id)).is_some());
        let command = |(id, velocity): (&u32, &Vec3)| {
            let actor = world.state(ActorId(*id))?;
            let mut velocity = actor.pose.rotation() * *velocity;
            // The vertical velocity stays that of gravity.
            velocity.z = actor.velocity_mps[2];
            Some(Command::SetVelocity(SetVelocity {
                actor_id: ActorId(*id),
                velocity_mps: velocity.to_array(),
                angular_velocity_radps: actor.angular_velocity_radps,
            }))
        };
        self.constant.iter().filter_map(command).collect()
    }
}
