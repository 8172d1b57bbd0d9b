//! Commands to actors: teleport, velocity, controls.

use glam::{Vec2, Vec3};
use protocol::{ActorId, Pose, SPEED_MAX_MPS, VehicleControl};
use rapier3d::prelude::RigidBodyType;

use super::{
    actor::Kind,
    collision::Touched,
    error::PhysicsError,
    limits::{check_length, check_pose},
    motion::Twist,
    pedals::Pedals,
    rigid_body::body_pose,
    walker::Walker,
    world::{Physics, bring_near},
};

/// Largest angular velocity that a client may set.
const SET_SPIN_MAX_RADPS: f32 = 100.0;

impl Physics {
    /// Removes an actor.
    ///
    /// # Errors
    ///
    /// The actor does not exist.
    pub fn destroy(&mut self, id: ActorId) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.remove(index);
        if let Kind::Walker(Walker { limbs: Some(limbs), .. }) = &actor.kind {
            limbs.remove(&mut self.world);
        }
        self.world.remove_body(actor.body);
        // The collider of a solo vehicle has no body.
        self.world.remove_collider(actor.collider);
        self.touching.retain(|pair| pair.0 != id.0 && pair.1 != Touched::Actor(id.0));
        self.collisions.retain(|c| c.actor != id && c.other != id);
        self.colliding.retain(|other| *other != id.0);
        Ok(())
    }

    /// Places an actor at a pose, at rest. Bodies that overlap it are pushed away by the solver.
    ///
    /// # Errors
    ///
    /// The actor does not exist, or the pose is not valid or more than 50 km from the origin.
    pub fn teleport(&mut self, id: ActorId, pose: &Pose) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_pose(id, pose)?;
        let actor = self.actors.wake(index);
        bring_near(&mut self.world, actor);
        actor.teleport.since_step = true;
        actor.kinematic_velocity = Twist::ZERO;
        match &mut actor.kind {
            Kind::Vehicle(vehicle) => vehicle.reset_motion(),
            Kind::Walker(walker) => {
                let ahead = pose.rotation() * Vec3::X;
                walker.yaw_rad = ahead.y.atan2(ahead.x);
                walker.rise_mps = None;
                if let Some(limbs) = &walker.limbs {
                    let from = *self.world.bodies[actor.body].position();
                    limbs.teleport(&mut self.world, &from, &body_pose(pose));
                }
            }
            Kind::Prop(_) => {}
        }
        let body = &mut self.world.bodies[actor.body];
        body.set_position(body_pose(pose), true);
        body.set_linvel(Vec3::ZERO, true);
        body.set_angvel(Vec3::ZERO, true);
        Ok(())
    }

    /// Sets the velocity of an actor's origin and its angular velocity, both in world space.
    ///
    /// # Errors
    ///
    /// The actor does not exist, a velocity is out of range, or a walker has fallen.
    pub fn set_velocity(
        &mut self,
        id: ActorId,
        velocity_mps: Vec3,
        spin_radps: Vec3,
    ) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_length(id, "velocity", velocity_mps, SPEED_MAX_MPS, "not finite, or above 400 m/s")?;
        check_length(
            id,
            "angular velocity",
            spin_radps,
            SET_SPIN_MAX_RADPS,
            "not finite, or above 100 rad/s",
        )?;
        let actor = self.actors.wake(index);
        if matches!(&actor.kind, Kind::Walker(walker) if walker.has_fallen()) {
            return Err(PhysicsError::Fallen(id));
        }
        let body = &mut self.world.bodies[actor.body];
        if actor.kinematic {
            actor.kinematic_velocity =
                Twist { linear_mps: velocity_mps, angular_radps: spin_radps };
            return Ok(());
        }
        if let Kind::Walker(walker) = &mut actor.kind {
            walker.desired_speed_mps = velocity_mps.truncate();
            return Ok(());
        }
        let arm = body.center_of_mass() - body.translation();
        body.set_linvel(velocity_mps + spin_radps.cross(arm), true);
        body.set_angvel(spin_radps, true);
        if let Kind::Vehicle(vehicle) = &mut actor.kind {
            vehicle.roll_without_slip(velocity_mps.dot(*body.rotation() * Vec3::X));
        }
        Ok(())
    }

    /// Selects whether an actor is kinematic: moved by teleports and set velocities only. Its
    /// velocity becomes 0.
    ///
    /// # Errors
    ///
    /// The actor does not exist.
    pub fn set_kinematic(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        if actor.kinematic == on {
            return Ok(());
        }
        bring_near(&mut self.world, actor);
        actor.kinematic = on;
        actor.kinematic_velocity = Twist::ZERO;
        match &mut actor.kind {
            // The body of a walker is position-based in both cases.
            Kind::Walker(walker) if !walker.has_fallen() => {
                walker.desired_speed_mps = Vec2::ZERO;
                return Ok(());
            }
            Kind::Vehicle(vehicle) => vehicle.reset_motion(),
            Kind::Walker(_) | Kind::Prop(_) => {}
        }
        let body_type =
            if on { RigidBodyType::KinematicPositionBased } else { RigidBodyType::Dynamic };
        for body in actor.bodies() {
            let body = &mut self.world.bodies[body];
            body.set_body_type(body_type, true);
            body.set_linvel(Vec3::ZERO, true);
            body.set_angvel(Vec3::ZERO, true);
        }
        Ok(())
    }

    /// Sets a vehicle's controls, clamped to their ranges; the latest holds.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle.
    pub fn control(&mut self, control: &VehicleControl) -> Result<(), PhysicsError> {
        let vehicle = self.vehicle_mut(control.actor_id)?;
        vehicle.state.control = Pedals::new(control);
        if let Some(controller) = &mut vehicle.state.ackermann {
            controller.release();
        }
        Ok(())
    }

    /// Sets the desired velocity of a walker over ground, in world space. Metres per second.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no walker, the velocity is out of range, or the walker has
    /// fallen.
    pub fn walk(&mut self, id: ActorId, velocity_mps: Vec2) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        check_length(
            id,
            "velocity",
            velocity_mps.extend(0.0),
            20.0,
            "not finite, or above 20 m/s",
        )?;
        let Kind::Walker(walker) = &mut self.actors.wake(index).kind else {
            return Err(PhysicsError::WrongKind(id, "walker"));
        };
        if walker.has_fallen() {
            return Err(PhysicsError::Fallen(id));
        }
        walker.desired_speed_mps = velocity_mps;
        Ok(())
    }

    /// Makes a walker jump, if it stands on the ground.
    ///
    /// # Errors
    ///
    /// The actor does not exist, is no walker, or has fallen.
    pub fn jump(&mut self, id: ActorId) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let Kind::Walker(walker) = &mut self.actors.wake(index).kind else {
            return Err(PhysicsError::WrongKind(id, "walker"));
        };
        if walker.has_fallen() {
            return Err(PhysicsError::Fallen(id));
        }
        walker.jump();
        Ok(())
    }

    /// Lets a walker fall as if it had been hit, and not stand up again. A kinematic walker is no
    /// longer kinematic.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no walker.
    pub fn fall_for_good(&mut self, id: ActorId) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        if !matches!(&self.actors[index].kind, Kind::Walker(_)) {
            return Err(PhysicsError::WrongKind(id, "walker"));
        }
        self.set_kinematic(id, false)?;
        let Physics { world, actors, .. } = self;
        let actor = actors.wake(index);
        if let Kind::Walker(walker) = &mut actor.kind {
            walker.model.gets_up_after_fall = false;
            if !walker.has_fallen() {
                walker.fall(world, (actor.body, actor.collider));
            }
        }
        Ok(())
    }

    /// Returns the simulated time since a walker fell; `None` if it stands or is no walker.
    pub fn fallen_nanos(&self, id: ActorId) -> Option<u64> {
        match &self.actors[self.find(id).ok()?].kind {
            Kind::Walker(walker) => walker.limbs.map(|limbs| limbs.fallen_nanos),
            Kind::Vehicle(_) | Kind::Prop(_) => None,
        }
    }
}
