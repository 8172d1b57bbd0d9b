//! Many commands in one call, each with its own outcome.

use crate::{
    args::{Args, RpcError},
    calls::{actors::unknown, call::Call, vehicles::read_control},
    msgpack::Pack,
    shared_bridge::LockedBridge,
    wire::{Description, location, transform},
};

/// Most commands of one batch.
const COMMANDS_MAX: usize = 1 << 17;
/// Most destructions that the host is sent at once.
const DESTROYED_MAX: usize = 1 << 12;
/// Other connections may use the bridge after so many commands.
const TURN: usize = 256;
/// The deepest nesting of commands: commands after a spawn may be spawns.
const DEPTH_MAX: u32 = 8;
/// By the number of a command: the function that an error for an unknown actor names. Destruction
/// has an error of its own.
const FUNCTIONS: [&str; 22] = [
    "spawn_actor",
    "destroy_actor",
    "apply_control_to_vehicle",
    "apply_ackermann_control_to_vehicle",
    "apply_control_to_walker",
    "apply_physics_control",
    "set_actor_transform",
    "set_walker_state",
    "set_actor_target_velocity",
    "set_actor_target_angular_velocity",
    "add_actor_impulse",
    "add_actor_force",
    "add_actor_angular_impulse",
    "add_actor_torque",
    "set_actor_simulate_physics",
    "set_actor_enable_gravity",
    "set_actor_autopilot",
    "show_vehicle_debug_telemetry",
    "set_vehicle_light_state",
    "set_actor_location",
    "console_command",
    "set_traffic_light_state",
];

/// `apply_batch`: writes the outcomes in the order of the commands.
pub(crate) fn apply(call: &mut Call) -> Result<(), RpcError> {
    let mut commands = call.args.list()?;
    let is_ticking = call.args.bool().unwrap_or(false);
    let count = commands.len();
    if count > COMMANDS_MAX {
        let why = format!("a batch of {count} commands; the most are {COMMANDS_MAX}, send several");
        // The official package does not show the text of this error.
        log::warn!("apply_batch of {}: {why}", call.peer.address);
        return Err(why.into());
    }
    call.out.list(count);
    while commands.len() > 0 {
        if commands.len().is_multiple_of(TURN) {
            call.bridge.give_way();
        }
        let destroyed = destroyed_next(commands);
        if destroyed.len() > 1 {
            for (id, outcome) in destroyed.iter().zip(call.bridge.destroy_all(&destroyed)) {
                write_outcome(call.out, outcome.map(|()| *id));
                commands.next()?;
            }
            call.bridge.give_way();
            continue;
        }
        let outcome = commands.list().and_then(|c| execute(&mut call.bridge, c, None, 0));
        write_outcome(call.out, outcome);
    }
    if is_ticking && let Err(RpcError(why)) = call.bridge.tick(call.peer) {
        log::warn!("the tick after a batch failed: {why}");
    }
    Ok(())
}

fn write_outcome(out: &mut Pack, outcome: Result<u32, RpcError>) {
    match outcome {
        Ok(id) => out.list(1).list(2).uint(1).uint(id.into()),
        Err(RpcError(why)) => out.list(1).list(2).uint(0).list(1).text(&why),
    };
}

/// Returns the actors of the destructions with which the rest of a batch begins.
fn destroyed_next(mut commands: Args) -> Vec<u32> {
    let destroyed = |command: &mut Args| {
        let mut variant = command.list()?.list()?;
        let (index, mut body) = (variant.int()?, variant.list()?);
        if index == 1 { body.u32().map(Some) } else { Ok::<_, RpcError>(None) }
    };
    let mut ids = Vec::new();
    while ids.len() < DESTROYED_MAX
        && let Ok(Some(id)) = destroyed(&mut commands)
    {
        ids.push(id);
    }
    ids
}

/// Executes one command and returns the id of its actor: `of` if the actor was spawned by the
/// enclosing command.
fn execute(
    bridge: &mut LockedBridge,
    mut command: Args,
    of: Option<u32>,
    depth: u32,
) -> Result<u32, RpcError> {
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
    if index != 1
        && let Some(function) = usize::try_from(index).ok().and_then(|i| FUNCTIONS.get(i))
        && !bridge.exists(id)
        && !bridge.episode.actors.proxies.contains_key(&id)
    {
        return Err(unknown(function, id));
    }
    match index {
        1 => bridge.destroy(id)?,
        2 => {
            let control = read_control(id, &mut body)?;
            bridge.apply_control(control)?;
        }
        3 => bridge.apply_ackermann(id, &mut body)?,
        4 => {
            let mut control = body.list()?;
            bridge.apply_walker_control(id, &mut control)?;
        }
        5 => bridge.set_physics(id, &mut body)?,
        6 => {
            let pose = transform(&mut body)?;
            bridge.teleport(id, pose)?;
        }
        7 => {
            let (pose, speed_mps) = (transform(&mut body)?, body.f32()?);
            bridge.set_walker_state(id, pose, speed_mps)?;
        }
        8 => {
            let velocity = location(&mut body)?;
            bridge.set_velocity(id, velocity)?;
        }
        9 => {
            let turn = body.vector()?;
            bridge.set_angular_velocity(id, turn)?;
        }
        10 => {
            let impulse = location(&mut body)?;
            bridge.apply_force(id, 0, impulse, None)?;
        }
        11 => {
            let force = location(&mut body)?;
            bridge.apply_force(id, 1, force, None)?;
        }
        12 => {
            let impulse = body.vector()?;
            bridge.apply_torque(id, 0, impulse)?;
        }
        13 => {
            let torque = body.vector()?;
            bridge.apply_torque(id, 1, torque)?;
        }
        14 => {
            let on = body.bool()?;
            bridge.set_simulate_physics(id, on)?;
        }
        15 => {
            let on = body.bool()?;
            bridge.set_gravity(id, on)?;
        }
        // The client itself registers the vehicle with the traffic manager.
        16 => drop(body.bool()?),
        17 => {}
        18 => {
            let lamps = body.u32()?;
            bridge.set_vehicle_lights(id, lamps)?;
        }
        19 => {
            let to = location(&mut body)?;
            bridge.move_to(id, to)?;
        }
        21 => {
            let state = body.u32()?;
            bridge.set_traffic_light(id, state)?;
        }
        other => return Err(format!("unknown batch command {other}").into()),
    }
    Ok(id)
}

fn spawn(bridge: &mut LockedBridge, mut body: Args, depth: u32) -> Result<u32, RpcError> {
    let description = Description::read(&mut body)?;
    let pose = transform(&mut body)?;
    let parent = body.optional()?.map(|mut p| p.u32()).transpose()?.unwrap_or(0);
    // Without a parent, the official client sends uninitialised memory as the type of attachment.
    body.next()?;
    body.next()?;
    let mut after = body.list()?;
    let id = bridge.spawn(description, pose, parent)?;
    while after.len() > 0 && depth < DEPTH_MAX {
        // As in CARLA, the outcomes of these commands are not reported.
        let _ = after.list().and_then(|c| execute(bridge, c, Some(id), depth + 1));
    }
    Ok(id)
}
