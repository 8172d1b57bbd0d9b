//! Writes recorded_frames as segments, each one chunk of an MCAP file.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter},
    mem::take,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use mcap::{Attachment, Compression, WriteOptions, records::MessageHeader, records::Metadata};
use protocol::ActorState;

use crate::{
    RecordError, RecordingConfig,
    columns::Encoder,
    compact::{Compact, quantised},
    grid::FRAMES_MAX,
    inputs,
    predict::Exact,
    recorded_frame::{Profile, RecordedFrame, sum_of},
};

/// The version of the format. Changes whenever the meaning of the bytes does.
pub(crate) const FORMAT_VERSION: u32 = 6;
/// The channels of the file, by id.
pub(crate) mod topic {
    pub(crate) const FRAMES: u16 = 1;
    pub(crate) const KEY: u16 = 2;
    pub(crate) const DELTA: u16 = 3;
    pub(crate) const WORLD: u16 = 4;
    pub(crate) const NAMES: [(u16, &str); 4] = [
        (FRAMES, "frames"),
        (KEY, "actors/keyframe"),
        (DELTA, "actors/delta"),
        (WORLD, "saved_state"),
    ];
}
/// Simulated time of a segment.
const SEGMENT_NANOS: u64 = 1_000_000_000;
/// Recorded time between segments that can be read without the ones before.
const KEY_NANOS: u64 = 10_000_000_000;
/// Size of the write buffer, in bytes.
const BUFFER: usize = 1 << 20;

/// What a log of CARLA's recorder begins with, after the two bytes of its version.
pub const CARLA_LOG_MAGIC: &[u8] = b"\x0e\0CARLA_RECORDER";

/// Returns whether a file holds nothing that a recorder has not written.
fn may_be_replaced(file: &File) -> io::Result<bool> {
    let mut begin = [0; 2 + CARLA_LOG_MAGIC.len()];
    let len = file.read_at(&mut begin, 0)?;
    let begin = &begin[..len];
    let is_log = begin.get(2..) == Some(CARLA_LOG_MAGIC);
    Ok(begin.is_empty() || begin.starts_with(mcap::MAGIC) || is_log)
}

enum States {
    None,
    Exact(Encoder<Exact>),
    Compact(Encoder<Compact>),
}

/// Writes one recording.
pub struct Writer {
    file: mcap::Writer<BufWriter<File>>,
    path: PathBuf,
    profile: Profile,
    states: States,
    pending: Vec<RecordedFrame>,
    spent: Vec<RecordedFrame>,
    /// Recorded time up to the first pending frame.
    elapsed_nanos: u64,
    pending_nanos: u64,
    next_key_nanos: u64,
    frames: u64,
}

impl Writer {
    /// Creates the file. One of the same name is replaced if it is empty, a recording, or a log of
    /// CARLA.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be written, or another file has its name.
    pub fn create(config: &RecordingConfig) -> Result<Writer, RecordError> {
        let told = |e| RecordError::file(&config.path, e);
        if let Some(folder) = config.path.parent().filter(|f| !f.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).map_err(told)?;
        }
        let file = bus::create_regular(&config.path).map_err(told)?;
        if !may_be_replaced(&file).map_err(told)? {
            return Err(RecordError::NotReplaced { path: config.path.clone() });
        }
        file.set_len(0).map_err(told)?;
        let options = WriteOptions::new()
            .profile("omnibus")
            .library(concat!("omnibus ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .chunk_size(None);
        let mut file = options.create(BufWriter::with_capacity(BUFFER, file))?;
        for (id, name) in topic::NAMES {
            file.add_channel_with_id(id, 0, name, "omnibus", &BTreeMap::new())?;
        }
        file.write_metadata(&metadata(config))?;
        let map = zstd::bulk::compress(config.episode.open_drive.as_bytes(), 3)
            .map_err(|e| RecordError::file(&config.path, e))?;
        file.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: "map.xodr".to_owned(),
            media_type: "application/zstd".to_owned(),
            data: map.into(),
        })?;
        file.flush()?;
        let states = match config.profile {
            Profile::State => States::Exact(Encoder::new()),
            Profile::Inputs => States::None,
            Profile::Compact => States::Compact(Encoder::new()),
        };
        Ok(Writer {
            file,
            path: config.path.clone(),
            profile: config.profile,
            states,
            pending: Vec::new(),
            spent: Vec::new(),
            elapsed_nanos: 0,
            pending_nanos: 0,
            next_key_nanos: 0,
            frames: 0,
        })
    }

    /// Adds a frame, and writes the segment if it is full.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be written.
    pub fn put(&mut self, mut recorded_frame: RecordedFrame) -> Result<(), RecordError> {
        let last = self.pending.last().map(|m| m.stamp);
        let goes_on = last.is_none_or(|last| {
            last.frame.next() == recorded_frame.stamp.frame
                && last.sim_time_nanos < recorded_frame.stamp.sim_time_nanos
                && last.episode == recorded_frame.stamp.episode
        });
        if !goes_on || recorded_frame.world.is_some() {
            self.cut()?;
            if !goes_on || self.profile == Profile::Inputs {
                self.next_key_nanos = self.elapsed_nanos;
            }
        }
        if self.profile == Profile::State {
            recorded_frame.shown = sum_of(&recorded_frame.actors);
        }
        self.pending_nanos += recorded_frame.delta_nanos;
        self.pending.push(recorded_frame);
        if self.pending_nanos >= SEGMENT_NANOS || self.pending.len() >= FRAMES_MAX {
            self.cut()?;
        }
        Ok(())
    }

    /// Writes the pending frames as a segment of their own.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be written.
    pub fn cut(&mut self) -> Result<(), RecordError> {
        let mut recorded_frames = take(&mut self.pending);
        let (Some(first), false) = (recorded_frames.first(), recorded_frames.is_empty()) else {
            return Ok(());
        };
        let start_nanos = self.elapsed_nanos;
        let header = |id: u16| MessageHeader {
            channel_id: id,
            sequence: first.stamp.frame.0 as u32,
            log_time: start_nanos,
            publish_time: first.stamp.sim_time_nanos,
        };
        let inputs = inputs::encode(&recorded_frames, self.profile.has_inputs());
        self.file.write_to_known_channel(&header(topic::FRAMES), &inputs)?;
        let is_key = start_nanos >= self.next_key_nanos;
        if let Some(world) = &first.world {
            self.file.write_to_known_channel(&header(topic::WORLD), world)?;
        }
        let deltas: Vec<u64> = recorded_frames.iter().map(|m| m.delta_nanos).collect();
        let bytes = match &mut self.states {
            States::None => None,
            States::Exact(encoder) => {
                let frames: Vec<&[ActorState]> =
                    recorded_frames.iter().map(|m| &m.actors[..]).collect();
                Some(encoder.encode(&frames, &deltas, is_key))
            }
            States::Compact(encoder) => {
                for state in recorded_frames.iter_mut().flat_map(|m| &mut m.actors) {
                    *state = quantised(state);
                }
                let frames: Vec<&[ActorState]> =
                    recorded_frames.iter().map(|m| &m.actors[..]).collect();
                Some(encoder.encode(&frames, &deltas, is_key))
            }
        };
        if let Some(bytes) = bytes {
            let id = if is_key { topic::KEY } else { topic::DELTA };
            let first = &recorded_frames[0];
            let header = MessageHeader {
                channel_id: id,
                sequence: first.stamp.frame.0 as u32,
                log_time: start_nanos,
                publish_time: first.stamp.sim_time_nanos,
            };
            self.file.write_to_known_channel(&header, &bytes)?;
        }
        if is_key {
            self.next_key_nanos = start_nanos + KEY_NANOS;
        }
        self.file.flush()?;
        self.elapsed_nanos += take(&mut self.pending_nanos);
        self.frames += recorded_frames.len() as u64;
        self.spent.append(&mut recorded_frames);
        Ok(())
    }

    /// Returns written recorded_frames, whose memory can be reused.
    pub fn spent(&mut self) -> impl Iterator<Item = RecordedFrame> + '_ {
        self.spent.drain(..)
    }

    /// Returns whether frames wait for their segment to be full.
    pub fn is_pending(&self) -> bool {
        !self.pending.is_empty()
    }

    /// Returns the number of written frames.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the remaining frames and the index, and returns the number of frames.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be written.
    pub fn finish(mut self) -> Result<u64, RecordError> {
        self.cut()?;
        self.file.finish()?;
        let told = |e| RecordError::file(&self.path, e);
        let file = self.file.into_inner().into_inner().map_err(|e| told(e.into_error()))?;
        // Some file systems report a full disk only here.
        file.sync_all().map_err(told)?;
        Ok(self.frames)
    }
}

fn metadata(config: &RecordingConfig) -> Metadata {
    let date = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let roles = config.roles.iter().map(|(id, role)| format!("{} {role}", id.0));
    let about = [
        ("format_version", FORMAT_VERSION.to_string()),
        ("omnibus_version", env!("CARGO_PKG_VERSION").to_owned()),
        ("profile", config.profile.name().to_owned()),
        ("map", config.episode.map.clone()),
        ("seed", config.episode.seed.to_string()),
        ("unix_time_secs", date.to_string()),
        ("blueprints", config.blueprints.join("\n")),
        ("roles", roles.collect::<Vec<_>>().join("\n")),
    ];
    Metadata {
        name: "omnibus".to_owned(),
        metadata: about.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
    }
}
