//! All physics parameters of a vehicle, and the commands that set them.

use crate::{
    ActorId, Command, VehicleBody, VehicleEngine, VehicleGearbox, VehicleSteering, VehicleWheel,
};

/// All physics parameters of a vehicle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehiclePhysics {
    /// Mass, drag and centre of mass.
    pub body: VehicleBody,
    /// Engine.
    pub engine: VehicleEngine,
    /// Gearbox, clutch and final drive.
    pub gearbox: VehicleGearbox,
    /// Steering curve.
    pub steering: VehicleSteering,
    /// Wheels in the blueprint's order.
    pub wheels: Vec<VehicleWheel>,
}

impl VehiclePhysics {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        self.body.check()?;
        self.engine.check()?;
        self.gearbox.check()?;
        self.steering.check()?;
        if self.wheels.len() != self.body.wheels as usize {
            return Err(format!(
                "there are {} wheels; the vehicle has {}",
                self.wheels.len(),
                self.body.wheels
            ));
        }
        for wheel in &self.wheels {
            wheel.check().map_err(|why| format!("wheel {}: {why}", wheel.index))?;
        }
        Ok(())
    }

    /// The commands that set these parameters.
    pub fn commands(&self, actor_id: ActorId) -> Vec<Command> {
        let mut commands = vec![
            Command::SetBody(VehicleBody { actor_id, ..self.body }),
            Command::SetEngine(VehicleEngine { actor_id, ..self.engine }),
            Command::SetGearbox(VehicleGearbox { actor_id, ..self.gearbox }),
            Command::SetSteering(VehicleSteering { actor_id, ..self.steering }),
        ];
        for (index, wheel) in (0..).zip(&self.wheels) {
            commands.push(Command::SetWheel(VehicleWheel { actor_id, index, ..*wheel }));
        }
        commands
    }
}
