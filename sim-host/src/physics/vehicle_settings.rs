//! Parameters, Ackermann controllers and telemetry of vehicles.

use protocol::{
    AckermannControl, AckermannSettings, ActorId, VehiclePhysics, VehicleTelemetry, WheelTelemetry,
};
use rapier3d::prelude::MassProperties;

use super::{
    ackermann::Ackermann, actor::Kind, error::PhysicsError, rigid_body::motion_of, tuning,
    vehicle::Vehicle, world::Physics,
};

impl Physics {
    /// Returns the parameters of a vehicle.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle.
    pub fn vehicle_physics(&self, id: ActorId) -> Result<VehiclePhysics, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let mut physics = match &vehicle.tuning {
            Some(tuning) => VehiclePhysics::clone(tuning),
            None => tuning::physics_of(&vehicle.own),
        };
        physics.body.actor_id = id;
        Ok(physics)
    }

    /// Changes the parameters of a vehicle in motion.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle, the number of wheels differs, or
    /// [`VehiclePhysics::check`] rejects a value.
    pub fn set_vehicle_physics(
        &mut self,
        id: ActorId,
        physics: &VehiclePhysics,
    ) -> Result<(), PhysicsError> {
        let wheels = self.vehicle(id)?.own.wheels.len();
        let refused = |why| PhysicsError::Refused(id, why);
        physics.check().map_err(refused)?;
        if physics.wheels.len() != wheels {
            let given = physics.wheels.len();
            return Err(PhysicsError::WheelCount { actor: id, given, wheels });
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
        // The velocity of the origin stays the same while the centre of mass moves.
        body.set_linvel(com_mps, true);
        Ok(())
    }

    /// Activates the Ackermann controller of a vehicle with a target.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle, or a value is out of range.
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

    /// Returns the settings of a vehicle's Ackermann controller.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle.
    pub fn ackermann_settings(&self, id: ActorId) -> Result<AckermannSettings, PhysicsError> {
        let controller = &self.vehicle(id)?.state.ackermann;
        let settings =
            controller.as_ref().map_or_else(AckermannSettings::default, |c| c.settings());
        Ok(AckermannSettings { actor_id: id, ..settings })
    }

    /// Changes the settings of a vehicle's Ackermann controller.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle, or a value is out of range.
    pub fn set_ackermann(&mut self, settings: &AckermannSettings) -> Result<(), PhysicsError> {
        let id = settings.actor_id;
        let vehicle = self.vehicle_mut(id)?;
        settings.check().map_err(|why| PhysicsError::Refused(id, why))?;
        vehicle.controller().set(settings);
        Ok(())
    }

    /// Returns the telemetry of a vehicle.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle.
    pub fn telemetry(&self, id: ActorId) -> Result<VehicleTelemetry, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let motion = motion_of(self.body(&self.actors[self.find(id)?]), 0.0);
        Ok(vehicle.telemetry(&motion))
    }

    /// Returns the telemetry of one wheel.
    ///
    /// # Errors
    ///
    /// The actor does not exist, is no vehicle, or has no such wheel.
    pub fn wheel_telemetry(&self, id: ActorId, wheel: u32) -> Result<WheelTelemetry, PhysicsError> {
        let vehicle = self.vehicle(id)?;
        let motion = motion_of(self.body(&self.actors[self.find(id)?]), 0.0);
        vehicle.wheel_telemetry(wheel as usize, &motion).ok_or_else(|| {
            let wheels = vehicle.own.wheels.len();
            PhysicsError::NoWheel { actor: id, index: wheel, wheels }
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
