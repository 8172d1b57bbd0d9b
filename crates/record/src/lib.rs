//! Recordings of a world, frame by frame, in one MCAP file.
//!
//! ```text
//! Host ──Moment──▶ Recorder (a thread) ──▶ Writer ──segments──▶ MCAP file
//!                                                                  │
//! replay, queries, re-simulation ◀──Moments── Recording ◀──────────┘
//! ```
//!
//! A segment holds at most a second of frames and is one chunk of the file, so that a killed
//! process loses no more than that. Spaces are right-handed with z up; SI units, radians.
//! Start reading at `moment.rs`.

mod bits;
mod columns;
mod compact;
mod config;
mod error;
mod grid;
mod inputs;
mod moment;
mod predict;
mod read;
mod recorder;
mod scan;
mod space;
mod write;

pub use config::RecordingConfig;
pub use error::RecordError;
pub use moment::{Collision, Decision, Moment, Profile};
pub use read::{Recording, RecordingInfo};
pub use recorder::Recorder;
pub use write::Writer;

#[cfg(test)]
mod tests;
