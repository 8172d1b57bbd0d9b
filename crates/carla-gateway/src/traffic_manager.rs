//! The server of the traffic manager's port: CARLA's parameters as those of our traffic.
//!
//! Its calls have no metadata and no wrapper; an error is one of the call itself.

use std::sync::Arc;

use client_lib::{
    ActorId,
    wire::{Command, RouteCommand, RouteStep, TrafficParam, param, route_step},
};

use crate::{
    args::{Args, RpcError},
    bridge::outbox::WAITING_MAX,
    msgpack::{Pack, Value},
    rpc::{Handler, Peer},
    shared_bridge::{LockedBridge, SharedBridge},
    wire,
};

/// Calls that change nothing here: traffic is always in step with the world and drives all vehicles
/// with full physics.
///
/// They are answered without the bridge. The official client sends `health_check_remote_TM` every two
/// seconds. If the answer takes longer than that, it discards the next state of the world that it
/// receives, and a `World.tick` that waits for that state never ends.
const WITHOUT_EFFECT: &[&str] = &[
    "health_check_remote_TM",
    "set_synchronous_mode",
    "set_synchronous_mode_timeout_in_milisecond",
    "synchronous_tick",
    "set_hybrid_physics_mode",
    "set_hybrid_physics_radius",
    "set_osm_mode",
    "set_respawn_dormant_vehicles",
    "set_boundaries_respawn_dormant_vehicles",
    "set_max_boundaries",
    "get_next_action",
    "get_all_actions",
    "shut_down",
];

/// The traffic manager, which is always running.
pub(crate) struct TrafficManager {
    pub(crate) bridge: Arc<SharedBridge>,
}

impl Handler for TrafficManager {
    fn call(&self, _: &Peer, method: &str, params: &[Value], out: &mut Pack) {
        if answer_at_once(method, out) {
            return;
        }
        let mut bridge = self.bridge.lock();
        let ended = if bridge.outbox.is_full() {
            Err(format!("{WAITING_MAX} commands wait for the next tick").into())
        } else {
            execute(&mut bridge, method, Args::new(params))
        };
        bridge.flush_after_call();
        match ended {
            Ok(()) => out.nil().nil(),
            Err(RpcError(why)) => {
                log::warn!("traffic manager: {method}: {why}");
                out.text(&why).nil()
            }
        };
    }
}

/// Answers a call that does not need the bridge; returns whether it is one.
fn answer_at_once(method: &str, out: &mut Pack) -> bool {
    let is_one = WITHOUT_EFFECT.contains(&method);
    if is_one {
        out.nil().nil();
    }
    is_one
}

fn execute(bridge: &mut LockedBridge, method: &str, mut args: Args) -> Result<(), RpcError> {
    match method {
        "register_vehicle" => autopilot(bridge, args, true),
        "unregister_vehicle" => autopilot(bridge, args, false),
        "set_percentage_speed_difference" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::SPEED_REDUCTION, args.f32()? / 100.0)
        }
        "set_global_percentage_speed_difference" => {
            set_param(bridge, 0, param::SPEED_REDUCTION, args.f32()? / 100.0)
        }
        "set_distance_to_leading_vehicle" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::GAP_M, args.f32()?)
        }
        "set_global_distance_to_leading_vehicle" => set_param(bridge, 0, param::GAP_M, args.f32()?),
        "set_percentage_running_light" => set_percentage(bridge, args, param::IGNORE_LIGHTS),
        "set_desired_speed" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::SPEED_MPS, args.f32()? / 3.6)
        }
        // CARLA's offset is positive to the right.
        "set_lane_offset" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::OFFSET_LEFT_M, -args.f32()?)
        }
        "set_global_lane_offset" => set_param(bridge, 0, param::OFFSET_LEFT_M, -args.f32()?),
        "set_auto_lane_change" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::CHANGES_LANES, f32::from(args.bool()?))
        }
        // True means to the right.
        "set_force_lane_change" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::CHANGE_NOW, if args.bool()? { -1.0 } else { 1.0 })
        }
        "set_collision_detection" => {
            let (id, other) = (actor_id(&mut args)?, actor_id(&mut args)?);
            let ignores = f32::from(!args.bool()?);
            if !bridge.exists(other) {
                return Ok(());
            }
            set_param(bridge, id, param::IGNORE_ACTOR.saturating_add(other), ignores)
        }
        "set_percentage_ignore_walkers" => set_percentage(bridge, args, param::IGNORE_WALKERS),
        "set_percentage_ignore_vehicles" => set_percentage(bridge, args, param::IGNORE_VEHICLES),
        "set_percentage_running_sign" => set_percentage(bridge, args, param::IGNORE_SIGNS),
        "keep_slow_lane_rule_percentage" | "set_percentage_keep_slow_lane_rule" => {
            set_percentage(bridge, args, param::KEEP_RIGHT)
        }
        "random_left_lanechange_percentage" | "set_percentage_random_left_lanechange" => {
            set_percentage(bridge, args, param::CHANGE_LEFT)
        }
        "random_right_lanechange_percentage" | "set_percentage_random_right_lanechange" => {
            set_percentage(bridge, args, param::CHANGE_RIGHT)
        }
        // A parameter is an f32, which holds integers of 24 bits.
        "set_random_device_seed" => {
            let seed = args.int()? as u64;
            set_param(
                bridge,
                0,
                param::SEED,
                ((seed ^ (seed >> 24) ^ (seed >> 48)) & 0xff_ffff) as f32,
            )
        }
        "update_vehicle_lights" => {
            let id = actor_id(&mut args)?;
            set_param(bridge, id, param::LAMPS, f32::from(args.bool()?))
        }
        "set_path" => {
            let id = actor_id(&mut args)?;
            set_path(bridge, id, args)
        }
        "update_custom_path" => {
            let id = args.u32()?;
            set_path(bridge, id, args)
        }
        "set_imported_route" => {
            let id = actor_id(&mut args)?;
            set_route(bridge, id, args)
        }
        "update_imported_route" => {
            let id = args.u32()?;
            set_route(bridge, id, args)
        }
        "remove_custom_path" | "remove_imported_route" => {
            let id = args.u32()?;
            send_route(bridge, id, &[])
        }
        _ => Err(format!("rpclib: server could not find function '{method}'").into()),
    }
}

/// Reads an actor and returns its id.
fn actor_id(args: &mut Args) -> Result<u32, RpcError> {
    args.list()?.u32()
}

fn autopilot(bridge: &mut LockedBridge, mut args: Args, on: bool) -> Result<(), RpcError> {
    let mut list = args.list()?;
    while list.len() > 0 {
        let id = actor_id(&mut list)?;
        bridge.set_autopilot(id, on)?;
    }
    Ok(())
}

/// Sets a parameter of one vehicle from a percentage.
fn set_percentage(bridge: &mut LockedBridge, mut args: Args, param: u32) -> Result<(), RpcError> {
    let id = actor_id(&mut args)?;
    set_param(bridge, id, param, args.f32()? / 100.0)
}

/// Sets the path of a vehicle: a list of CARLA's locations.
fn set_path(bridge: &mut LockedBridge, id: u32, mut args: Args) -> Result<(), RpcError> {
    let mut list = args.list()?;
    let mut steps = Vec::with_capacity(list.len());
    while list.len() > 0 {
        steps.push(RouteStep::place(wire::location(&mut list)?));
    }
    send_route(bridge, id, &steps)
}

/// Sets the route of a vehicle: a list of CARLA's `RoadOption`s. Options without a manoeuvre are
/// skipped.
fn set_route(bridge: &mut LockedBridge, id: u32, mut args: Args) -> Result<(), RpcError> {
    let steps = args.bytes()?.iter().filter_map(|option| {
        Some(RouteStep::turn(match option {
            1 => route_step::LEFT,
            2 => route_step::RIGHT,
            3 => route_step::STRAIGHT,
            5 => route_step::LANE_LEFT,
            6 => route_step::LANE_RIGHT,
            _ => return None,
        }))
    });
    let steps: Vec<RouteStep> = steps.collect();
    send_route(bridge, id, &steps)
}

fn send_route(bridge: &mut LockedBridge, id: u32, steps: &[RouteStep]) -> Result<(), RpcError> {
    for part in RouteCommand::route(ActorId(id), steps) {
        bridge.command(Command::RouteCommand(part));
    }
    Ok(())
}

/// Sets a parameter of one vehicle; 0: of all. Traffic keeps the parameters of every actor until it is
/// destroyed, so those of actors that do not exist are ignored, as in CARLA.
fn set_param(bridge: &mut LockedBridge, id: u32, param: u32, value: f32) -> Result<(), RpcError> {
    if id != 0 && !bridge.exists(id) {
        return Ok(());
    }
    bridge.command(Command::TrafficParam(TrafficParam { actor_id: ActorId(id), param, value }));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However long the bridge is locked: a check that is answered after two seconds lets the
    /// official client wait for ever.
    #[test]
    fn the_check_of_the_official_client_is_answered_without_the_bridge() {
        let mut out = Pack::new();
        assert!(answer_at_once("health_check_remote_TM", &mut out));
        assert_eq!(out.into_bytes(), [0xc0, 0xc0]);
        assert!(!answer_at_once("register_vehicle", &mut Pack::new()));
    }
}
