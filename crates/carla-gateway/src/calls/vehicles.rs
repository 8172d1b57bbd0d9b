//! Vehicles: pedals, lamps, and what they are built like.

use client_lib::{ActorId, Command, SetDoors, SetVehicleLights, VehicleControl, flag, kind};

use super::{Call, actors::unknown};
use crate::{
    args::{Args, Refusal},
    bridge::Bridge,
};

pub(super) fn control(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let control = pedals(id, &mut call.args)?;
    call.bridge.drive(control)
}

/// Throttle, steer, brake, handbrake, reverse, manual gear, gear: steered to the right is positive.
pub(crate) fn pedals(id: u32, args: &mut Args) -> Result<VehicleControl, Refusal> {
    let mut f = args.list()?;
    let share = |value: f32| if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 };
    let throttle = share(f.f32()?);
    let steer = f.f32()?;
    let brake = share(f.f32()?);
    let mut flags = 0;
    for bit in [flag::HANDBRAKE, flag::REVERSE] {
        flags |= if f.bool()? { bit } else { 0 };
    }
    let (manual_gear, gear) = (f.bool()?.into(), f.int()?.clamp(-1, 20) as i32);
    let steer = if steer.is_finite() { -steer.clamp(-1.0, 1.0) } else { 0.0 };
    let actor_id = ActorId(id);
    Ok(VehicleControl { actor_id, flags, throttle, brake, steer, gear, manual_gear, lamps: 0 })
}

pub(super) fn autopilot(call: &mut Call) -> Result<(), Refusal> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    call.bridge.set_autopilot(id, on)
}

pub(super) fn light_state(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let lamps = call.bridge.lamps_of(id);
    call.out.list(1).uint(lamps.into());
    Ok(())
}

pub(super) fn light_states(call: &mut Call) -> Result<(), Refusal> {
    let actors = call.bridge.client.world().actors().iter();
    let ids: Vec<u32> = actors.filter(|a| a.kind == kind::VEHICLE).map(|a| a.actor_id.0).collect();
    call.out.list(ids.len());
    for id in ids {
        let lamps = call.bridge.lamps_of(id);
        call.out.list(2).uint(id.into()).uint(lamps.into());
    }
    Ok(())
}

pub(super) fn set_light_state(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let lamps = call.args.list()?.u32()?;
    call.bridge.set_lamps(id, lamps)
}

pub(super) fn open_door(call: &mut Call) -> Result<(), Refusal> {
    move_doors(call, true)
}

pub(super) fn close_door(call: &mut Call) -> Result<(), Refusal> {
    move_doors(call, false)
}

/// Front left, front right, rear left, rear right; bonnet and boot stay shut, 6 is every door.
fn move_doors(call: &mut Call, open: bool) -> Result<(), Refusal> {
    const ALL: u32 = 6;
    let (id, door) = (call.args.u32()?, call.args.u32()?);
    let function = if open { "open_vehicle_door" } else { "close_vehicle_door" };
    let blueprint = call.bridge.vehicle(function, id)?;
    let there = (1u32 << blueprint.rig().door_count()) - 1;
    let meant = if door == ALL { there } else { there & 1u32.checked_shl(door).unwrap_or(0) };
    let state = call.bridge.client.world().actor(ActorId(id)).copied().unwrap_or_default();
    let before = call.bridge.doors.get(&id).copied().unwrap_or(state.doors);
    let doors = if open { before | meant } else { before & !meant };
    call.bridge.doors.insert(id, doors);
    let command = Command::SetDoors(SetDoors { actor_id: ActorId(id), open: doors });
    call.bridge.request_one("doors", command).map(drop)
}

/// Degrees, positive to the right.
pub(super) fn wheel_angle(call: &mut Call) -> Result<(), Refusal> {
    let (id, wheel) = (call.args.u32()?, call.args.u32()?);
    let blueprint = call.bridge.vehicle("get_wheel_steer_angle", id)?;
    let is_steered = blueprint.wheels.get(wheel as usize).is_some_and(|w| w.steered);
    let state = call.bridge.client.world().actor(ActorId(id)).copied().unwrap_or_default();
    call.out.f32(if is_steered { -state.wheel_steer_rad.to_degrees() } else { 0.0 });
    Ok(())
}

impl Bridge {
    /// Which lamps of a vehicle are on; those that were just switched count already.
    fn lamps_of(&self, id: u32) -> u32 {
        let shown = || self.client.world().actor(ActorId(id)).map_or(0, |state| state.lamps);
        self.lamps.get(&id).map_or_else(shown, |(lamps, _)| *lamps)
    }

    /// Switches the lamps of a vehicle.
    pub(crate) fn set_lamps(&mut self, id: u32, lamps: u32) -> Result<(), Refusal> {
        self.lamps.insert(id, (lamps, 0));
        let command = Command::SetVehicleLights(SetVehicleLights { actor_id: ActorId(id), lamps });
        self.request_one("lamps", command).map(drop)
    }

    /// Pedals of a vehicle that is there.
    pub(crate) fn drive(&mut self, control: VehicleControl) -> Result<(), Refusal> {
        if !self.is_there(control.actor_id.0) {
            return Err(unknown("apply_control_to_vehicle", control.actor_id.0));
        }
        self.steer(control);
        Ok(())
    }

    /// What a vehicle was made from.
    pub(crate) fn vehicle(
        &mut self,
        function: &str,
        id: u32,
    ) -> Result<&'static town::Blueprint, Refusal> {
        let name = self.known_id(id).ok_or_else(|| unknown(function, id))?;
        let found = town::blueprint(&name).filter(|(_, b)| b.kind == town::Kind::Vehicle);
        let not_one = || {
            format!(
                "Responding error from function {function}: Actor is not a Vehicle.  Actor Id: {id}"
            )
        };
        found.map(|(_, blueprint)| blueprint).ok_or_else(|| not_one().into())
    }
}

/// A text by radio.
pub(super) fn send_text(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let text = call.args.text()?;
    call.bridge.transmit(id, text)
}
