//! The Foxglove WebSocket protocol: the world of a simulator for Foxglove, Lichtblick and others that
//! speak it.
//!
//! A connection is a client of the simulator with a thread of its own, as a page is. It reads only: what
//! a connection can change is its own sensors.
//!
//! ```text
//!  simulator ──snapshots, measurements──▶ stream thread ──queue that drops the oldest──▶ socket ──▶ Foxglove
//!                                         stream thread ◀──subscriptions──────────────── socket ◀── Foxglove
//! ```

mod base64;
mod protocol;
mod queue;
mod scene;
mod sensors;
mod subscriptions;
mod thread;
mod topics;

pub(crate) use protocol::SUBPROTOCOLS;
pub(crate) use queue::Queue;
pub use thread::MapScene;
pub(crate) use thread::{Received, Stream};
