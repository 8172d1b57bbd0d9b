//! Actors: spawned, destroyed, driven.
#![expect(unsafe_code, reason = "names of C functions")]

use std::{ffi::c_char, mem::MaybeUninit};

use client_lib::{ActorId, Spawn, VehicleControl};

use crate::{
    argument::{place, text, values},
    client::{OmnibusClient, enter},
    status::{Fault, OmnibusStatus, call},
    world::{
        OMNIBUS_FLAG_AUTOPILOT, OMNIBUS_FLAG_HANDBRAKE, OMNIBUS_FLAG_KINEMATIC,
        OMNIBUS_FLAG_REVERSE, OmnibusPose,
    },
};

/// Pedals and wheel of one vehicle; the latest that was sent holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct OmnibusControl {
    /// The vehicle.
    pub actor_id: u32,
    /// OMNIBUS_FLAG_HANDBRAKE and OMNIBUS_FLAG_REVERSE, or 0.
    pub flags: u32,
    /// Accelerator pedal, 0 to 1.
    pub throttle: f32,
    /// Brake pedal, 0 to 1.
    pub brake: f32,
    /// Steering wheel, -1 (full right) to 1 (full left).
    pub steer: f32,
}

impl OmnibusControl {
    fn checked(&self) -> Result<VehicleControl, Fault> {
        let OmnibusControl { actor_id, flags, throttle, brake, steer } = *self;
        check_flags(flags, OMNIBUS_FLAG_HANDBRAKE | OMNIBUS_FLAG_REVERSE)?;
        for (name, value, low) in
            [("throttle", throttle, 0.0), ("brake", brake, 0.0), ("steer", steer, -1.0)]
        {
            if !(low..=1.0).contains(&value) {
                return Err(Fault::argument(format!(
                    "{name} of actor {actor_id} is {value}, not {low} to 1"
                )));
            }
        }
        Ok(VehicleControl {
            actor_id: ActorId(actor_id),
            throttle,
            brake,
            steer,
            handbrake: flags & OMNIBUS_FLAG_HANDBRAKE != 0,
            reverse: flags & OMNIBUS_FLAG_REVERSE != 0,
            gear: None,
        })
    }
}

fn check_flags(flags: u32, known: u32) -> Result<(), Fault> {
    if flags & !known == 0 {
        return Ok(());
    }
    Err(Fault::argument(format!(
        "flags are {flags:#x}, of which {:#x} are unknown",
        flags & !known
    )))
}

/// Spawns an actor of a blueprint, as "vehicle.tesla.model3", at world_from_actor `*pose`; a vehicle
/// is set onto the road below it. `flags` are OMNIBUS_FLAG_AUTOPILOT and OMNIBUS_FLAG_KINEMATIC, or
/// 0. It exists when this returns; the next frame shows it.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_spawn(
    client: Option<&OmnibusClient>,
    blueprint: *const c_char,
    pose: Option<&OmnibusPose>,
    flags: u32,
    actor_id: Option<&mut MaybeUninit<u32>>,
) -> OmnibusStatus {
    call("omnibus_spawn", || {
        let pose = pose.ok_or_else(|| Fault::null("pose"))?.checked("pose")?;
        check_flags(flags, OMNIBUS_FLAG_AUTOPILOT | OMNIBUS_FLAG_KINEMATIC)?;
        let place = place(actor_id, "actor_id")?;
        let mut spawn = Spawn::new(text(blueprint, "blueprint")?, pose);
        if flags & OMNIBUS_FLAG_AUTOPILOT != 0 {
            spawn = spawn.autopilot();
        }
        if flags & OMNIBUS_FLAG_KINEMATIC != 0 {
            spawn = spawn.kinematic();
        }
        place.write(enter(client)?.spawn(spawn)?.0);
        Ok(())
    })
}

/// Destroys an actor, and every bundle on it.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_destroy(client: Option<&OmnibusClient>, actor_id: u32) -> OmnibusStatus {
    call("omnibus_destroy", || Ok(enter(client)?.destroy(ActorId(actor_id))?))
}

/// Sets pedals and wheels of `count` vehicles from the next frame on. Does not wait; a vehicle that
/// does not exist is ignored. All numbers are checked before any is sent.
#[unsafe(no_mangle)]
pub extern "C" fn omnibus_control(
    client: Option<&OmnibusClient>,
    controls: *const OmnibusControl,
    count: usize,
) -> OmnibusStatus {
    call("omnibus_control", || {
        let controls = values(controls, "controls", count)?;
        let mut client = enter(client)?;
        if let [control] = controls {
            return Ok(client.control(&[control.checked()?])?);
        }
        let controls = controls.iter().map(OmnibusControl::checked);
        Ok(client.control(&controls.collect::<Result<Vec<_>, _>>()?)?)
    })
}
