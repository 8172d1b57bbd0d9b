//! External forces on actors, and switches of gravity and collisions.

use glam::Vec3;
use protocol::ActorId;

use super::{
    actor::Kind,
    error::PhysicsError,
    limits::check_length,
    rigid_body::limit_speeds,
    walker::Walker,
    world::{Physics, bring_near},
};

/// Largest impulse and force: the change of velocity in one frame that the solver tolerates.
const IMPULSE_MAX: f32 = 1e8;

impl Physics {
    /// Applies an impulse to an actor at once, in world space: newton seconds, newton metre
    /// seconds.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is a walker, or a value is out of range.
    pub fn impulse(
        &mut self,
        id: ActorId,
        linear_ns: Vec3,
        angular_nms: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(), PhysicsError> {
        let (index, angular_nms) = self.checked_force(id, linear_ns, angular_nms, at_m)?;
        let body = &mut self.world.bodies[self.actors.wake(index).body];
        body.apply_impulse(linear_ns, true);
        body.apply_torque_impulse(angular_nms, true);
        limit_speeds(body);
        Ok(())
    }

    /// Applies a force to an actor during the next frame, in world space: newtons, newton metres.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is a walker, or a value is out of range.
    pub fn force(
        &mut self,
        id: ActorId,
        force_n: Vec3,
        torque_nm: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(), PhysicsError> {
        let (index, torque_nm) = self.checked_force(id, force_n, torque_nm, at_m)?;
        let external = &mut self.actors.wake(index).external_force;
        external.force_n += force_n;
        external.torque_nm += torque_nm;
        Ok(())
    }

    fn checked_force(
        &self,
        id: ActorId,
        linear: Vec3,
        angular: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(usize, Vec3), PhysicsError> {
        let index = self.find(id)?;
        let actor = &self.actors[index];
        if matches!(actor.kind, Kind::Walker(_)) {
            return Err(PhysicsError::WrongKind(id, "body on which forces act; it is a walker"));
        }
        let why = "not finite, or above 1e8";
        check_length(id, "force or impulse", linear, IMPULSE_MAX, why)?;
        check_length(id, "torque or angular impulse", angular, IMPULSE_MAX, why)?;
        let Some(at_m) = at_m else { return Ok((index, angular)) };
        let arm = at_m - self.body(actor).center_of_mass();
        check_length(id, "lever arm", arm, 1e5, "not finite, or above 100 km")?;
        let angular = angular + arm.cross(linear);
        check_length(
            id,
            "torque or angular impulse",
            angular,
            1e2 * IMPULSE_MAX,
            "not finite, or above 1e10",
        )?;
        Ok((index, angular))
    }

    /// Selects whether gravity acts on an actor.
    ///
    /// # Errors
    ///
    /// The actor does not exist.
    pub fn set_gravity(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        actor.gravity_disabled = !on;
        for body in actor.bodies() {
            self.world.bodies[body].set_gravity_scale(if on { 1.0 } else { 0.0 }, true);
        }
        Ok(())
    }

    /// Selects whether an actor collides with other bodies. The ground carries it in both cases.
    ///
    /// # Errors
    ///
    /// The actor does not exist.
    pub fn set_collisions(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        bring_near(&mut self.world, actor);
        actor.collisions_disabled = !on;
        if let Kind::Walker(Walker { limbs: Some(limbs), .. }) = &actor.kind {
            limbs.set_collisions(&mut self.world, actor.body, on);
            return Ok(());
        }
        for collider in self.world.bodies[actor.body].colliders() {
            self.world.colliders[*collider].set_enabled(on);
        }
        Ok(())
    }
}
