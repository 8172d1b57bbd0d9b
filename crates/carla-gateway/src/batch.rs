//! Many commands in one call: each with its own outcome.

use client_lib::ActorId;

use crate::{
    args::{Args, Refusal},
    bridge::Bridge,
    calls::{Call, pedals},
    wire::{Description, location, transform},
};

/// Commands within commands: what is to be done after a spawn may spawn itself.
const DEPTH_MAX: u32 = 8;

/// `apply_batch`: the outcomes in the order of the commands.
pub(crate) fn apply(call: &mut Call) -> Result<(), Refusal> {
    let mut commands = call.args.list()?;
    let is_ticking = call.args.bool().unwrap_or(false);
    call.out.list(commands.len());
    while commands.len() > 0 {
        let outcome = commands.list().and_then(|c| carry_out(call.bridge, c, None, 0));
        match outcome {
            Ok(id) => call.out.list(1).list(2).uint(1).uint(id.into()),
            Err(Refusal(why)) => call.out.list(1).list(2).uint(0).list(1).text(&why),
        };
    }
    if is_ticking && let Err(Refusal(why)) = call.bridge.tick(call.peer) {
        ::log::warn!("the tick after a batch: {why}");
    }
    Ok(())
}

/// One command, on the actor `of` if it was just spawned by the command before.
fn carry_out(
    bridge: &mut Bridge,
    mut command: Args,
    of: Option<u32>,
    depth: u32,
) -> Result<u32, Refusal> {
    let mut variant = command.list()?;
    let (index, mut body) = (variant.int()?, variant.list()?);
    if index == 0 {
        return spawn(bridge, body, depth);
    }
    if index == 20 {
        return Err("this simulator has no Unreal's console".into());
    }
    let given = body.u32()?;
    let id = of.unwrap_or(given);
    match index {
        1 => bridge.destroy(id)?,
        2 => {
            let control = pedals(id, &mut body)?;
            bridge.drive(control)?;
        }
        3 => bridge.drive_to(id, &mut body)?,
        4 => {
            let mut control = body.list()?;
            bridge.walk(id, &mut control)?;
        }
        5 => bridge.set_physics(id, &mut body)?,
        6 => {
            let pose = transform(&mut body)?;
            bridge.put(id, pose)?;
        }
        7 => {
            let (pose, speed_mps) = (transform(&mut body)?, body.f32()?);
            bridge.lead(id, pose, speed_mps)?;
        }
        8 => {
            let velocity = location(&mut body)?;
            bridge.set_velocity(id, velocity)?;
        }
        9 => {
            let turn = body.vector()?;
            bridge.set_turn(id, turn)?;
        }
        10 => {
            let impulse = location(&mut body)?;
            bridge.push(id, 0, impulse, None)?;
        }
        11 => {
            let force = location(&mut body)?;
            bridge.push(id, 1, force, None)?;
        }
        12 => {
            let impulse = body.vector()?;
            bridge.twist(id, 0, impulse)?;
        }
        13 => {
            let torque = body.vector()?;
            bridge.twist(id, 1, torque)?;
        }
        14 => {
            let on = body.bool()?;
            bridge.simulate_physics(id, on)?;
        }
        15 => {
            let on = body.bool()?;
            bridge.set_gravity(id, on)?;
        }
        // The client itself registers the vehicle with the traffic manager.
        16 => {
            body.bool()?;
            if bridge.client.world().actor(ActorId(id)).is_none() && !bridge.is_there(id) {
                return Err("Actor could not be found in the registry".into());
            }
        }
        17 => {}
        18 => {
            let lamps = body.u32()?;
            bridge.set_lamps(id, lamps)?;
        }
        19 => {
            let to = location(&mut body)?;
            bridge.put_at(id, to)?;
        }
        21 => {
            let state = body.u32()?;
            bridge.set_light(id, state)?;
        }
        other => return Err(format!("command {other} is none that this server knows").into()),
    }
    Ok(id)
}

fn spawn(bridge: &mut Bridge, mut body: Args, depth: u32) -> Result<u32, Refusal> {
    let description = Description::read(&mut body)?;
    let pose = transform(&mut body)?;
    let parent = body.optional()?.map(|mut p| p.u32()).transpose()?.unwrap_or(0);
    // How it is attached is uninitialised memory in the official client if there is no parent.
    body.next()?;
    body.next()?;
    let mut after = body.list()?;
    let id = bridge.spawn(description, pose, parent)?;
    while after.len() > 0 && depth < DEPTH_MAX {
        // As in CARLA, nobody hears what became of these.
        let _ = after.list().and_then(|c| carry_out(bridge, c, Some(id), depth + 1));
    }
    Ok(id)
}
