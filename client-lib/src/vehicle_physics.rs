//! How a vehicle is built and driven from outside: read, and changed while it drives.

use protocol::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Command, Refusal,
    SetWeatherAffectsGrip, Switch, VehiclePhysics, VehicleTelemetry, WheelTelemetry,
};

use crate::{Client, ClientError};

impl Client {
    /// How a vehicle is built now.
    pub fn vehicle_physics(&mut self, actor_id: ActorId) -> Result<VehiclePhysics, ClientError> {
        self.queries().vehicle_physics(actor_id)
    }

    /// Builds a vehicle otherwise; it drives on. What has a number that cannot be, or another
    /// number of wheels, is refused, and the vehicle stays as it is.
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

    /// How a vehicle drives, and what each of its wheels feels.
    pub fn telemetry(
        &mut self,
        actor_id: ActorId,
    ) -> Result<(VehicleTelemetry, Vec<WheelTelemetry>), ClientError> {
        self.queries().telemetry(actor_id)
    }

    /// Drives a vehicle to a speed and a steering angle, from the next frame on. The latest of
    /// this and [`Client::control`] holds.
    pub fn ackermann(&mut self, control: AckermannControl) -> Result<(), ClientError> {
        self.request("ackermann", &[Command::Ackermann(control)]).map(drop)
    }

    /// The gains with which a vehicle is driven so.
    pub fn ackermann_settings(
        &mut self,
        actor_id: ActorId,
    ) -> Result<AckermannSettings, ClientError> {
        self.queries().ackermann_settings(actor_id)
    }

    /// Changes them.
    pub fn set_ackermann_settings(
        &mut self,
        settings: AckermannSettings,
    ) -> Result<(), ClientError> {
        self.request("set_ackermann_settings", &[Command::SetAckermann(settings)]).map(drop)
    }

    /// Pushes or twists an actor.
    pub fn push(&mut self, push: ApplyForce) -> Result<(), ClientError> {
        self.request("push", &[Command::ApplyForce(push)]).map(drop)
    }

    /// Lets an actor fall, or not.
    pub fn set_gravity(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        let command = Command::SetGravity(Switch { actor_id, on: on.into() });
        self.request("set_gravity", &[command]).map(drop)
    }

    /// Lets an actor run into others, or not. The ground carries it either way.
    pub fn set_collisions(&mut self, actor_id: ActorId, on: bool) -> Result<(), ClientError> {
        let command = Command::SetCollisions(Switch { actor_id, on: on.into() });
        self.request("set_collisions", &[command]).map(drop)
    }

    /// Lets a walker jump, if it stands on the ground.
    pub fn jump(&mut self, actor_id: ActorId) -> Result<(), ClientError> {
        self.request("jump", &[Command::Jump(actor_id)]).map(drop)
    }

    /// Whether wet roads are slippery: with `on`, the weather's wetness and puddles take up to half
    /// of the grip from all wheels. At first they do not, as in CARLA.
    pub fn set_weather_affects_grip(&mut self, on: bool) -> Result<(), ClientError> {
        let command =
            Command::SetWeatherAffectsGrip(SetWeatherAffectsGrip { on: on.into(), reserved: 0 });
        self.request("set_weather_affects_grip", &[command]).map(drop)
    }
}
