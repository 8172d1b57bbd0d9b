//! An actor's body, and the model that moves it.

use glam::Vec3;
use rapier3d::prelude::{ColliderHandle, PhysicsWorld, Pose, RigidBody, RigidBodyHandle};
use serde::{Deserialize, Serialize};

use super::{
    body_state::BodyState,
    digest::Digest,
    mark,
    motion::{Twist, Wrench},
    prop::Prop,
    tuning,
    vehicle::Vehicle,
    walker::Walker,
};

/// The model that moves an actor.
#[derive(Debug)]
pub(super) enum Kind {
    Vehicle(Vehicle),
    Walker(Walker),
    Prop(Prop),
}

impl Kind {
    /// Whether vehicles drive over the actor and walkers step over it.
    pub(super) fn is_passable(&self) -> bool {
        matches!(self, Kind::Prop(prop) if prop.model.is_passable)
    }
}

/// Whether an actor was teleported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Teleport {
    /// Since the last step.
    pub since_step: bool,
    /// Before the last step, so that the snapshot of that frame shows it.
    pub in_last_step: bool,
}

impl Teleport {
    /// Moves the flag on to the frame that was just simulated.
    pub(super) fn end_step(&mut self) {
        *self = Teleport { since_step: false, in_last_step: self.since_step };
    }
}

/// An actor of the rigid-body world.
#[derive(Debug)]
pub(super) struct Actor {
    pub id: u32,
    pub body: RigidBodyHandle,
    pub collider: ColliderHandle,
    /// Whether only teleports and set velocities move the body.
    pub kinematic: bool,
    pub kind: Kind,
    /// The set velocity of a kinematic body.
    pub kinematic_velocity: Twist,
    /// Mean over the last frame, in world space.
    pub acceleration_mps2: Vec3,
    /// Whether gravity does not act on the body.
    pub gravity_disabled: bool,
    /// Whether the body passes through other bodies.
    pub collisions_disabled: bool,
    /// External force and torque during the next frame.
    pub external_force: Wrench,
    /// Whether the actor was teleported.
    pub teleport: Teleport,
    /// The motion of a kinematic vehicle while its body is out of the rigid-body world.
    pub far: Option<FarMotion>,
    /// Whether the actor is a vehicle that moves alone in this frame, its body disabled.
    pub solo: bool,
    /// Whether the actor is a vehicle that a kinematic model moves; its body is disabled.
    pub dormant: bool,
    /// States of a solo vehicle at the end of each substep, during a frame only.
    pub path: Vec<BodyState>,
}

/// The motion of a vehicle that is far from others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FarMotion {
    pub pose: Pose,
    /// Velocity of the origin, and angular velocity.
    pub velocity: Twist,
}

/// Takes a vehicle out of the rigid-body world. Its collider has no body then: the broad phase would
/// visit one that moves, and all static boxes with it, in every frame.
pub(super) fn take_out(world: &mut PhysicsWorld, actor: &Actor) {
    let PhysicsWorld { bodies, colliders, .. } = world;
    colliders.set_parent(actor.collider, None, bodies);
    colliders[actor.collider].set_enabled(false);
    bodies[actor.body].set_enabled(false);
}

/// Puts a vehicle that was taken out back into the rigid-body world.
pub(super) fn put_back(world: &mut PhysicsWorld, actor: &Actor) {
    let PhysicsWorld { bodies, colliders, .. } = world;
    bodies[actor.body].set_enabled(true);
    colliders.set_parent(actor.collider, Some(actor.body), bodies);
    let collider = &mut colliders[actor.collider];
    collider.set_position_wrt_parent(actor.collider_in_body());
    collider.set_enabled(!actor.collisions_disabled);
}

impl Actor {
    /// Returns the pose of the first collider in body axes.
    pub(super) fn collider_in_body(&self) -> Pose {
        let middle_m = match &self.kind {
            Kind::Vehicle(vehicle) => vehicle.own.box_center_m,
            Kind::Prop(prop) => Vec3::Z * prop.model.half_extents_m.z,
            Kind::Walker(walker) => walker.model.middle_m(),
        };
        Pose::from_translation(middle_m)
    }

    /// Returns the handles of the actor's body and of the limbs attached to it.
    pub(super) fn bodies(&self) -> impl Iterator<Item = RigidBodyHandle> + use<> {
        let limbs = match &self.kind {
            Kind::Walker(walker) => walker.limbs.map(|limbs| limbs.bodies),
            _ => None,
        };
        std::iter::once(self.body).chain(limbs.into_iter().flatten())
    }
}

/// Returns the digest of everything about an actor and its body that decides the future.
pub(super) fn digest_of(body: &RigidBody, actor: &Actor) -> u64 {
    let mut digest = Digest::default();
    let (arena, generation) = actor.body.into_raw_parts();
    digest.pair(actor.id, arena);
    let is_disabled = u32::from(!body.is_enabled());
    digest.pair(generation, u32::from(actor.kinematic) | is_disabled << 1);
    digest.vector(body.translation());
    let turn = body.rotation();
    digest.pair(turn.x.to_bits(), turn.y.to_bits());
    digest.pair(turn.z.to_bits(), turn.w.to_bits());
    digest.vector(body.linvel());
    digest.vector(body.angvel());
    if let Some(FarMotion { pose, velocity }) = &actor.far {
        digest.vector(pose.translation);
        digest.pair(pose.rotation.x.to_bits(), pose.rotation.y.to_bits());
        digest.pair(pose.rotation.z.to_bits(), pose.rotation.w.to_bits());
        digest.vector(velocity.linear_mps);
    }
    if actor.kinematic {
        digest.vector(actor.kinematic_velocity.linear_mps);
        digest.vector(actor.kinematic_velocity.angular_radps);
    }
    // That sensors are mounted changes no hash: what follows from it is in the other mark.
    digest.word((body.user_data & (mark::DORMANT | mark::DRIVEN)) as u64);
    digest.pair(actor.gravity_disabled.into(), actor.collisions_disabled.into());
    digest.vector(actor.external_force.force_n);
    digest.vector(actor.external_force.torque_nm);
    match &actor.kind {
        Kind::Vehicle(vehicle) => {
            digest.all_of(&vehicle.state);
            if let Some(tuning) = &vehicle.tuning {
                digest.all_of(&tuning::to_bytes(tuning));
            }
        }
        Kind::Walker(walker) => digest.all_of(walker),
        // Whether it is passable follows from its blueprint.
        Kind::Prop(prop) => digest.all_of(&(prop.model.half_extents_m, prop.model.mass_kg)),
    }
    digest.sum()
}
