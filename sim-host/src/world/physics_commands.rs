//! Commands that change the parameters of vehicles or apply forces to actors.

use glam::Vec3;
use protocol::{ActorId, ApplyForce, Refusal, VehiclePhysics};

use super::World;

impl World {
    /// Changes the parameters of a vehicle and returns its id.
    pub(super) fn change_physics(
        &mut self,
        id: ActorId,
        change: impl FnOnce(&mut VehiclePhysics) -> Result<(), Refusal>,
    ) -> Result<u32, Refusal> {
        self.vehicle(id, "engine")?;
        let mut physics = self.physics.vehicle_physics(id)?;
        change(&mut physics)?;
        self.physics.set_vehicle_physics(id, &physics)?;
        Ok(id.0)
    }

    pub(super) fn apply_force(&mut self, command: &ApplyForce) -> Result<u32, Refusal> {
        let id = command.actor_id;
        self.movable(id)?;
        let [linear, angular, at] =
            [command.linear, command.angular, command.at_m].map(Vec3::from_array);
        let at = (command.has_point != 0).then_some(at);
        if command.is_force == 0 {
            self.physics.impulse(id, linear, angular, at)?;
        } else {
            self.physics.force(id, linear, angular, at)?;
        }
        Ok(id.0)
    }
}
