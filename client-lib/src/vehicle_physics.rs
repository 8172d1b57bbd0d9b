//! Physics of actors: parameters of vehicles, Ackermann control, forces, gravity and collisions.

use protocol::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Command, Refusal, SetDead,
    SetWeatherAffectsGrip, Switch, VehiclePhysics, VehicleTelemetry, WheelTelemetry,
};

use crate::{Client, ClientError};

impl Client {
    /// Returns the physics parameters of a vehicle.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is not a vehicle; and as for
    /// [`Queries`](crate::Queries).
    pub fn vehicle_physics(&mut self, actor_id: ActorId) -> Result<VehiclePhysics, ClientError> {
        self.queries().vehicle_physics(actor_id)
    }

    /// Sets the physics parameters of a vehicle, which keeps its pose and velocity.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is not a vehicle, if a parameter is out
    /// of range, or if the number of wheels differs: the vehicle is unchanged.
    pub fn set_vehicle_physics(
        &mut self,
        actor_id: ActorId,
        physics: &VehiclePhysics,
    ) -> Result<(), ClientError> {
        let what = "set_vehicle_physics";
        let body: protocol::VehicleBody = self.queries().one(what, actor_id, 0)?;
        if physics.wheels.len() != body.wheels as usize {
            let (given, has) = (physics.wheels.len(), body.wheels);
            let reason = format!("{actor_id} has {has} wheels, not {given}");
            return Err(ClientError::refused(what, Refusal::out_of_range(reason)));
        }
        let mut physics = physics.clone();
        physics.body.wheels = body.wheels;
        physics
            .check()
            .map_err(|reason| ClientError::refused(what, Refusal::out_of_range(reason)))?;
        self.request(what, &physics.commands(actor_id)).map(drop)
    }

    /// Returns the motion of a vehicle, and the forces and slips of each wheel.
    ///
    /// # Errors
    ///
    /// As for [`Client::vehicle_physics`].
    pub fn telemetry(
        &mut self,
        actor_id: ActorId,
    ) -> Result<(VehicleTelemetry, Vec<WheelTelemetry>), ClientError> {
        self.queries().telemetry(actor_id)
    }

    /// Sets the target speed and steering angle of a vehicle's Ackermann controller, from the next
    /// frame on. The latest of this and [`Client::control`] holds.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is not a vehicle, or a number is out of
    /// range.
    pub fn ackermann(&mut self, control: AckermannControl) -> Result<(), ClientError> {
        self.request("ackermann", &[Command::Ackermann(control)]).map(drop)
    }

    /// Returns the gains of a vehicle's Ackermann controller.
    ///
    /// # Errors
    ///
    /// As for [`Client::vehicle_physics`].
    pub fn ackermann_settings(
        &mut self,
        actor_id: ActorId,
    ) -> Result<AckermannSettings, ClientError> {
        self.queries().ackermann_settings(actor_id)
    }

    /// Sets the gains of a vehicle's Ackermann controller.
    ///
    /// # Errors
    ///
    /// As for [`Client::ackermann`].
    pub fn set_ackermann_settings(
        &mut self,
        settings: AckermannSettings,
    ) -> Result<(), ClientError> {
        self.request("set_ackermann_settings", &[Command::SetAckermann(settings)]).map(drop)
    }

    /// Applies a force or an impulse, and a torque or an angular impulse, to an actor.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is a walker that stands, or a number is
    /// not finite.
    pub fn push(&mut self, push: ApplyForce) -> Result<(), ClientError> {
        self.request("push", &[Command::ApplyForce(push)]).map(drop)
    }

    /// Sets whether gravity acts on an actor.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist or is a traffic light.
    pub fn set_gravity(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        let command = Command::SetGravity(Switch { actor_id, on: on.into() });
        self.request("set_gravity", &[command]).map(drop)
    }

    /// Sets whether an actor collides with others and with buildings. The ground carries it either
    /// way.
    ///
    /// # Errors
    ///
    /// As for [`Client::set_gravity`].
    pub fn set_collisions(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        let command = Command::SetCollisions(Switch { actor_id, on: on.into() });
        self.request("set_collisions", &[command]).map(drop)
    }

    /// Lets a walker fall, whose body is destroyed 10 s of simulated time later
    /// ([`protocol::BODY_LIFE_NANOS`]), or stops the engine of a vehicle for good.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, or is neither a walker nor a vehicle.
    pub fn set_dead(&mut self, actor_id: ActorId) -> Result<(), ClientError> {
        let command = Command::SetDead(SetDead { actor_id, removes_body: 1 });
        self.request("set_dead", &[command]).map(drop)
    }

    /// Makes a walker jump if it stands on the ground.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] if the actor does not exist, is not a walker, or has fallen.
    pub fn jump(&mut self, actor_id: ActorId) -> Result<(), ClientError> {
        self.request("jump", &[Command::Jump(actor_id)]).map(drop)
    }

    /// Sets whether wet roads are slippery: with `on`, the weather's wetness and puddles reduce the
    /// friction of all wheels by up to half. Off at first, as in CARLA.
    ///
    /// # Errors
    ///
    /// As for [`Controller::try_request`](crate::Controller::try_request).
    pub fn set_weather_affects_grip(&mut self, on: bool) -> Result<(), ClientError> {
        let command =
            Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: on.into(), reserved: 0 });
        self.request("set_weather_affects_grip", &[command]).map(drop)
    }
}
