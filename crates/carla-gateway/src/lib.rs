//! A CARLA server: the official `carla` 0.9.16 package connects to it.
//!
//! ```text
//!  carla.Client ──calls, 2000──▶ rpc ─▶ calls ─▶ Bridge ──▶ bus
//!  sensor.listen ◀─streams, 2001── stream ◀─ state, *_messages ◀─ Bridge ◀── bus
//!  traffic manager ──calls──▶ rpc ─▶ traffic_manager ─▶ Bridge
//! ```
//!
//! The server is one client of the bus, like any other. CARLA's left-handed axes, degrees and
//! centimetres exist in this crate and in `client_lib::carla_axes` only.

mod args;
mod arguments;
mod blueprints;
mod bridge;
mod calls;
mod camera_effects;
pub mod carla_log;
mod connections;
mod cosmos;
mod dead_ends;
mod friction;
mod motion;
pub mod msgpack;
mod navigation;
mod physics_control;
mod physics_messages;
mod physics_sensors;
mod pixels;
mod proxy_actors;
mod radio;
mod recordings;
mod rendered_messages;
mod replay;
mod respawn;
mod road_context;
mod rollover;
mod rpc;
mod sensor;
mod sensor_kind;
mod server;
mod settings;
mod shared_bridge;
mod state;
mod statics;
mod stream;
mod street_lights;
pub mod tables;
mod textures;
mod traffic_lights;
mod traffic_manager;
mod traffic_managers;
mod trigger_volumes;
mod vehicle_owners;
mod weather;
mod wire;

pub use arguments::read_arguments;
pub use recordings::default_folder as default_recordings_folder;
pub use server::{CarlaPorts, CarlaServer, CarlaServerConfig, CarlaServerError};
