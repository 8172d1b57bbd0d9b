//! `omnibus view`: one page in a browser that shows a running simulator and drives a car in it.
//!
//! The server is an ordinary client of the simulator for each open page. A page has a thread, which
//! owns that client and never waits for the page's connection; the HTTP server and all WebSockets are
//! tasks of one other thread:
//!
//! ```text
//!  simulator ──snapshots, measurements──▶ page thread ──at most 2 unread of each channel──▶ socket ──▶ page
//!  simulator ◀──controls, commands─────── page thread ◀──requests, acknowledgements──────── socket ◀── page
//! ```
//!
//! Positions are in world space, right-handed, x east, y north, z up, in metres; angles are in
//! radians.

mod assets;
mod encode;
mod error;
mod flow;
mod guard;
mod map;
mod message;
mod page;
mod server;
mod state;
mod tiles;
mod time_control;

pub use error::ViewError;
pub use server::{Ended, ViewOptions, Viewer};
