//! Actors are put somewhere, pushed, or told to walk.

use client_lib::{ActorId, ActorState, Command, Pose, SetPhysics, SetVelocity, Teleport};
use glam::Vec3;

use super::{Call, actors::unknown};
use crate::{
    args::{Args, Refusal},
    bridge::Bridge,
    cast::Cast,
    wire::{flip_turn, location, transform as read_transform},
};

pub(super) fn transform(call: &mut Call) -> Result<(), Refusal> {
    let (id, pose) = (call.args.u32()?, read_transform(&mut call.args)?);
    call.bridge.put(id, pose)
}

pub(super) fn locate(call: &mut Call) -> Result<(), Refusal> {
    let (id, to) = (call.args.u32()?, location(&mut call.args)?);
    call.bridge.put_at(id, to)
}

pub(super) fn target_velocity(call: &mut Call) -> Result<(), Refusal> {
    let (id, velocity) = (call.args.u32()?, location(&mut call.args)?);
    call.bridge.set_velocity(id, velocity)
}

pub(super) fn target_angular_velocity(call: &mut Call) -> Result<(), Refusal> {
    let (id, turn) = (call.args.u32()?, call.args.vector()?);
    call.bridge.set_turn(id, turn)
}

pub(super) fn hold(call: &mut Call) -> Result<(), Refusal> {
    let (id, velocity) = (call.args.u32()?, location(&mut call.args)?);
    call.bridge.motions.hold(id, velocity);
    Ok(())
}

/// From a constant velocity on, the actor goes its own way.
pub(super) fn release(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    call.bridge.motions.release(id);
    Ok(())
}

pub(super) fn walk(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let mut control = call.args.list()?;
    call.bridge.walk(id, &mut control)
}

pub(super) fn walker_state(call: &mut Call) -> Result<(), Refusal> {
    let (id, pose) = (call.args.u32()?, read_transform(&mut call.args)?);
    let speed_mps = call.args.f32()?;
    call.bridge.lead(id, pose, speed_mps)
}

pub(super) fn simulate_physics(call: &mut Call) -> Result<(), Refusal> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    call.bridge.simulate_physics(id, on)
}

impl Bridge {
    /// Lets physics move an actor, or its client alone.
    pub(crate) fn simulate_physics(&mut self, id: u32, on: bool) -> Result<(), Refusal> {
        if Cast::is_own(id) {
            return Ok(());
        }
        let command = Command::SetPhysics(SetPhysics { actor_id: ActorId(id), on: on.into() });
        self.request_one("physics", command).map(drop)
    }

    /// The blueprint of an actor.
    pub(crate) fn known_id(&mut self, id: u32) -> Option<String> {
        let Bridge { cast, client, .. } = self;
        let actor = cast.actor(id, client.world(), client.blueprints())?;
        Some(actor.description.id.clone())
    }

    fn there(&self, id: u32) -> Result<ActorState, Refusal> {
        self.state(id).ok_or_else(|| unknown("actor", id))
    }

    /// A walker is to be at this place after the next step, walking at this speed.
    pub(crate) fn lead(&mut self, id: u32, pose: Pose, speed_mps: f32) -> Result<(), Refusal> {
        let velocity = pose.rotation() * Vec3::X * speed_mps;
        let step = velocity * (self.client.settings().delta_nanos as f32 * 1e-9);
        self.put(id, Pose::new(pose.position() - step, pose.rotation()))?;
        self.set_velocity(id, velocity)
    }

    /// Puts an actor elsewhere, at rest; one of our own relative to its carrier.
    pub(crate) fn put(&mut self, id: u32, pose: Pose) -> Result<(), Refusal> {
        if !Cast::is_own(id) {
            if !self.is_there(id) {
                return Err(unknown("set_actor_transform", id));
            }
            self.command(Command::Teleport(Teleport { actor_id: ActorId(id), pose }));
            return Ok(());
        }
        let own = self.cast.own_mut(id)?;
        own.pose = pose;
        // Where it measures from is said when a bundle is made.
        if let Some(bundle) = own.sensor.as_mut().and_then(|sensor| sensor.bundle.take()) {
            self.drop_rig(bundle);
            self.make_rig(id)?;
        }
        Ok(())
    }

    pub(crate) fn put_at(&mut self, id: u32, to: Vec3) -> Result<(), Refusal> {
        let now = match self.cast.own.get(&id) {
            Some(own) => own.pose,
            None => self.there(id)?.pose,
        };
        self.put(id, Pose::new(to, now.rotation()))
    }

    pub(crate) fn set_velocity(&mut self, id: u32, velocity: Vec3) -> Result<(), Refusal> {
        let turn = self.state(id).map_or([0.0; 3], |actor| actor.angular_velocity_radps);
        self.move_with(id, velocity, Vec3::from_array(turn))
    }

    /// Degrees per second in CARLA's axes.
    pub(crate) fn set_turn(&mut self, id: u32, turn: [f32; 3]) -> Result<(), Refusal> {
        let velocity = self.state(id).map_or(Vec3::ZERO, |actor| actor.velocity());
        self.move_with(id, velocity, Vec3::from_array(flip_turn(turn.map(f32::to_radians))))
    }

    fn move_with(&mut self, id: u32, velocity: Vec3, turn: Vec3) -> Result<(), Refusal> {
        if !self.is_there(id) {
            return Err(unknown("set_actor_target_velocity", id));
        }
        self.command(Command::SetVelocity(SetVelocity {
            actor_id: ActorId(id),
            velocity_mps: velocity.to_array(),
            angular_velocity_radps: turn.to_array(),
        }));
        Ok(())
    }

    /// A walker goes this way until it is told another, and may jump.
    pub(crate) fn walk(&mut self, id: u32, control: &mut Args) -> Result<(), Refusal> {
        let (direction, speed) = (location(control)?, control.f32()?);
        let velocity = direction.normalize_or_zero() * speed;
        if !self.is_there(id) {
            return Err(unknown("apply_control_to_walker", id));
        }
        if control.bool()? {
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
