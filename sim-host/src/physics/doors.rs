//! Opening and closing doors. An open door is a collider on its vehicle; a closed one costs
//! nothing.

use protocol::ActorId;
use rapier3d::prelude::{ColliderBuilder, Pose, SharedShape};

use super::{
    actor::Kind,
    collision_groups::SOLID,
    door_model::{DoorModel, OpenDoor},
    error::PhysicsError,
    world::{Physics, bring_near},
};

impl Physics {
    /// Opens these doors of a vehicle and closes all others. Returns the open doors as bits.
    ///
    /// A door with an obstacle in its way stays closed, unless `shown`, which opens it regardless.
    ///
    /// # Errors
    ///
    /// The actor does not exist or is no vehicle, or obstacles keep every door closed that should
    /// open; then nothing changes.
    pub fn set_doors(
        &mut self,
        id: ActorId,
        doors: &[DoorModel],
        shown: bool,
    ) -> Result<u32, PhysicsError> {
        let index = self.find(id)?;
        let before = self.vehicle(id)?.state.doors.clone();
        let is_open = |model: &DoorModel| before.iter().any(|door| door.model == *model);
        let (mut opening, mut blocked) = (Vec::new(), None);
        for model in doors.iter().filter(|model| !is_open(model)) {
            match self.door_obstacle(index, model).filter(|_| !shown) {
                Some(obstacle) => blocked = Some(obstacle),
                None => opening.push(*model),
            }
        }
        if let (true, Some(obstacle)) = (opening.is_empty(), blocked) {
            return Err(PhysicsError::DoorBlocked { actor: id, obstacle });
        }
        let mut open = Vec::new();
        for door in before {
            if doors.contains(&door.model) {
                open.push(door);
            } else {
                self.world.remove_collider(door.collider);
            }
        }
        let actor = self.actors.wake(index);
        bring_near(&mut self.world, actor);
        for model in opening {
            let half = model.half_extents_m;
            let collider = ColliderBuilder::cuboid(half.x, half.y, half.z)
                .position(Pose::from_parts(model.middle_m, model.turn))
                .density(0.0)
                .friction(0.4)
                .collision_groups(SOLID)
                .enabled(!actor.collisions_disabled)
                .user_data(u128::from(id.0));
            let collider = self.world.insert_collider(collider, Some(actor.body));
            open.push(OpenDoor { model, collider });
        }
        open.sort_by_key(|door| door.model.number);
        let bits = open.iter().fold(0, |bits, door| bits | 1 << door.model.number);
        let Kind::Vehicle(vehicle) = &mut actor.kind else { return Ok(0) };
        vehicle.state.doors = open;
        Ok(bits)
    }

    /// Returns the first obstacle in the way of a door.
    fn door_obstacle(&self, index: usize, door: &DoorModel) -> Option<String> {
        let actor = &self.actors[index];
        if actor.collisions_disabled {
            return None;
        }
        let half = door.half_extents_m;
        let shape = SharedShape::cuboid(half.x, half.y, half.z);
        let pose = *self.body(actor).position() * Pose::from_parts(door.middle_m, door.turn);
        self.obstacle(&pose, &shape, Some(actor.id))
    }
}
