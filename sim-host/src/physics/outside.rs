//! What acts on an actor from outside, by a client's word: other numbers, pushes, no gravity, no
//! collisions, a controller at the pedals; and what can be read of it.

use glam::Vec3;
use protocol::{
    AckermannControl, AckermannSettings, ActorId, VehiclePhysics, VehicleTelemetry, WheelTelemetry,
};
use rapier3d::prelude::MassProperties;

use super::{
    ackermann::Ackermann, actor::Kind, error::PhysicsError, limits::check_length,
    rigid_body::motion_of, tuning, vehicle::Vehicle, walker::Walker, world::Physics,
};

/// The hardest push: a change of velocity in one frame that the solver bears.
const IMPULSE_MAX: f32 = 1e8;

impl Physics {
    /// How a vehicle is built.
    pub fn vehicle_physics(&self, id: ActorId) -> Result<VehiclePhysics, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let mut physics = match &vehicle.tuning {
            Some(tuning) => VehiclePhysics::clone(tuning),
            None => tuning::physics_of(&vehicle.own),
        };
        physics.body.actor_id = id;
        Ok(physics)
    }

    /// Builds a vehicle otherwise; it drives on. Refused if [`VehiclePhysics::check`] finds fault.
    pub fn set_vehicle_physics(
        &mut self,
        id: ActorId,
        physics: &VehiclePhysics,
    ) -> Result<(), PhysicsError> {
        let wheels = self.vehicle(id)?.own.wheels.len();
        let refused = |why| PhysicsError::Refused(id, why);
        physics.check().map_err(refused)?;
        if physics.wheels.len() != wheels {
            let why = format!("there are {} wheels; it has {wheels}", physics.wheels.len());
            return Err(refused(why));
        }
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        let Kind::Vehicle(vehicle) = &mut actor.kind else { return Ok(()) };
        vehicle.tune(physics);
        let model = &vehicle.prepared.model;
        let body = &mut self.world.bodies[actor.body];
        let com_mps = body.velocity_at_point(body.position() * model.com_m);
        let mass = MassProperties::new(model.com_m, model.mass_kg, model.inertia_kgm2);
        body.set_additional_mass_properties(mass, true);
        body.recompute_mass_properties_from_colliders(&self.world.colliders);
        // The origin moves on as it did.
        body.set_linvel(com_mps, true);
        Ok(())
    }

    /// Pushes and twists an actor at once, in world space: newton seconds, newton metre seconds.
    pub fn impulse(
        &mut self,
        id: ActorId,
        linear_ns: Vec3,
        angular_nms: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(), PhysicsError> {
        let (index, angular_nms) = self.push_of(id, linear_ns, angular_nms, at_m)?;
        let body = &mut self.world.bodies[self.actors.wake(index).body];
        body.apply_impulse(linear_ns, true);
        body.apply_torque_impulse(angular_nms, true);
        Ok(())
    }

    /// Pushes and twists an actor during the next frame, in world space: newtons, newton metres.
    pub fn force(
        &mut self,
        id: ActorId,
        force_n: Vec3,
        torque_nm: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(), PhysicsError> {
        let (index, torque_nm) = self.push_of(id, force_n, torque_nm, at_m)?;
        let external = &mut self.actors.wake(index).external_force;
        external.force_n += force_n;
        external.torque_nm += torque_nm;
        Ok(())
    }

    fn push_of(
        &self,
        id: ActorId,
        linear: Vec3,
        angular: Vec3,
        at_m: Option<Vec3>,
    ) -> Result<(usize, Vec3), PhysicsError> {
        let index = self.find(id)?;
        let actor = &self.actors[index];
        if matches!(actor.kind, Kind::Walker(_)) {
            return Err(PhysicsError::WrongKind(id, "body that can be pushed; it walks"));
        }
        let why = "not finite, or above 1e8";
        check_length(id, "push", linear, IMPULSE_MAX, why)?;
        check_length(id, "twist", angular, IMPULSE_MAX, why)?;
        let Some(at_m) = at_m else { return Ok((index, angular)) };
        let arm = at_m - self.body(actor).center_of_mass();
        check_length(id, "arm", arm, 1e5, "not finite, or above 100 km")?;
        let angular = angular + arm.cross(linear);
        check_length(id, "twist", angular, 1e2 * IMPULSE_MAX, "not finite, or above 1e10")?;
        Ok((index, angular))
    }

    /// Whether an actor falls.
    pub fn set_gravity(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
        actor.gravity_disabled = !on;
        for body in actor.bodies() {
            self.world.bodies[body].set_gravity_scale(if on { 1.0 } else { 0.0 }, true);
        }
        Ok(())
    }

    /// Whether an actor runs into others. The ground carries it either way.
    pub fn set_collisions(&mut self, id: ActorId, on: bool) -> Result<(), PhysicsError> {
        let index = self.find(id)?;
        let actor = self.actors.wake(index);
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

    /// A controller drives the vehicle from now on.
    pub fn ackermann(&mut self, control: &AckermannControl) -> Result<(), PhysicsError> {
        let id = control.actor_id;
        let index = self.find(id)?;
        control.check().map_err(|why| PhysicsError::Refused(id, why))?;
        let motion = motion_of(self.body(&self.actors[index]), 0.0);
        let vehicle = self.vehicle_mut(id)?;
        let forward_mps = motion.velocity_mps.dot(motion.axes.x_axis);
        let steer_rad = vehicle.state.steer_rad;
        vehicle.controller().set_target(control, forward_mps, steer_rad);
        Ok(())
    }

    /// How a vehicle's controller drives.
    pub fn ackermann_settings(&self, id: ActorId) -> Result<AckermannSettings, PhysicsError> {
        let controller = &self.vehicle(id)?.state.ackermann;
        let settings =
            controller.as_ref().map_or_else(AckermannSettings::default, |c| c.settings());
        Ok(AckermannSettings { actor_id: id, ..settings })
    }

    /// Changes how it drives.
    pub fn set_ackermann(&mut self, settings: &AckermannSettings) -> Result<(), PhysicsError> {
        let id = settings.actor_id;
        let vehicle = self.vehicle_mut(id)?;
        settings.check().map_err(|why| PhysicsError::Refused(id, why))?;
        vehicle.controller().set(settings);
        Ok(())
    }

    /// How a vehicle drives.
    pub fn telemetry(&self, id: ActorId) -> Result<VehicleTelemetry, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let motion = motion_of(self.body(&self.actors[self.find(id)?]), 0.0);
        Ok(vehicle.telemetry(&motion))
    }

    /// What one of a vehicle's wheels feels.
    pub fn wheel_telemetry(&self, id: ActorId, wheel: u32) -> Result<WheelTelemetry, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let motion = motion_of(self.body(&self.actors[self.find(id)?]), 0.0);
        vehicle.wheel_telemetry(wheel as usize, &motion).ok_or_else(|| {
            let count = vehicle.own.wheels.len();
            PhysicsError::Refused(id, format!("there is no wheel {wheel}; it has {count}"))
        })
    }

    pub(super) fn vehicle(&self, id: ActorId) -> Result<&Vehicle, PhysicsError> {
        match &self.actors[self.find(id)?].kind {
            Kind::Vehicle(vehicle) => Ok(vehicle),
            _ => Err(PhysicsError::WrongKind(id, "vehicle")),
        }
    }

    pub(super) fn vehicle_mut(&mut self, id: ActorId) -> Result<&mut Vehicle, PhysicsError> {
        let index = self.find(id)?;
        match &mut self.actors.wake(index).kind {
            Kind::Vehicle(vehicle) => Ok(vehicle),
            _ => Err(PhysicsError::WrongKind(id, "vehicle")),
        }
    }
}

impl Vehicle {
    fn controller(&mut self) -> &mut Ackermann {
        self.state.ackermann.get_or_insert_with(|| Box::new(Ackermann::new()))
    }
}
