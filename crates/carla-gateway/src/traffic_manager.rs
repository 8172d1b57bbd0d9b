//! The server of a traffic manager's port: CARLA's parameters as those of our traffic.
//!
//! Its calls have no metadata and no wrapper; an error is one of the call itself.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex},
};

use client_lib::{
    ActorId,
    wire::{Command, RouteCommand, RouteStep, TrafficParam, param, route_step},
};

use crate::{
    args::{Args, RpcError},
    bridge::outbox::WAITING_MAX,
    msgpack::{Pack, Value},
    rpc::{Handler, Peer},
    shared_bridge::{LockedBridge, SharedBridge, lock},
    vehicle_owners::Owners,
    wire,
};

/// Calls that change nothing here: traffic is always in step with the world.
///
/// They are answered without the bridge. The official client sends `health_check_remote_TM` every two
/// seconds. If the answer takes longer than that, it discards the next state of the world that it
/// receives, and a `World.tick` that waits for that state never ends.
const WITHOUT_EFFECT: &[&str] = &[
    "health_check_remote_TM",
    "set_synchronous_mode",
    "set_synchronous_mode_timeout_in_milisecond",
    "synchronous_tick",
    "set_max_boundaries",
    "get_next_action",
    "get_all_actions",
];

/// Parameters of all vehicles of a traffic manager, with the values of one that sets none.
const OF_ALL: [(u32, f32); 3] =
    [(param::SPEED_REDUCTION, 0.0), (param::GAP_M, GAP_M), (param::OFFSET_LEFT_M, 0.0)];
/// The distance of traffic to a leading vehicle if none is set. Metres.
const GAP_M: f32 = 2.0;

/// A traffic manager, which is always running.
pub(crate) struct TrafficManager {
    bridge: Arc<SharedBridge>,
    owners: Arc<Owners>,
    /// The port that clients ask for; `None`: the default one. What is set for all vehicles there holds for
    /// vehicles of other clients too.
    number: Option<u16>,
    params: Mutex<ManagerParams>,
}

/// Parameters of a traffic manager.
#[derive(Default)]
struct ManagerParams {
    /// Values of all of its vehicles, by parameter.
    of_all: BTreeMap<u32, f32>,
    /// Vehicles and parameters with values of their own.
    own: BTreeSet<(u32, u32)>,
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
            self.execute(&mut bridge, method, Args::new(params))
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

impl TrafficManager {
    pub(crate) fn new(
        bridge: Arc<SharedBridge>,
        owners: Arc<Owners>,
        number: Option<u16>,
    ) -> TrafficManager {
        TrafficManager { bridge, owners, number, params: Mutex::default() }
    }

    fn execute(
        &self,
        bridge: &mut LockedBridge,
        method: &str,
        mut args: Args,
    ) -> Result<(), RpcError> {
        match method {
            "register_vehicle" => self.register(bridge, args),
            "unregister_vehicle" => self.unregister(bridge, args),
            "shut_down" => {
                let vehicles = self.owners.of(self.number);
                vehicles.into_iter().try_for_each(|id| self.end_autopilot(bridge, id))
            }
            "set_percentage_speed_difference" => {
                let id = actor_id(&mut args)?;
                self.set_for_one(bridge, id, param::SPEED_REDUCTION, args.f32()? / 100.0)
            }
            "set_global_percentage_speed_difference" => {
                self.set_for_all(bridge, param::SPEED_REDUCTION, args.f32()? / 100.0)
            }
            "set_distance_to_leading_vehicle" => {
                let id = actor_id(&mut args)?;
                self.set_for_one(bridge, id, param::GAP_M, args.f32()?)
            }
            "set_global_distance_to_leading_vehicle" => {
                self.set_for_all(bridge, param::GAP_M, args.f32()?)
            }
            "set_percentage_running_light" => set_percentage(bridge, args, param::IGNORE_LIGHTS),
            "set_desired_speed" => {
                let id = actor_id(&mut args)?;
                set_param(bridge, id, param::SPEED_MPS, args.f32()? / 3.6)
            }
            // CARLA's offset is positive to the right.
            "set_lane_offset" => {
                let id = actor_id(&mut args)?;
                self.set_for_one(bridge, id, param::OFFSET_LEFT_M, -args.f32()?)
            }
            "set_hybrid_physics_mode" => {
                set_param(bridge, 0, param::HYBRID_PHYSICS, f32::from(args.bool()?))
            }
            "set_hybrid_physics_radius" => {
                set_param(bridge, 0, param::HYBRID_RADIUS_M, args.f32()?)
            }
            "set_respawn_dormant_vehicles" => {
                bridge.episode.respawn.is_on = args.bool()?;
                Ok(())
            }
            "set_boundaries_respawn_dormant_vehicles" => {
                bridge.episode.respawn.boundaries_m = [args.f32()?, args.f32()?];
                Ok(())
            }
            "set_osm_mode" => {
                bridge.episode.dead_ends.is_on = args.bool()?;
                Ok(())
            }
            "set_global_lane_offset" => {
                self.set_for_all(bridge, param::OFFSET_LEFT_M, -args.f32()?)
            }
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
            "set_percentage_ignore_vehicles" => {
                set_percentage(bridge, args, param::IGNORE_VEHICLES)
            }
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

    fn register(&self, bridge: &mut LockedBridge, mut args: Args) -> Result<(), RpcError> {
        let mut list = args.list()?;
        while list.len() > 0 {
            let id = actor_id(&mut list)?;
            bridge.set_autopilot(id, true)?;
            self.owners.register(bridge, id, self.number);
            if self.number.is_none() {
                continue;
            }
            for (param, unset) in OF_ALL {
                let params = lock(&self.params);
                let value = params.of_all.get(&param).copied().unwrap_or(unset);
                let has_own = params.own.contains(&(id, param));
                drop(params);
                if !has_own {
                    set_param(bridge, id, param, value)?;
                }
            }
        }
        Ok(())
    }

    fn unregister(&self, bridge: &mut LockedBridge, mut args: Args) -> Result<(), RpcError> {
        let mut list = args.list()?;
        while list.len() > 0 {
            let id = actor_id(&mut list)?;
            self.end_autopilot(bridge, id)?;
        }
        Ok(())
    }

    /// Lets a vehicle be driven by its client, unless another manager has it.
    fn end_autopilot(&self, bridge: &mut LockedBridge, id: u32) -> Result<(), RpcError> {
        if self.owners.unregister(id, self.number) {
            bridge.set_autopilot(id, false)
        } else {
            Ok(())
        }
    }

    /// Sets a parameter of all vehicles of this manager that have no value of their own.
    fn set_for_all(
        &self,
        bridge: &mut LockedBridge,
        param: u32,
        value: f32,
    ) -> Result<(), RpcError> {
        if self.number.is_none() {
            return set_param(bridge, 0, param, value);
        }
        lock(&self.params).of_all.insert(param, value);
        for id in self.owners.of(self.number) {
            if !lock(&self.params).own.contains(&(id, param)) {
                set_param(bridge, id, param, value)?;
            }
        }
        Ok(())
    }

    /// Sets a parameter of a vehicle, which what is set for all does not change.
    fn set_for_one(
        &self,
        bridge: &mut LockedBridge,
        id: u32,
        param: u32,
        value: f32,
    ) -> Result<(), RpcError> {
        if self.number.is_some() {
            let mut params = lock(&self.params);
            params.own.retain(|(id, _)| bridge.exists(*id));
            params.own.insert((id, param));
        }
        set_param(bridge, id, param, value)
    }
}

/// Reads an actor and returns its id.
fn actor_id(args: &mut Args) -> Result<u32, RpcError> {
    args.list()?.u32()
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
