//! The one integration test binary: real processes, whole scenarios.

// The examples name the client library by its package.
extern crate client_lib as omnibus_client_lib;

mod kit;

mod allocations;
mod alone;
mod bones;
mod c_interface;
mod carla;
mod carla_clients;
mod carla_maps;
mod carla_stopped;
mod carla_wire;
mod client;
mod crash;
mod demo;
mod draw;
mod environment;
mod episodes;
mod exact;
mod examples;
mod fall;
mod faults;
mod flood;
mod fork;
mod formats;
mod full;
mod generated;
mod hide;
mod hold;
mod hostile;
mod labels;
mod lamps;
mod latency;
mod leave;
mod load;
mod map;
mod maps;
mod modes;
mod oracles;
mod parity;
mod physics_sensors;
mod plan;
mod profile;
mod python_package;
mod radar;
mod record;
mod refuse;
mod ros2;
mod same;
mod setters;
mod soak;
mod standstill;
mod tidy;
mod two;
mod view;
