//! `omnibus collect`: drives an ego through traffic and writes a data set.
//!
//! ```text
//! tick ──▶ snapshot ─┐
//!      ──▶ bundle ───┴▶ frame data ──▶ encoders ──▶ front/color/000123.png ...
//!                      │              │ all files of a frame complete
//!      a permit is free ◀┘              ▼
//!                                frames.jsonl
//! ```
//!
//! The measurements of a frame stay in the renderer's memory until the last file is written.
//! `frames.jsonl` lists a frame when all its files are complete, so that a killed run can be
//! resumed: the same simulation runs again up to that frame, without rendering.

mod actors;
mod boxes;
mod camera_model;
mod collection;
mod contact_sheet;
pub(crate) mod decode;
mod departures;
mod ego_sensors;
mod encode;
mod encoders;
mod error;
mod events;
pub(crate) mod folder;
pub(crate) mod format;
mod frame_list;
mod image_storage;
mod inspect;
mod job;
mod label_settings;
pub(crate) mod map_lines;
mod metadata;
pub(crate) mod npy;
mod objects;
mod options;
mod outline;

mod plan;
mod progress;
pub(crate) mod rle;
mod road_users;
mod run;
mod scenes;
mod schedule;
mod sensors;
mod sheet;
mod silhouette;
mod sky;
mod stages;
#[cfg(test)]
pub(crate) mod testing;
mod tracks;
mod verify;
mod verify_labels;
mod visibility;

pub(crate) use actors::{EGO, places};
pub(crate) use collection::Collection;
pub(crate) use decode::Image;
pub(crate) use departures::Departures;
pub(crate) use encode::{Encoder, STATIC_BIT, jpeg};
pub(crate) use error::CollectError;
pub(crate) use image_storage::ImageStorage;
pub(crate) use inspect::inspect;
pub(crate) use job::Job;
pub(crate) use options::Options;
pub(crate) use plan::{TrafficEntry, check_hybrid_radius, template};
pub(crate) use progress::{Progress, print_json};
pub(crate) use road_users::{Cast, RoadUsers};
pub(crate) use run::collect;
pub(crate) use scenes::{collect_scenes, prepare};
pub(crate) use sensors::{CAMERA_OUTPUTS, default_sensors};
pub(crate) use sheet::{Sheet, mean};
pub(crate) use sky::{WeatherEntry, sun_rad};
pub(crate) use verify::verify;
