//! `omnibus view`: one page in a browser that shows a running simulator, a recording or a data set.
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
//! `/foxglove` is for viewers that speak the Foxglove WebSocket protocol; see `stream`.
//!
//! A recording is shown by a simulator that replays it; the pages share its time. A data set has no
//! simulator: a page's thread reads frames through the trait [`DataSet`].
//!
//! Positions are in world space, right-handed, x east, y north, z up, in metres; angles are in
//! radians.

mod ahead;
mod assets;
mod data_set;
mod encode;
mod error;
mod flow;
mod guard;
mod map;
mod message;
mod outbox;
mod page;
mod player;
mod server;
mod state;
mod stored_page;
mod stream;
mod tiles;
mod time_control;

pub use data_set::{
    DataSet, Measured, ReadError, StoredActor, StoredBox, StoredFrame, StoredScene,
};
pub use error::ViewError;
pub use player::Recording;
pub use server::{Ended, Source, ViewOptions, Viewer};
pub use stream::MapScene;
