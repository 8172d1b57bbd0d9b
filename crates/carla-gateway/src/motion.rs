//! Constant velocities, which hold until a client releases them.

use std::collections::BTreeMap;

use client_lib::{
    ActorId, World,
    wire::{Command, SetVelocity},
};
use glam::Vec3;

/// The actors that move with a constant velocity.
#[derive(Debug, Default)]
pub(crate) struct Motions {
    /// Metres per second in the actor's own space.
    constant: BTreeMap<u32, Vec3>,
}

impl Motions {
    pub(crate) fn hold(&mut self, id: u32, velocity_mps: Vec3) {
        self.constant.insert(id, velocity_mps);
    }

    pub(crate) fn release(&mut self, id: u32) {
        self.constant.remove(&id);
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
