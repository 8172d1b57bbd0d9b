//! How a vehicle is built and driven from outside: read, and changed while it drives.

use protocol::{
    AckermannControl, AckermannSettings, ActorId, ApplyForce, Ask, Command, SetWeatherAffectsGrip,
    Switch, VehiclePhysics, VehicleTelemetry, WheelTelemetry, part,
};

use crate::{Client, ClientError};

impl Client {
    /// How a vehicle is built now.
    pub fn vehicle_physics(&mut self, actor_id: ActorId) -> Result<VehiclePhysics, ClientError> {
        let ask = |part, index| Command::Ask(Ask { actor_id, part, index, reserved: 0 });
        let parts = [part::BODY, part::ENGINE, part::GEARBOX, part::STEERING];
        let mut physics = VehiclePhysics::default();
        let told = self.ask("vehicle_physics", &parts.map(|part| ask(part, 0)))?;
        let bad = |why: &str| refused("vehicle_physics", why);
        physics.body = told[0].answered().map_err(bad)?;
        physics.engine = told[1].answered().map_err(bad)?;
        physics.gearbox = told[2].answered().map_err(bad)?;
        physics.steering = told[3].answered().map_err(bad)?;
        let wheels: Vec<_> = (0..physics.body.wheels).map(|i| ask(part::WHEEL, i)).collect();
        for told in self.ask("vehicle_physics", &wheels)? {
            physics.wheels.push(told.answered().map_err(bad)?);
        }
        Ok(physics)
    }

    /// Builds a vehicle otherwise; it drives on. What has a number that cannot be, or another
    /// number of wheels, is refused, and the vehicle stays as it is.
    pub fn set_vehicle_physics(
        &mut self,
        actor_id: ActorId,
        physics: &VehiclePhysics,
    ) -> Result<(), ClientError> {
        let what = "set_vehicle_physics";
        let ask = Command::Ask(Ask { actor_id, part: part::BODY, index: 0, reserved: 0 });
        let body: protocol::VehicleBody =
            self.ask(what, &[ask])?[0].answered().map_err(|why| refused(what, why))?;
        if physics.wheels.len() != body.wheels as usize {
            let (given, has) = (physics.wheels.len(), body.wheels);
            return Err(refused(what, &format!("{actor_id} has {has} wheels, not {given}")));
        }
        let mut physics = physics.clone();
        physics.body.wheels = body.wheels;
        physics.check().map_err(|why| refused(what, &why))?;
        self.request(what, &physics.commands(actor_id)).map(drop)
    }

    /// How a vehicle drives, and what each of its wheels feels.
    pub fn telemetry(
        &mut self,
        actor_id: ActorId,
    ) -> Result<(VehicleTelemetry, Vec<WheelTelemetry>), ClientError> {
        let ask = |part, index| Command::Ask(Ask { actor_id, part, index, reserved: 0 });
        let bad = |why: &str| refused("telemetry", why);
        let told = self.ask("telemetry", &[ask(part::TELEMETRY, 0)])?;
        let vehicle: VehicleTelemetry = told[0].answered().map_err(bad)?;
        let asks: Vec<_> = (0..vehicle.wheels).map(|i| ask(part::WHEEL_TELEMETRY, i)).collect();
        let told = self.ask("telemetry", &asks)?;
        let wheels = told.iter().map(|outcome| outcome.answered().map_err(bad));
        Ok((vehicle, wheels.collect::<Result<_, _>>()?))
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
        let ask = Command::Ask(Ask { actor_id, part: part::ACKERMANN, index: 0, reserved: 0 });
        let told = self.ask("ackermann_settings", &[ask])?;
        told[0].answered().map_err(|why| refused("ackermann_settings", why))
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

    fn ask(
        &mut self,
        what: &'static str,
        asks: &[Command],
    ) -> Result<Vec<protocol::Outcome>, ClientError> {
        let entries = self.try_wire_request(what, asks)?;
        Ok(entries.into_iter().map(|entry| entry.outcome).collect())
    }
}

fn refused(what: &'static str, why: &str) -> ClientError {
    ClientError::refused(what, why)
}
