//! Recordings of a world, frame by frame, in one MCAP file.
//!
//! ```text
//! Host ──RecordedFrame──▶ Recorder (a thread) ──▶ Writer ──segments──▶ MCAP file
//!                                                                         │
//! replay, queries, re-simulation ◀──RecordedFrame── Recording ◀───────────┘
//! ```
//!
//! A segment holds at most a second of frames and is one chunk of the file, so that a killed
//! process loses no more than that. Spaces are right-handed with z up; SI units, radians.
//! Start reading at `recorded_frame.rs`.

mod bits;
mod columns;
mod compact;
mod config;
mod error;
mod grid;
mod inputs;
mod predict;
mod read;
mod recorded_frame;
mod recorder;
mod scan;
mod space;
mod write;

pub use bus::{create_regular, open_regular};
pub use config::RecordingConfig;
pub use error::RecordError;
pub use read::{Recording, RecordingInfo};
pub use recorded_frame::{Collision, Decision, Profile, RecordedFrame};
pub use recorder::Recorder;
pub use write::{CARLA_LOG_MAGIC, Writer};

#[cfg(test)]
mod tests;
