//! Commands that apply forces and impulses to actors.

use glam::Vec3;
use protocol::ApplyForce;

use super::{World, vehicle_physics::text_of};

impl World {
    pub(super) fn apply_force(&mut self, command: &ApplyForce) -> Result<u32, String> {
        let id = command.actor_id;
        self.movable(id)?;
        let [linear, angular, at] =
            [command.linear, command.angular, command.at_m].map(Vec3::from_array);
        let at = (command.has_point != 0).then_some(at);
        if command.is_force == 0 {
            self.physics.impulse(id, linear, angular, at).map_err(text_of)?;
        } else {
            self.physics.force(id, linear, angular, at).map_err(text_of)?;
        }
        Ok(id.0)
    }
}
