//! The targets, one for each format.

pub(crate) mod carla_log;
pub(crate) mod commands;
pub(crate) mod gltf;
pub(crate) mod msgpack;
pub(crate) mod open_drive;
pub(crate) mod recording;
pub(crate) mod saved_state;
