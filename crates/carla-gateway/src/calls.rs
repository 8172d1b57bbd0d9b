//! Every call of port 2000, by name: what answers it, and in which form.

mod actors;
mod bones;
mod drawing;
mod episode;
mod motion;
mod physics;
mod recorder;
mod signals;
mod surroundings;
mod textures;
mod vehicles;

use std::sync::{Arc, Mutex, PoisonError};

pub(crate) use vehicles::pedals;

use crate::{
    args::{Args, Refusal},
    batch,
    bridge::Bridge,
    msgpack::{Pack, Value},
    rpc::{Callee, Peer},
};

/// One call in the making.
pub(crate) struct Call<'a> {
    pub(crate) bridge: &'a mut Bridge,
    pub(crate) args: Args<'a>,
    /// For what is answered: one value, if anything.
    pub(crate) out: &'a mut Pack,
    pub(crate) peer: &'a Peer,
    pub(crate) ports: Ports,
}

/// Where this process listens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ports {
    pub(crate) streams: u16,
    pub(crate) manager: u16,
}

type Handler = fn(&mut Call) -> Result<(), Refusal>;

/// The form of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    /// A value, or why there is none.
    Value,
    /// Nothing, or why not.
    Nothing,
    /// A value that has no form for refusals.
    Bare,
}

use Form::{Bare, Nothing, Value as Val};

/// Sorted by name.
#[rustfmt::skip]
const CALLS: &[(&str, Form, Handler)] = &[
    ("add_actor_angular_impulse", Nothing, physics::angular_impulse),
    ("add_actor_force", Nothing, physics::force),
    ("add_actor_force_at_location", Nothing, physics::force),
    ("add_actor_impulse", Nothing, physics::impulse),
    ("add_actor_impulse_at_location", Nothing, physics::impulse),
    ("add_actor_torque", Nothing, physics::torque),
    ("add_traffic_manager_running", Val, |c| { c.out.bool(false); Ok(()) }),
    ("apply_ackermann_control_to_vehicle", Nothing, physics::ackermann),
    ("apply_ackermann_controller_settings", Nothing, physics::set_ackermann_settings),
    ("apply_batch", Bare, batch::apply),
    ("apply_color_texture_to_objects", Nothing, |_| refuse("textures")),
    ("apply_control_to_vehicle", Nothing, vehicles::control),
    ("apply_control_to_walker", Nothing, motion::walk),
    ("apply_float_color_texture_to_objects", Nothing, |_| refuse("textures")),
    ("apply_physics_control", Nothing, physics::apply_control),
    ("are_gbuffers_enabled", Val, textures::are_enabled),
    ("blend_pose", Nothing, bones::blend),
    ("cast_ray", Val, surroundings::cast_ray),
    ("clear_debug_shape", Nothing, drawing::clear_shapes),
    ("clear_debug_string", Nothing, drawing::clear_texts),
    ("close_vehicle_door", Nothing, vehicles::close_door),
    ("console_command", Val, |_| refuse("Unreal's console")),
    ("copy_opendrive_to_file", Nothing, episode::take_open_drive),
    ("destroy_actor", Val, actors::destroy),
    ("destroy_traffic_manager", Val, |c| { c.out.bool(true); Ok(()) }),
    ("disable_actor_constant_velocity", Nothing, motion::release),
    ("disable_sensor_for_ros", Nothing, ignore),
    ("draw_debug_shape", Nothing, drawing::draw),
    ("enable_actor_constant_velocity", Nothing, motion::hold),
    ("enable_carsim", Nothing, |_| refuse("CarSim")),
    ("enable_chrono_physics", Nothing, |_| refuse("Chrono")),
    ("enable_environment_objects", Nothing, surroundings::enable),
    ("enable_gbuffers", Nothing, textures::enable),
    ("enable_sensor_for_ros", Nothing, |_| refuse("ROS")),
    ("freeze_all_traffic_lights", Nothing, signals::freeze_all),
    ("freeze_traffic_light", Nothing, signals::freeze),
    ("get_ackermann_controller_settings", Val, physics::ackermann_settings),
    ("get_actor_bone_names", Val, bones::names),
    ("get_actor_bone_relative_transforms", Val, bones::relative),
    ("get_actor_bone_world_transforms", Val, bones::in_world),
    ("get_actor_bounding_box", Val, actors::bounding_box),
    ("get_actor_component_names", Val, |_| refuse("components")),
    ("get_actor_component_relative_transform", Val, |_| refuse("components")),
    ("get_actor_component_world_transform", Val, |_| refuse("components")),
    ("get_actor_definitions", Val, actors::definitions),
    ("get_actor_socket_names", Val, |_| refuse("sockets")),
    ("get_actor_socket_relative_transforms", Val, |_| refuse("sockets")),
    ("get_actor_socket_world_transforms", Val, |_| refuse("sockets")),
    ("get_actors_by_id", Val, actors::by_id),
    ("get_all_level_BBs", Val, surroundings::level_boxes),
    ("get_available_maps", Val, episode::available_maps),
    ("get_bones_transform", Val, bones::all),
    ("get_environment_objects", Val, surroundings::environment_objects),
    ("get_episode_info", Val, episode::info),
    ("get_episode_settings", Val, episode::settings),
    ("get_gbuffer_token", Val, textures::token),
    ("get_group_traffic_lights", Val, signals::group),
    ("get_imui_gravity", Val, |c| { c.out.f32(c.bridge.imu_gravity_mps2); Ok(()) }),
    ("get_light_boxes", Val, signals::boxes),
    ("get_map_data", Val, episode::map_data),
    ("get_map_info", Val, episode::map_info),
    ("get_names_of_all_objects", Val, surroundings::names),
    ("get_navigation_mesh", Val, episode::navigation_mesh),
    ("get_physics_control", Val, physics::control),
    ("get_pose_from_animation", Nothing, bones::keep),
    ("get_required_files", Val, episode::files),
    ("get_sensor_token", Val, episode::token),
    ("get_spectator", Val, actors::spectator),
    ("get_telemetry_data", Val, physics::telemetry),
    ("get_traffic_manager_running", Val, episode::manager),
    ("get_vehicle_bone_world_transforms", Val, bones::in_world),
    ("get_vehicle_light_state", Val, vehicles::light_state),
    ("get_vehicle_light_states", Val, vehicles::light_states),
    ("get_weather_parameters", Val, episode::weather),
    ("get_wheel_pitch_angle", Val, |_| refuse("wheels that pitch")),
    ("get_wheel_steer_angle", Val, vehicles::wheel_angle),
    ("is_sensor_enabled_for_ros", Val, |c| { c.out.bool(false); Ok(()) }),
    ("is_traffic_manager_running", Val, |c| { c.out.bool(true); Ok(()) }),
    ("load_map_layer", Nothing, surroundings::load_layer),
    ("load_new_episode", Nothing, episode::load),
    ("open_vehicle_door", Nothing, vehicles::open_door),
    ("project_point", Val, surroundings::project_point),
    ("query_lights_state", Val, surroundings::lamps),
    ("replay_file", Val, recorder::replay),
    ("request_file", Val, episode::file),
    ("reset_all_traffic_lights", Nothing, signals::reset_all),
    ("reset_traffic_light_group", Nothing, signals::reset_group),
    ("restore_physx_physics", Nothing, ignore),
    ("send", Nothing, vehicles::send_text),
    ("set_actor_autopilot", Nothing, vehicles::autopilot),
    ("set_actor_collisions", Nothing, physics::collisions),
    ("set_actor_dead", Nothing, ignore),
    ("set_actor_enable_gravity", Nothing, physics::gravity),
    ("set_actor_location", Nothing, motion::locate),
    ("set_actor_simulate_physics", Nothing, motion::simulate_physics),
    ("set_actor_target_angular_velocity", Nothing, motion::target_angular_velocity),
    ("set_actor_target_velocity", Nothing, motion::target_velocity),
    ("set_actor_transform", Nothing, motion::transform),
    ("set_annotations_traverse_translucency", Nothing, ignore),
    ("set_bones_transform", Nothing, bones::set),
    ("set_episode_settings", Val, episode::set_settings),
    ("set_ignored_vehicles", Nothing, |_| refuse("sensors that overlook vehicles")),
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
    ("set_wheel_pitch_angle", Nothing, |_| refuse("wheels that pitch")),
    ("set_wheel_steer_direction", Nothing, |_| refuse("wheels that are turned by hand")),
    ("show_recorder_actors_blocked", Val, recorder::blocked),
    ("show_recorder_collisions", Val, recorder::collisions),
    ("show_recorder_file_info", Val, recorder::file_info),
    ("show_vehicle_debug_telemetry", Nothing, ignore),
    ("spawn_actor", Val, |c| actors::spawn(c, false)),
    ("spawn_actor_with_parent", Val, |c| actors::spawn(c, true)),
    ("start_recorder", Val, recorder::start),
    ("stop_recorder", Nothing, recorder::stop),
    ("stop_replayer", Nothing, recorder::stop_replay),
    ("tick_cue", Val, |c| { let frame = c.bridge.tick(c.peer)?; c.out.uint(frame); Ok(()) }),
    ("unload_map_layer", Nothing, surroundings::unload_layer),
    ("update_day_night_cycle", Nothing, surroundings::follow_day),
    ("update_lights_state", Nothing, surroundings::switch_lamps),
    ("use_carsim_road", Nothing, |_| refuse("CarSim")),
    ("version", Val, |c| { c.out.text(VERSION); Ok(()) }),
];

/// The one version of the protocol that is spoken here.
const VERSION: &str = "0.9.16";

fn refuse(what: &str) -> Result<(), Refusal> {
    Err(format!("this simulator has no {what}").into())
}

/// What changes nothing that anybody could measure.
fn ignore(_: &mut Call) -> Result<(), Refusal> {
    Ok(())
}

/// Port 2000.
pub(crate) struct Desk {
    pub(crate) bridge: Arc<Mutex<Bridge>>,
    pub(crate) ports: Ports,
}

impl Callee for Desk {
    fn call(&self, peer: &Peer, method: &str, params: &[Value], out: &mut Pack) {
        let Ok(index) = CALLS.binary_search_by_key(&method, |(name, ..)| name) else {
            let count = params.len();
            out.text(&format!(
                "rpclib: server could not find function '{method}' with argument count {count}."
            ));
            out.nil();
            return;
        };
        let (name, form, handler) = CALLS[index];
        // The first argument says whether anybody reads the answer.
        let (is_async, params) = match params.split_first() {
            Some((Value::List(metadata), rest)) => {
                (metadata.first() == Some(&Value::Bool(true)), rest)
            }
            _ => (false, params),
        };
        out.nil();
        let begun = out.bytes().len();
        match form {
            Val => out.list(1).list(2).uint(1),
            Nothing => out.list(1).list(1).bool(false),
            Bare => out,
        };
        let ended = {
            let mut bridge = self.bridge.lock().unwrap_or_else(PoisonError::into_inner);
            let args = Args::new(params);
            let mut call = Call { bridge: &mut bridge, args, out, peer, ports: self.ports };
            let ended = handler(&mut call);
            bridge.send_news();
            ended
        };
        let Err(Refusal(why)) = ended else { return };
        if is_async {
            // The client throws the answer away.
            ::log::warn!("{name} of {}: {why}", peer.address);
        }
        out.truncate(begun);
        match form {
            Val => out.list(1).list(2).uint(0).list(1).text(&why),
            Nothing => out.list(1).list(2).bool(true).list(1).text(&why),
            Bare => {
                out.truncate(begun - 1);
                out.text(&why).nil()
            }
        };
    }

    fn hung_up(&self, peer: &Peer) {
        self.bridge.lock().unwrap_or_else(PoisonError::into_inner).forget(peer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_are_sorted_and_all_130_are_there() {
        assert!(CALLS.is_sorted_by_key(|(name, ..)| *name));
        assert_eq!(CALLS.len(), 130);
    }
}
