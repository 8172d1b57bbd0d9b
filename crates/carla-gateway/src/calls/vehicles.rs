//! Controls, lights and doors of vehicles.

use client_lib::{
    ActorId,
    wire::{Command, SetDoors, SetVehicleLights, VehicleControl, flag, kind},
};

use crate::{
    args::{Args, RpcError},
    calls::{actors::unknown, call::Call},
    shared_bridge::LockedBridge,
};

pub(super) fn control(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let control = read_control(id, &mut call.args)?;
    call.bridge.apply_control(control)
}

/// Reads throttle, steer, brake, handbrake, reverse, manual gear and gear. Steering is positive to
/// the right.
pub(crate) fn read_control(id: u32, args: &mut Args) -> Result<VehicleControl, RpcError> {
    let mut f = args.list()?;
    // A pedal or wheel that is not finite is released.
    let clamped = |value: f64, low: f64| match value.is_finite() {
        true => value.clamp(low, 1.0) as f32,
        false => 0.0,
    };
    let throttle = clamped(f.number()?, 0.0);
    let steer = -clamped(f.number()?, -1.0);
    let brake = clamped(f.number()?, 0.0);
    let mut flags = 0;
    for bit in [flag::HANDBRAKE, flag::REVERSE] {
        flags |= if f.bool()? { bit } else { 0 };
    }
    let (manual_gear, gear) = (f.bool()?.into(), f.int()?.clamp(-1, 20) as i32);
    let actor_id = ActorId(id);
    Ok(VehicleControl { actor_id, flags, throttle, brake, steer, gear, manual_gear, lamps: 0 })
}

pub(super) fn autopilot(call: &mut Call) -> Result<(), RpcError> {
    let (id, on) = (call.args.u32()?, call.args.bool()?);
    call.bridge.set_autopilot(id, on)
}

pub(super) fn light_state(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let lamps = call.bridge.vehicle_lights(id);
    call.out.list(1).uint(lamps.into());
    Ok(())
}

pub(super) fn light_states(call: &mut Call) -> Result<(), RpcError> {
    let actors = call.bridge.client.world().states().iter();
    let ids: Vec<u32> = actors.filter(|a| a.kind == kind::VEHICLE).map(|a| a.actor_id.0).collect();
    call.out.list(ids.len());
    for id in ids {
        let lamps = call.bridge.vehicle_lights(id);
        call.out.list(2).uint(id.into()).uint(lamps.into());
    }
    Ok(())
}

pub(super) fn set_light_state(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let lamps = call.args.list()?.u32()?;
    call.bridge.set_vehicle_lights(id, lamps)
}

pub(super) fn open_door(call: &mut Call) -> Result<(), RpcError> {
    move_doors(call, true)
}

pub(super) fn close_door(call: &mut Call) -> Result<(), RpcError> {
    move_doors(call, false)
}

/// Opens or closes doors: 0 front left, 1 front right, 2 rear left, 3 rear right, 6 all. Hood and
/// trunk do not move.
fn move_doors(call: &mut Call, open: bool) -> Result<(), RpcError> {
    const ALL: u32 = 6;
    let (id, door) = (call.args.u32()?, call.args.u32()?);
    let function = if open { "open_vehicle_door" } else { "close_vehicle_door" };
    let blueprint = call.bridge.vehicle(function, id)?;
    let all = (1u32 << blueprint.rig().door_count()) - 1;
    let selected = if door == ALL { all } else { all & 1u32.checked_shl(door).unwrap_or(0) };
    let state = call.bridge.client.world().state(ActorId(id)).copied().unwrap_or_default();
    let before = call.bridge.episode.vehicles.doors(id).unwrap_or(state.doors);
    let doors = if open { before | selected } else { before & !selected };
    call.bridge.episode.vehicles.set_doors(id, doors);
    let command = Command::SetDoors(SetDoors { actor_id: ActorId(id), open: doors });
    call.bridge.request_one("doors", command).map(drop)
}

impl LockedBridge<'_> {
    /// Returns the lights of a vehicle that are on, including those just switched.
    fn vehicle_lights(&self, id: u32) -> u32 {
        let shown = || self.client.world().state(ActorId(id)).map_or(0, |state| state.lamps);
        self.episode.vehicles.lights(id).unwrap_or_else(shown)
    }

    /// Switches the lights of a vehicle.
    pub(crate) fn set_vehicle_lights(&mut self, id: u32, lamps: u32) -> Result<(), RpcError> {
        if !self.exists(id) {
            return Err(unknown("set_vehicle_light_state", id));
        }
        self.episode.vehicles.set_lights(id, lamps);
        let command = Command::SetVehicleLights(SetVehicleLights { actor_id: ActorId(id), lamps });
        self.request_one("lamps", command).map(drop)
    }

    /// Sets the control of an existing vehicle.
    pub(crate) fn apply_control(&mut self, control: VehicleControl) -> Result<(), RpcError> {
        if !self.exists(control.actor_id.0) {
            return Err(unknown("apply_control_to_vehicle", control.actor_id.0));
        }
        self.set_control(control);
        Ok(())
    }

    /// Returns the blueprint of a vehicle.
    ///
    /// # Errors
    ///
    /// Returns CARLA's error if the actor does not exist or is not a vehicle.
    pub(crate) fn vehicle(
        &mut self,
        function: &str,
        id: u32,
    ) -> Result<&'static town::Blueprint, RpcError> {
        let name = self.blueprint_id(id).ok_or_else(|| unknown(function, id))?;
        let found = town::blueprint(&name).filter(|(_, b)| b.kind == town::Kind::Vehicle);
        let not_one = || {
            format!(
                "Responding error from function {function}: Actor is not a Vehicle.  Actor Id: {id}"
            )
        };
        found.map(|(_, blueprint)| blueprint).ok_or_else(|| not_one().into())
    }
}

/// Sends a text by radio.
pub(super) fn send_text(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let text = call.args.text()?;
    call.bridge.transmit(id, text)
}
