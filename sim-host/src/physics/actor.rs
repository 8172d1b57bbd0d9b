//! An actor's body, and the model that moves it.

use glam::Vec3;
use rapier3d::prelude::{ColliderHandle, RigidBody, RigidBodyHandle};

use super::{digest::Digest, prop::Prop, tuning, vehicle::Vehicle, walker::Walker};

/// What moves an actor.
#[derive(Debug)]
pub(super) enum Kind {
    Vehicle(Vehicle),
    Walker(Walker),
    Prop(Prop),
}

#[derive(Debug)]
pub(super) struct Actor {
    pub id: u32,
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
    /// Only teleports and set velocities move it.
    pub kinematic: bool,
    pub kind: Kind,
    /// For who is kinematic: velocity and spin that were set.
    pub glide: (Vec3, Vec3),
    /// Mean over the last frame.
    pub acceleration_mps2: Vec3,
    /// It does not fall.
    pub is_weightless: bool,
    /// It runs into nobody.
    pub is_ghost: bool,
    /// Force and torque during the next frame.
    pub pushed: (Vec3, Vec3),
    /// Teleported since the last step; and in the last step's frame.
    pub teleported: (bool, bool),
}

impl Actor {
    /// Its body, and those of limbs that hang on it.
    pub(super) fn bodies(&self) -> impl Iterator<Item = RigidBodyHandle> + use<> {
        let limbs = match &self.kind {
            Kind::Walker(walker) => walker.limbs.map(|limbs| limbs.bodies),
            _ => None,
        };
        std::iter::once(self.body).chain(limbs.into_iter().flatten())
    }
}

/// Over all of an actor and its body that decides the future.
pub(super) fn digest_of(body: &RigidBody, actor: &Actor) -> u64 {
    let mut digest = Digest::default();
    let (arena, generation) = actor.body.into_raw_parts();
    digest.pair(actor.id, arena);
    digest.pair(generation, u32::from(actor.kinematic));
    digest.vector(body.translation());
    let turn = body.rotation();
    digest.pair(turn.x.to_bits(), turn.y.to_bits());
    digest.pair(turn.z.to_bits(), turn.w.to_bits());
    digest.vector(body.linvel());
    digest.vector(body.angvel());
    if actor.kinematic {
        digest.vector(actor.glide.0);
        digest.vector(actor.glide.1);
    }
    digest.pair(actor.is_weightless.into(), actor.is_ghost.into());
    digest.vector(actor.pushed.0);
    digest.vector(actor.pushed.1);
    match &actor.kind {
        Kind::Vehicle(vehicle) => {
            digest.all_of(&vehicle.state);
            if let Some(tuning) = &vehicle.tuning {
                digest.all_of(&tuning::to_bytes(tuning));
            }
        }
        Kind::Walker(walker) => digest.all_of(walker),
        Kind::Prop(prop) => digest.all_of(prop),
    }
    digest.sum()
}
