//! Changes of parts of a vehicle's parameters.

use protocol::{ActorId, Refusal, VehicleBody, VehiclePhysics, VehicleWheel};

pub(super) fn with_body(physics: &mut VehiclePhysics, to: &VehicleBody) -> Result<(), Refusal> {
    let count = physics.body.wheels;
    if to.wheels != count {
        return Err(Refusal::out_of_range(format!(
            "{} has {count} wheels, not {}",
            to.actor_id, to.wheels
        )));
    }
    physics.body = *to;
    Ok(())
}

pub(super) fn with_wheel(physics: &mut VehiclePhysics, to: &VehicleWheel) -> Result<(), Refusal> {
    let missing = no_wheel(to.actor_id, to.index, physics);
    let wheel = physics.wheels.get_mut(to.index as usize).ok_or(missing)?;
    // The position of the hub is the blueprint's.
    *wheel = VehicleWheel { hub_m: wheel.hub_m, ..*to };
    Ok(())
}

pub(super) fn no_wheel(id: ActorId, index: u32, physics: &VehiclePhysics) -> Refusal {
    let count = physics.wheels.len();
    Refusal::not_found(format!("{id} has {count} wheels; there is no wheel {index}"))
}
