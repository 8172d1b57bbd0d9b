//! The traffic manager's port: CARLA's params, turned at our traffic.
//!
//! Its calls have no metadata and no wrapper: a refusal is an error of the call itself.

use std::sync::{Arc, Mutex, PoisonError};

use client_lib::{ActorId, wire::{Command, RouteCommand, RouteStep, TrafficParam, param, route_step}};

use crate::{
    args::{Args, Refusal},
    bridge::Bridge,
    msgpack::{Pack, Value},
    rpc::{Callee, Peer},
    wire,
};

/// The traffic manager, as every client is told that one runs.
pub(crate) struct Manager {
    pub(crate) bridge: Arc<Mutex<Bridge>>,
}

impl Callee for Manager {
    fn call(&self, _: &Peer, method: &str, params: &[Value], out: &mut Pack) {
        let mut bridge = self.bridge.lock().unwrap_or_else(PoisonError::into_inner);
        let ended = carry_out(&mut bridge, method, Args::new(params));
        bridge.send_news();
        match ended {
            Ok(()) => out.nil().nil(),
            Err(Refusal(why)) => {
                ::log::warn!("traffic manager: {method}: {why}");
                out.text(&why).nil()
            }
        };
    }
}

fn carry_out(bridge: &mut Bridge, method: &str, mut args: Args) -> Result<(), Refusal> {
    match method {
        "register_vehicle" => autopilot(bridge, args, true),
        "unregister_vehicle" => autopilot(bridge, args, false),
        "set_percentage_speed_difference" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::SPEED_REDUCTION, args.f32()? / 100.0)
        }
        "set_global_percentage_speed_difference" => {
            turn(bridge, 0, param::SPEED_REDUCTION, args.f32()? / 100.0)
        }
        "set_distance_to_leading_vehicle" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::GAP_M, args.f32()?)
        }
        "set_global_distance_to_leading_vehicle" => turn(bridge, 0, param::GAP_M, args.f32()?),
        "set_percentage_running_light" => share(bridge, args, param::IGNORE_LIGHTS),
        "set_desired_speed" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::SPEED_MPS, args.f32()? / 3.6)
        }
        // CARLA counts to the right.
        "set_lane_offset" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::OFFSET_LEFT_M, -args.f32()?)
        }
        "set_global_lane_offset" => turn(bridge, 0, param::OFFSET_LEFT_M, -args.f32()?),
        "set_auto_lane_change" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::CHANGES_LANES, f32::from(args.bool()?))
        }
        // True is the right.
        "set_force_lane_change" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::CHANGE_NOW, if args.bool()? { -1.0 } else { 1.0 })
        }
        "set_collision_detection" => {
            let (id, other) = (actor(&mut args)?, actor(&mut args)?);
            let ignores = f32::from(!args.bool()?);
            turn(bridge, id, param::IGNORE_ACTOR.saturating_add(other), ignores)
        }
        "set_percentage_ignore_walkers" => share(bridge, args, param::IGNORE_WALKERS),
        "set_percentage_ignore_vehicles" => share(bridge, args, param::IGNORE_VEHICLES),
        "set_percentage_running_sign" => share(bridge, args, param::IGNORE_SIGNS),
        "keep_slow_lane_rule_percentage" | "set_percentage_keep_slow_lane_rule" => {
            share(bridge, args, param::KEEP_RIGHT)
        }
        "random_left_lanechange_percentage" | "set_percentage_random_left_lanechange" => {
            share(bridge, args, param::CHANGE_LEFT)
        }
        "random_right_lanechange_percentage" | "set_percentage_random_right_lanechange" => {
            share(bridge, args, param::CHANGE_RIGHT)
        }
        // A number of 24 bits is all that a param holds.
        "set_random_device_seed" => {
            let seed = args.int()? as u64;
            turn(bridge, 0, param::SEED, ((seed ^ (seed >> 24) ^ (seed >> 48)) & 0xff_ffff) as f32)
        }
        "update_vehicle_lights" => {
            let id = actor(&mut args)?;
            turn(bridge, id, param::LAMPS, f32::from(args.bool()?))
        }
        "set_path" => {
            let id = actor(&mut args)?;
            path(bridge, id, args)
        }
        "update_custom_path" => {
            let id = args.u32()?;
            path(bridge, id, args)
        }
        "set_imported_route" => {
            let id = actor(&mut args)?;
            route(bridge, id, args)
        }
        "update_imported_route" => {
            let id = args.u32()?;
            route(bridge, id, args)
        }
        "remove_custom_path" | "remove_imported_route" => {
            let id = args.u32()?;
            guide(bridge, id, &[])
        }
        // Traffic here is always in step with the world, and drives all alike.
        "health_check_remote_TM"
        | "set_synchronous_mode"
        | "set_synchronous_mode_timeout_in_milisecond"
        | "synchronous_tick"
        | "set_hybrid_physics_mode"
        | "set_hybrid_physics_radius"
        | "set_osm_mode"
        | "set_respawn_dormant_vehicles"
        | "set_boundaries_respawn_dormant_vehicles"
        | "set_max_boundaries"
        | "get_next_action"
        | "get_all_actions"
        | "shut_down" => Ok(()),
        _ => Err(format!("rpclib: server could not find function '{method}'").into()),
    }
}

/// The id of a whole actor.
fn actor(args: &mut Args) -> Result<u32, Refusal> {
    args.list()?.u32()
}

fn autopilot(bridge: &mut Bridge, mut args: Args, on: bool) -> Result<(), Refusal> {
    let mut list = args.list()?;
    while list.len() > 0 {
        let id = actor(&mut list)?;
        bridge.set_autopilot(id, on)?;
    }
    Ok(())
}

/// One vehicle's percentage.
fn share(bridge: &mut Bridge, mut args: Args, param: u32) -> Result<(), Refusal> {
    let id = actor(&mut args)?;
    turn(bridge, id, param, args.f32()? / 100.0)
}

/// Locations of CARLA's, to come by one after the other.
fn path(bridge: &mut Bridge, id: u32, mut args: Args) -> Result<(), Refusal> {
    let mut list = args.list()?;
    let mut steps = Vec::with_capacity(list.len());
    while list.len() > 0 {
        steps.push(RouteStep::place(wire::location(&mut list)?));
    }
    guide(bridge, id, &steps)
}

/// CARLA's `RoadOption`s. Those that ask for nothing in particular are no steps.
fn route(bridge: &mut Bridge, id: u32, mut args: Args) -> Result<(), Refusal> {
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
    guide(bridge, id, &steps)
}

fn guide(bridge: &mut Bridge, id: u32, steps: &[RouteStep]) -> Result<(), Refusal> {
    for part in RouteCommand::route(ActorId(id), steps) {
        bridge.command(Command::RouteCommand(part));
    }
    Ok(())
}

fn turn(bridge: &mut Bridge, id: u32, param: u32, value: f32) -> Result<(), Refusal> {
    bridge.command(Command::TrafficParam(TrafficParam { actor_id: ActorId(id), param, value }));
    Ok(())
}
