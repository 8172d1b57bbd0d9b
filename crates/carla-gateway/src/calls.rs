//! The server of port 2000: every call by name, the function that implements it, and the form of
//! its answer.

mod actors;
mod batch;
mod bones;
mod call;
mod drawing;
mod episode;
mod map;
mod motion;
mod physics;
mod recorder;
mod signals;
mod surroundings;
mod textures;
mod vehicles;

pub(crate) use vehicles::read_control;

use std::sync::Arc;

pub(crate) use call::Ports;

use crate::{
    args::{Args, RpcError},
    bridge::outbox::WAITING_MAX,
    calls::call::{Call, StaticCall},
    msgpack::{Pack, Value},
    recordings::Recordings,
    rpc::{Handler, Peer},
    shared_bridge::SharedBridge,
    statics::SharedStatics,
    traffic_managers::TrafficManagers,
};

/// The form of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// A value or an error.
    Value,
    /// Nothing or an error.
    Nothing,
    /// A value without a wrapper; an error is one of the call itself.
    Bare,
}

use Form::{Bare, Nothing, Value as Val};

type Entry<F> = (&'static str, Form, F);
type StaticFn = fn(&mut StaticCall) -> Result<(), RpcError>;
type CallFn = fn(&mut Call) -> Result<(), RpcError>;

/// Calls that depend on the map at most. They do not lock the bridge, so they are answered while
/// another connection waits for a tick or for a world to load. Sorted by name.
#[rustfmt::skip]
const STATIC_CALLS: &[Entry<StaticFn>] = &[
    ("add_traffic_manager_running", Val, |c| { c.out.bool(false); Ok(()) }),
    ("apply_color_texture_to_objects", Nothing, |_| refuse("textures")),
    ("apply_float_color_texture_to_objects", Nothing, |_| refuse("textures")),
    ("console_command", Val, |_| refuse("Unreal's console")),
    ("destroy_traffic_manager", Val, |c| { c.out.bool(true); Ok(()) }),
    ("disable_sensor_for_ros", Nothing, ignore),
    ("enable_carsim", Nothing, |_| refuse("CarSim")),
    ("enable_chrono_physics", Nothing, |_| refuse("Chrono")),
    ("enable_sensor_for_ros", Nothing, |_| refuse("ROS")),
    ("get_actor_component_names", Val, |_| refuse("components")),
    ("get_actor_component_relative_transform", Val, |_| refuse("components")),
    ("get_actor_component_world_transform", Val, |_| refuse("components")),
    ("get_actor_definitions", Val, map::definitions),
    ("get_actor_socket_names", Val, |_| refuse("sockets")),
    ("get_actor_socket_relative_transforms", Val, |_| refuse("sockets")),
    ("get_actor_socket_world_transforms", Val, |_| refuse("sockets")),
    ("get_environment_objects", Val, map::environment_objects),
    ("get_map_data", Val, map::open_drive),
    ("get_map_info", Val, map::info),
    ("get_names_of_all_objects", Val, map::object_names),
    ("get_navigation_mesh", Val, map::navigation_mesh),
    ("get_required_files", Val, map::files),
    ("get_traffic_manager_running", Val, map::traffic_manager),
    ("get_wheel_pitch_angle", Val, |_| refuse("wheels that pitch")),
    ("is_sensor_enabled_for_ros", Val, |c| { c.out.bool(false); Ok(()) }),
    ("is_traffic_manager_running", Val, |c| { c.out.bool(true); Ok(()) }),
    ("request_file", Val, map::file),
    ("restore_physx_physics", Nothing, ignore),
    ("set_annotations_traverse_translucency", Nothing, ignore),
    ("set_ignored_vehicles", Nothing, |_| refuse("sensors that overlook vehicles")),
    ("set_wheel_pitch_angle", Nothing, |_| refuse("wheels that pitch")),
    ("set_wheel_steer_direction", Nothing, |_| refuse("wheels with a steering angle of their own")),
    ("show_vehicle_debug_telemetry", Nothing, ignore),
    ("use_carsim_road", Nothing, |_| refuse("CarSim")),
    ("version", Val, |c| { c.out.text(VERSION); Ok(()) }),
];

/// Calls that lock the bridge, except while they wait for the host. Sorted by name.
#[rustfmt::skip]
const CALLS: &[Entry<CallFn>] = &[
    ("add_actor_angular_impulse", Nothing, physics::angular_impulse),
    ("add_actor_force", Nothing, physics::force),
    ("add_actor_force_at_location", Nothing, physics::force),
    ("add_actor_impulse", Nothing, physics::impulse),
    ("add_actor_impulse_at_location", Nothing, physics::impulse),
    ("add_actor_torque", Nothing, physics::torque),
    ("apply_ackermann_control_to_vehicle", Nothing, physics::ackermann),
    ("apply_ackermann_controller_settings", Nothing, physics::set_ackermann_settings),
    ("apply_batch", Bare, batch::apply),
    ("apply_control_to_vehicle", Nothing, vehicles::control),
    ("apply_control_to_walker", Nothing, motion::walk),
    ("apply_physics_control", Nothing, physics::apply_control),
    ("are_gbuffers_enabled", Val, textures::are_enabled),
    ("blend_pose", Nothing, bones::blend),
    ("cast_ray", Val, surroundings::cast_ray),
    ("clear_debug_shape", Nothing, drawing::clear_shapes),
    ("clear_debug_string", Nothing, drawing::clear_texts),
    ("close_vehicle_door", Nothing, vehicles::close_door),
    ("copy_opendrive_to_file", Nothing, episode::receive_open_drive),
    ("destroy_actor", Val, actors::destroy),
    ("disable_actor_constant_velocity", Nothing, motion::release),
    ("draw_debug_shape", Nothing, drawing::draw),
    ("enable_actor_constant_velocity", Nothing, motion::hold),
    ("enable_environment_objects", Nothing, surroundings::enable),
    ("enable_gbuffers", Nothing, textures::enable),
    ("freeze_all_traffic_lights", Nothing, signals::freeze_all),
    ("freeze_traffic_light", Nothing, signals::freeze),
    ("get_ackermann_controller_settings", Val, physics::ackermann_settings),
    ("get_actor_bone_names", Val, bones::names),
    ("get_actor_bone_relative_transforms", Val, bones::relative),
    ("get_actor_bone_world_transforms", Val, bones::in_world),
    ("get_actor_bounding_box", Val, actors::bounding_box),
    ("get_actors_by_id", Val, actors::by_id),
    ("get_all_level_BBs", Val, map::level_boxes),
    ("get_available_maps", Val, episode::available_maps),
    ("get_bones_transform", Val, bones::all),
    ("get_episode_info", Val, episode::info),
    ("get_episode_settings", Val, episode::settings),
    ("get_gbuffer_token", Val, textures::token),
    ("get_group_traffic_lights", Val, signals::group),
    ("get_imui_gravity", Val, |c| { c.out.f32(c.bridge.imu_gravity_mps2()); Ok(()) }),
    ("get_light_boxes", Val, signals::boxes),
    ("get_physics_control", Val, physics::control),
    ("get_pose_from_animation", Nothing, bones::set_from_animation),
    ("get_sensor_token", Val, episode::token),
    ("get_spectator", Val, actors::spectator),
    ("get_telemetry_data", Val, physics::telemetry),
    ("get_vehicle_bone_world_transforms", Val, bones::in_world),
    ("get_vehicle_light_state", Val, vehicles::light_state),
    ("get_vehicle_light_states", Val, vehicles::light_states),
    ("get_weather_parameters", Val, episode::weather),
    ("get_wheel_steer_angle", Val, physics::wheel_angle),
    ("load_map_layer", Nothing, surroundings::load_layer),
    ("load_new_episode", Nothing, episode::load),
    ("open_vehicle_door", Nothing, vehicles::open_door),
    ("project_point", Val, surroundings::project_point),
    ("query_lights_state", Val, surroundings::street_lights),
    ("replay_file", Val, recorder::replay),
    ("reset_all_traffic_lights", Nothing, signals::reset_all),
    ("reset_traffic_light_group", Nothing, signals::reset_group),
    ("send", Nothing, vehicles::send_text),
    ("set_actor_autopilot", Nothing, vehicles::autopilot),
    ("set_actor_collisions", Nothing, physics::collisions),
    ("set_actor_dead", Nothing, actors::set_dead),
    ("set_actor_enable_gravity", Nothing, physics::gravity),
    ("set_actor_location", Nothing, motion::locate),
    ("set_actor_simulate_physics", Nothing, motion::simulate_physics),
    ("set_actor_target_angular_velocity", Nothing, motion::target_angular_velocity),
    ("set_actor_target_velocity", Nothing, motion::target_velocity),
    ("set_actor_transform", Nothing, motion::transform),
    ("set_bones_transform", Nothing, bones::set),
    ("set_episode_settings", Val, episode::set_settings),
    ("set_imui_gravity", Nothing, physics::imu_gravity),
    ("set_replayer_ignore_hero", Nothing, recorder::ignore_hero),
    ("set_replayer_ignore_spectator", Nothing, recorder::ignore_spectator),
    ("set_replayer_time_factor", Nothing, recorder::time_factor),
    ("set_traffic_light_green_time", Nothing, |c| signals::set_secs(c, 0)),
    ("set_traffic_light_red_time", Nothing, |c| signals::set_secs(c, 2)),
    ("set_traffic_light_state", Nothing, signals::set_state),
    ("set_traffic_light_yellow_time", Nothing, |c| signals::set_secs(c, 1)),
    ("set_vehicle_light_state", Nothing, vehicles::set_light_state),
    ("set_walker_state", Nothing, motion::walker_state),
    ("set_weather_parameters", Nothing, episode::set_weather),
    ("show_recorder_actors_blocked", Val, recorder::blocked),
    ("show_recorder_collisions", Val, recorder::collisions),
    ("show_recorder_file_info", Val, recorder::file_info),
    ("spawn_actor", Val, |c| actors::spawn(c, false)),
    ("spawn_actor_with_parent", Val, |c| actors::spawn(c, true)),
    ("start_recorder", Val, recorder::start),
    ("stop_recorder", Nothing, recorder::stop),
    ("stop_replayer", Nothing, recorder::stop_replay),
    ("tick_cue", Val, |c| { let frame = c.bridge.tick(c.peer)?; c.out.uint(frame); Ok(()) }),
    ("unload_map_layer", Nothing, surroundings::unload_layer),
    ("update_day_night_cycle", Nothing, surroundings::follow_sun),
    ("update_lights_state", Nothing, surroundings::set_street_lights),
];

/// The version of CARLA's protocol that this server speaks.
const VERSION: &str = "0.9.16";

/// Returns the error of a call whose feature this simulator does not have.
fn refuse(what: &str) -> Result<(), RpcError> {
    Err(format!("this simulator has no {what}").into())
}

/// Accepts a call that has no measurable effect in this simulator.
fn ignore(_: &mut StaticCall) -> Result<(), RpcError> {
    Ok(())
}

/// The server of port 2000.
pub(crate) struct RpcServer {
    pub(crate) bridge: Arc<SharedBridge>,
    pub(crate) statics: Arc<SharedStatics>,
    pub(crate) ports: Ports,
    pub(crate) managers: TrafficManagers,
    pub(crate) recordings: Recordings,
}

impl Handler for RpcServer {
    fn call(&self, peer: &Peer, method: &str, params: &[Value], out: &mut Pack) {
        let manager_port = |wanted: u16| self.managers.port(wanted);
        if answer_static(&self.statics, &manager_port, peer, method, params, out) {
            return;
        }
        let Some(entry) = find(CALLS, method) else {
            let count = params.len();
            out.text(&format!(
                "rpclib: server could not find function '{method}' with argument count {count}."
            ));
            out.nil();
            return;
        };
        answer(entry, peer, params, out, |function, args, out| {
            let bridge = self.bridge.lock();
            // Calls that return a value read the world, tick it, or wait for the host.
            if entry.1 != Val && bridge.outbox.is_full() {
                return Err(format!("{WAITING_MAX} commands wait for the next tick").into());
            }
            let (ports, recordings) = (self.ports, &self.recordings);
            let mut call = Call { bridge, args, out, peer, ports, recordings };
            let result = function(&mut call);
            call.bridge.flush_after_call();
            result
        });
    }

    fn on_disconnect(&self, peer: &Peer) {
        self.bridge.lock().on_disconnect(peer);
    }
}

/// Answers a call that does not need the bridge; returns whether it is one.
fn answer_static(
    statics: &SharedStatics,
    manager_port: &dyn Fn(u16) -> Result<u16, RpcError>,
    peer: &Peer,
    method: &str,
    params: &[Value],
    out: &mut Pack,
) -> bool {
    let Some(entry) = find(STATIC_CALLS, method) else { return false };
    answer(entry, peer, params, out, |function, args, out| {
        function(&mut StaticCall { statics: statics.get(), args, out, peer, manager_port })
    });
    true
}

fn find<F>(table: &'static [Entry<F>], method: &str) -> Option<&'static Entry<F>> {
    let index = table.binary_search_by_key(&method, |(name, ..)| *name).ok()?;
    Some(&table[index])
}

/// Executes a call and writes its answer in the form that its clients expect.
fn answer<F>(
    (name, form, function): &Entry<F>,
    peer: &Peer,
    params: &[Value],
    out: &mut Pack,
    execute: impl FnOnce(&F, Args, &mut Pack) -> Result<(), RpcError>,
) {
    // The first argument says whether the client reads the answer.
    let (is_async, params) = match params.split_first() {
        Some((Value::List(metadata), rest)) => (metadata.first() == Some(&Value::Bool(true)), rest),
        _ => (false, params),
    };
    out.nil();
    let start = out.bytes().len();
    match form {
        Val => out.list(1).list(2).uint(1),
        Nothing => out.list(1).list(1).bool(false),
        Bare => &mut *out,
    };
    let Err(RpcError(why)) = execute(function, Args::new(params), out) else { return };
    if is_async {
        log::warn!("call {name} of {} failed: {why}", peer.address);
    }
    out.truncate(start);
    match form {
        Val => out.list(1).list(2).uint(0).list(1).text(&why),
        Nothing => out.list(1).list(2).bool(true).list(1).text(&why),
        Bare => {
            out.truncate(start - 1);
            out.text(&why).nil()
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statics::Statics;

    #[test]
    fn both_tables_are_sorted_and_contain_all_130_calls() {
        assert!(STATIC_CALLS.is_sorted_by_key(|(name, ..)| *name));
        assert!(CALLS.is_sorted_by_key(|(name, ..)| *name));
        assert!(CALLS.iter().all(|(name, ..)| find(STATIC_CALLS, name).is_none()));
        assert_eq!(STATIC_CALLS.len() + CALLS.len(), 130);
    }

    /// The bridge stays locked while a connection waits for a tick or for a world to load.
    #[test]
    fn calls_about_the_map_are_answered_while_the_bridge_is_locked() {
        let open_drive = mapgen::named("Town01").unwrap();
        let network = Arc::new(road::Network::parse(&open_drive).unwrap());
        let episode = client_lib::wire::Episode {
            map: "maps/Town01.xodr".into(),
            open_drive: open_drive.clone(),
            seed: 1,
        };
        let statics = SharedStatics::new(Arc::new(Statics::new(episode, network)));
        let address = ([127, 0, 0, 1], 2000).into();
        let peer = Peer { number: 1, address, local: address };
        let port = |_: u16| Ok(8000);
        let ask = |method: &str| {
            let mut out = Pack::new();
            assert!(answer_static(&statics, &port, &peer, method, &[], &mut out), "{method}");
            out.into_bytes()
        };
        let contains = |bytes: &[u8], text: &[u8]| bytes.windows(text.len()).any(|w| w == text);
        assert!(contains(&ask("version"), VERSION.as_bytes()));
        assert!(contains(&ask("get_map_info"), b"Carla/Maps/Town01"));
        assert!(ask("get_map_data").ends_with(open_drive.as_bytes()));
        assert!(contains(&ask("get_actor_definitions"), b"vehicle.tesla.model3"));
    }
}
