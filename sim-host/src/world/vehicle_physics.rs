//! Changes of parts of a vehicle's parameters.

use protocol::{ActorId, VehicleBody, VehiclePhysics, VehicleWheel};

use crate::physics::PhysicsError;

pub(super) fn with_body(physics: &mut VehiclePhysics, to: &VehicleBody) -> Result<(), String> {
    let count = physics.body.wheels;
    if to.wheels != count {
        return Err(format!("{} has {count} wheels, not {}", to.actor_id, to.wheels));
    }
    physics.body = *to;
    Ok(())
}

pub(super) fn with_wheel(physics: &mut VehiclePhysics, to: &VehicleWheel) -> Result<(), String> {
    let missing = no_wheel(to.actor_id, to.index, physics);
    let wheel = physics.wheels.get_mut(to.index as usize).ok_or(missing)?;
    // The position of the hub is the blueprint's.
    *wheel = VehicleWheel { hub_m: wheel.hub_m, ..*to };
    Ok(())
}

pub(super) fn no_wheel(id: ActorId, index: u32, physics: &VehiclePhysics) -> String {
    format!("{id} has {} wheels; there is no wheel {index}", physics.wheels.len())
}

pub(super) fn text_of(why: PhysicsError) -> String {
    why.to_string()
}
