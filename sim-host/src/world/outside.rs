//! Commands about how vehicles are built and how actors are moved from outside.

use glam::Vec3;
use protocol::{ActorId, ApplyForce, VehiclePhysics};

use super::{World, tuning::words};

impl World {
    pub(super) fn rebuild(
        &mut self,
        id: ActorId,
        change: impl FnOnce(&mut VehiclePhysics) -> Result<(), String>,
    ) -> Result<u32, String> {
        self.driver(id)?;
        let mut physics = self.physics.vehicle_physics(id).map_err(words)?;
        change(&mut physics)?;
        self.physics.set_vehicle_physics(id, &physics).map_err(words)?;
        Ok(id.0)
    }

    pub(super) fn apply_force(&mut self, push: &ApplyForce) -> Result<u32, String> {
        let id = push.actor_id;
        self.movable(id)?;
        let [linear, angular, at] = [push.linear, push.angular, push.at_m].map(Vec3::from_array);
        let at = (push.has_point != 0).then_some(at);
        if push.is_force == 0 {
            self.physics.impulse(id, linear, angular, at).map_err(words)?;
        } else {
            self.physics.force(id, linear, angular, at).map_err(words)?;
        }
        Ok(id.0)
    }

    fn driver(&mut self, id: ActorId) -> Result<(), String> {
        self.vehicle(id, "engine").map(drop)
    }
}
