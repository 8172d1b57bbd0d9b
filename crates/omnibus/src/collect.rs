//! `omnibus collect`: drives an ego through traffic and writes down what its sensors measure.
//!
//! ```text
//! tick ──▶ snapshot ─┐
//!      ──▶ bundle ───┴▶ shot ──▶ crew of encoders ──▶ front/color/000123.png ...
//!                        │            │ all files of a frame complete
//!      a permit is free ◀┘            ▼
//!                                  frames.jsonl
//! ```
//!
//! Each frame's measurements stay in the renderer's own memory until its last file is written. A
//! frame stands in `frames.jsonl` when all its files are complete, so that a run that was killed
//! can be resumed: the simulation is the same, so it is simulated up to there again, unseen.

mod actors;
mod boxes;
mod contact_sheet;
mod decode;
mod ego_sensors;
mod encode;
mod encoders;
mod error;
mod folder;
mod format;
mod frame_list;
mod inspect;
mod job;
mod metadata;
mod outline;
mod pedestrians;
mod progress;
mod run;
mod sensors;
mod silhouette;
mod stages;
#[cfg(test)]
mod testing;

pub(crate) use actors::{EGO, places};
pub(crate) use error::CollectError;
pub(crate) use inspect::inspect;
pub(crate) use job::{Args, Job};
pub(crate) use run::collect;
pub(crate) use sensors::default_sensors;
