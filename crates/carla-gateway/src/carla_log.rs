//! CARLA's recorder log: a header and packets, frame by frame, little-endian.
//!
//! ```text
//!  recording ──moments──▶ FrameBuilder ──▶ Frame ──▶ Writer: a log
//!                                          │  ▲
//!  tables (CARLA's three texts) ◀──────────┘  └── Reader: a log ──▶ MomentBuilder: a replay
//! ```
//!
//! A [`Frame`] has the units of the file: centimetres, degrees, left-handed axes; velocities are
//! metres and degrees per second.

mod file;
mod frame;
mod from_recording;
mod to_recording;

use std::{
    fs::File,
    io::{BufReader, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use client_lib::{ActorId, wire::Episode};
use record::{
    CARLA_LOG_MAGIC, Profile, RecordError, Recording, RecordingConfig, create_regular, open_regular,
};

pub use file::{Reader, Writer};
pub use frame::{
    Collision, CreatedActor, Frame, Header, Kinematics, NO_ACTOR, Position, TrafficLight,
    VehicleAnimation,
};
pub use to_recording::MomentBuilder;

use crate::carla_log::from_recording::FrameBuilder;

/// A file that frames are read from.
pub enum Source {
    /// A recording of this simulator.
    Recording(Box<Recording>),
    /// A log of CARLA.
    Log(PathBuf),
}

impl Source {
    /// Opens a file, which may be a recording or a log.
    ///
    /// # Errors
    ///
    /// Returns an error if a recording cannot be opened.
    pub fn open(path: &Path) -> anyhow::Result<Source> {
        Ok(if is_log(path) {
            Source::Log(path.to_owned())
        } else {
            Source::Recording(Box::new(Recording::open(path)?))
        })
    }

    /// Returns the header.
    ///
    /// # Errors
    ///
    /// Returns an error if a log cannot be read.
    pub fn header(&self) -> anyhow::Result<Header> {
        Ok(match self {
            Source::Recording(recording) => header_of(recording),
            Source::Log(path) => open(path)?.header().clone(),
        })
    }

    /// Calls a function with every frame in turn.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read.
    pub fn each(&mut self, mut visit: impl FnMut(&Frame)) -> anyhow::Result<()> {
        match self {
            Source::Recording(recording) => each_of(recording, |frame| {
                visit(frame);
                Ok(())
            }),
            Source::Log(path) => {
                let mut reader = open(path)?;
                while let Some(frame) = read(path, &mut reader)? {
                    visit(&frame);
                }
                Ok(())
            }
        }
    }
}

/// Returns whether a file begins like a log of CARLA.
pub fn is_log(path: &Path) -> bool {
    let mut magic = [0; 2 + CARLA_LOG_MAGIC.len()];
    let read = open_regular(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic[2..] == *CARLA_LOG_MAGIC
}

/// Opens a log at its first frame.
///
/// # Errors
///
/// Returns an error if the file cannot be opened or its header is invalid.
pub fn open(path: &Path) -> anyhow::Result<Reader<BufReader<File>>> {
    let file = open_regular(path).with_context(|| path.display().to_string())?;
    Reader::new(BufReader::new(file)).with_context(|| path.display().to_string())
}

/// Reads the next frame; `None` at the end of the log, or where it was truncated.
///
/// # Errors
///
/// Returns an error if the log is damaged.
pub fn read(path: &Path, reader: &mut Reader<impl Read>) -> anyhow::Result<Option<Frame>> {
    reader.frame().with_context(|| path.display().to_string())
}

fn header_of(recording: &Recording) -> Header {
    let info = recording.info();
    Header { version: 1, date_secs: info.unix_time_secs as i64, map: info.episode.map.clone() }
}

fn each_of(
    recording: &mut Recording,
    mut visit: impl FnMut(&Frame) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut builder = FrameBuilder::new(recording);
    for segment in 0..recording.segments() {
        for moment in recording.recorded_frames(segment)? {
            visit(builder.frame(moment))?;
        }
    }
    Ok(())
}

/// Writes a recording as a log of CARLA and returns the numbers of frames and bytes.
///
/// # Errors
///
/// Returns an error if the recording cannot be read or the log cannot be written.
pub fn export(recording: &mut Recording, path: &Path) -> anyhow::Result<(u64, u64)> {
    let error = |e| RecordError::File { path: path.to_owned(), why: e };
    let file = create_regular(path).map_err(error)?;
    file.set_len(0).map_err(error)?;
    let mut writer = Writer::new(BufWriter::new(file), &header_of(recording)).map_err(error)?;
    let mut frames = 0;
    each_of(recording, |frame| {
        frames += 1;
        Ok(writer.put(frame).map_err(error)?)
    })?;
    writer.finish().and_then(|mut file| file.flush()).map_err(error)?;
    Ok((frames, path.metadata().map_err(error)?.len()))
}

/// Converts a log to a recording in the given episode, and returns the blueprints of actors that
/// were omitted.
///
/// # Errors
///
/// Returns an error if the log cannot be read or the recording cannot be written.
pub fn import(log: &Path, path: &Path, episode: Episode) -> anyhow::Result<Vec<String>> {
    let mut roles = Vec::new();
    Source::Log(log.to_owned()).each(|frame| {
        let named = frame.created.iter().filter_map(|created| {
            let role = created.attribute("role_name").filter(|role| *role != "autopilot")?;
            Some((ActorId(created.id), role.to_owned()))
        });
        roles.extend(named);
    })?;
    let config = RecordingConfig {
        path: path.to_owned(),
        profile: Profile::State,
        episode,
        blueprints: town::catalogue().iter().map(|b| b.id.to_owned()).collect(),
        roles,
    };
    let mut writer = record::Writer::create(&config)?;
    let mut builder = MomentBuilder::default();
    let mut reader = open(log)?;
    while let Some(frame) = read(log, &mut reader)? {
        writer.put(builder.moment(&frame))?;
        writer.spent().for_each(drop);
    }
    writer.finish()?;
    Ok(builder.unknown_blueprints().to_vec())
}

#[cfg(test)]
mod tests;
