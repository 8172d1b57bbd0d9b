//! Published states of actors, and the hash of the physics state.

use protocol::{ActorId, ActorState, Pose, WalkerLimbs, flag, kind, parts};

use super::{
    actor::{Actor, FarMotion, Kind, digest_of},
    digest::Digest,
    rigid_body::{published_velocity_mps, rounded, rounded_mps},
    walker::Walker,
    world::Physics,
};

impl Physics {
    /// Writes the physical part of the state of `state.actor_id` and returns whether the actor
    /// exists. Flags that physics decides are set or cleared; other flags, blueprint, kind, phase
    /// and signal stay.
    pub fn write_state(&self, state: &mut ActorState) -> bool {
        let Ok(index) = self.find(state.actor_id) else { return false };
        self.write_actor_state(&self.actors[index], state);
        true
    }

    /// Returns the limbs of a walker, if it has fallen.
    pub fn limbs(&self, id: ActorId) -> Option<WalkerLimbs> {
        let actor = &self.actors[self.find(id).ok()?];
        let Kind::Walker(Walker { limbs: Some(limbs), .. }) = &actor.kind else { return None };
        Some(WalkerLimbs::new(id, &limbs.joint_rotations(&self.world, actor.body)))
    }

    /// Returns the state of every actor, by id. Fields that physics does not decide are 0.
    pub fn states(&self) -> impl Iterator<Item = ActorState> + '_ {
        self.actors.iter().map(|actor| {
            let mut state = ActorState { actor_id: ActorId(actor.id), ..ActorState::default() };
            state.kind = match actor.kind {
                Kind::Vehicle(_) => kind::VEHICLE,
                Kind::Walker(_) => kind::WALKER,
                Kind::Prop(_) => kind::PROP,
            };
            self.write_actor_state(actor, &mut state);
            state
        })
    }

    fn write_actor_state(&self, actor: &Actor, state: &mut ActorState) {
        let body = self.body(actor);
        state.pose = Pose::new(body.translation(), *body.rotation());
        state.velocity_mps = published_velocity_mps(body).to_array();
        state.angular_velocity_radps = body.angvel().to_array().map(|w| rounded(w, parts::MOTION));
        if let Some(FarMotion { pose, velocity }) = &actor.far {
            state.pose = Pose::new(pose.translation, pose.rotation);
            state.velocity_mps = rounded_mps(velocity.linear_mps).to_array();
            state.angular_velocity_radps =
                velocity.angular_radps.to_array().map(|w| rounded(w, parts::MOTION));
        }
        state.acceleration_mps2 = actor.acceleration_mps2.to_array();
        let mut flags = 0;
        let mut set = |bit: u32, on: bool| flags |= if on { bit } else { 0 };
        set(flag::KINEMATIC, actor.kinematic);
        set(flag::TELEPORTED, actor.teleport.in_last_step);
        set(flag::COLLIDING, self.colliding.binary_search(&actor.id).is_ok());
        if let Kind::Vehicle(vehicle) = &actor.kind {
            let pedals = vehicle.state.control;
            set(flag::HANDBRAKE, pedals.handbrake);
            set(flag::REVERSE, pedals.reverse);
            set(flag::MANUAL_GEAR, pedals.manual.is_some());
            state.throttle = pedals.throttle;
            state.brake = pedals.brake;
            state.steer = pedals.steer;
            state.gear = vehicle.state.drivetrain.reported_gear();
            state.engine_rpm = rounded(vehicle.state.drivetrain.rpm(), parts::ENGINE);
            state.wheel_steer_rad = rounded(vehicle.state.wheel_steer_rad(), parts::WHEEL);
            state.wheel_spin_rad = rounded(vehicle.wheel_angle_rad(), parts::WHEEL);
        }
        if let Kind::Walker(walker) = &actor.kind {
            set(flag::FALLEN, walker.limbs.is_some());
        }
        const OURS: u32 = flag::KINEMATIC
            | flag::TELEPORTED
            | flag::COLLIDING
            | flag::HANDBRAKE
            | flag::REVERSE
            | flag::MANUAL_GEAR
            | flag::FALLEN;
        state.flags = state.flags & !OURS | flags;
    }

    /// Returns the hash of everything in physics that decides the future: the pose, velocities and
    /// arena index of each body (which orders rapier's solver); wheels, patches, drivetrain,
    /// steering and controls of each vehicle; walkers and kinematic velocities; pairs in contact;
    /// and the impulses with which rapier warm-starts its contacts. Rapier's trees and graphs
    /// follow from these and the same history.
    pub fn hash(&self) -> u64 {
        let mut digest = Digest::default();
        digest.word(self.actors.len() as u64);
        digest.word(self.grip.to_bits().into());
        let digest_one = |actor: &Actor| digest_of(self.body(actor), actor);
        self.actors.hash(&mut digest, self.threads, digest_one);
        for limb in self.actors.iter().flat_map(|actor| actor.bodies().skip(1)) {
            let body = &self.world.bodies[limb];
            digest.vector(body.translation());
            let turn = body.rotation();
            digest.pair(turn.x.to_bits(), turn.y.to_bits());
            digest.pair(turn.z.to_bits(), turn.w.to_bits());
            digest.vector(body.linvel());
            digest.vector(body.angvel());
        }
        digest.all_of(&self.touching);
        for pair in self.world.narrow_phase.contact_pairs() {
            digest.pair(pair.collider1.into_raw_parts().0, pair.collider2.into_raw_parts().0);
            for point in pair.solver_manifolds().iter().flat_map(|m| &m.points) {
                let tangent = point.data.warmstart_tangent_impulse;
                digest.pair(point.data.warmstart_impulse.to_bits(), tangent.x.to_bits());
                digest.pair(tangent.y.to_bits(), point.dist.to_bits());
            }
        }
        digest.sum()
    }
}
