//! Reads a recording, a segment at a time, from any position.

use std::{
    fs::File,
    path::{Path, PathBuf},
};

use protocol::{ActorId, Episode};

use crate::{
    Profile, RecordError, RecordedFrame,
    columns::{DamageIn, Decoder, Unpacker, Written},
    compact::{Compact, restored},
    error::Damage,
    inputs,
    predict::Exact,
    recorded_frame::sum_of,
    scan::{Messages, Scan, Segment, read, scan},
    write::{FORMAT_VERSION, topic},
};

/// The largest size of an unpacked map, in bytes.
const MAP_MAX: usize = 1 << 30;

/// The metadata of a recording.
#[derive(Clone, Debug)]
pub struct RecordingInfo {
    /// How much of each frame is recorded.
    pub profile: Profile,
    /// Map name, seed and OpenDRIVE text.
    pub episode: Episode,
    /// When the recording began, in seconds since 1970.
    pub unix_time_secs: u64,
    /// The version of the program that wrote it.
    pub omnibus_version: String,
    /// The ids of the blueprint catalogue, by their index.
    pub blueprints: Vec<String>,
    /// The roles of the actors that existed at the start and had one.
    pub roles: Vec<(ActorId, String)>,
    /// Whether the file was closed; otherwise its writer was killed, and up to a second is missing.
    pub is_complete: bool,
}

enum States {
    None,
    Exact(Decoder<Exact>),
    Compact(Decoder<Compact>),
}

/// An open recording.
pub struct Recording {
    path: PathBuf,
    file: File,
    info: RecordingInfo,
    segments: Vec<Segment>,
    decoder: States,
    unpacker: Unpacker,
    /// The last segment that the decoder has read.
    decoded: Option<usize>,
    recorded_frames: Vec<RecordedFrame>,
    /// The segment in `recorded_frames`.
    held: Option<usize>,
}

impl Recording {
    /// Opens a recording and finds its segments. Damage inside a segment is found when it is read.
    ///
    /// # Errors
    ///
    /// Returns an error if the file cannot be read, is not a recording, or has another format
    /// version.
    pub fn open(path: &Path) -> Result<Recording, RecordError> {
        let file = bus::open_regular(path).map_err(|e| RecordError::file(path, e))?;
        let Scan { about, map, segments, is_complete } = scan(path, &file)?;
        let field = |name: &str| about.get(name).map_or("", String::as_str);
        // Versions up to 4 are named under another key.
        let version = about.get("format_version").or(about.get("form")).map_or("", String::as_str);
        if version != FORMAT_VERSION.to_string() {
            let (path, found) = (path.to_owned(), version.to_owned());
            return Err(RecordError::Version { path, found, supported: FORMAT_VERSION });
        }
        let damaged =
            |why: &str| RecordError::Damaged { path: path.to_owned(), why: why.to_owned() };
        let profile =
            Profile::by_name(field("profile")).ok_or_else(|| damaged("unknown profile"))?;
        let open_drive = unpacked(&map).ok_or_else(|| damaged("its map cannot be unpacked"))?;
        let roles = field("roles").lines().filter_map(|line| {
            let (id, role) = line.split_once(' ')?;
            Some((ActorId(id.parse().ok()?), role.to_owned()))
        });
        let info = RecordingInfo {
            profile,
            episode: Episode {
                map: field("map").to_owned(),
                seed: field("seed").parse().map_err(|_| damaged("its seed is not a number"))?,
                open_drive,
            },
            unix_time_secs: field("unix_time_secs").parse().unwrap_or(0),
            omnibus_version: field("omnibus_version").to_owned(),
            blueprints: field("blueprints").lines().map(str::to_owned).collect(),
            roles: roles.collect(),
            is_complete,
        };
        Ok(Recording {
            path: path.to_owned(),
            file,
            info,
            segments,
            unpacker: Unpacker::default(),
            decoder: match profile {
                Profile::State => States::Exact(Decoder::new()),
                Profile::Inputs => States::None,
                Profile::Compact => States::Compact(Decoder::new()),
            },
            decoded: None,
            recorded_frames: Vec::new(),
            held: None,
        })
    }

    /// Returns the metadata.
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of segments; 0 for a recording without frames.
    pub fn segments(&self) -> usize {
        self.segments.len()
    }

    /// Returns the recorded time at the first frame of a segment; 0 for the first segment.
    pub fn start_nanos(&self, segment: usize) -> u64 {
        self.segments[segment].start_nanos
    }

    /// Returns the segment at this recorded time, or the last one; 0 for a recording without frames.
    pub fn segment_at(&self, nanos: u64) -> usize {
        self.segments.partition_point(|s| s.start_nanos <= nanos).saturating_sub(1)
    }

    /// Returns the duration of the recording.
    ///
    /// # Errors
    ///
    /// Returns an error if the last segment cannot be read.
    pub fn duration_nanos(&mut self) -> Result<u64, RecordError> {
        let Some(last) = self.segments.len().checked_sub(1) else { return Ok(0) };
        let start = self.start_nanos(last);
        let inside: u64 = self.frames(last)?.iter().map(|m| m.delta_nanos).sum();
        Ok(start + inside)
    }

    /// Returns the frames of a segment, without actors.
    ///
    /// # Errors
    ///
    /// Returns an error if the segment cannot be read.
    pub fn frames(&mut self, segment: usize) -> Result<Vec<RecordedFrame>, RecordError> {
        let messages = read(&self.path, &self.file, &self.segments[segment], &mut self.unpacker)?;
        let frames = messages.of(topic::FRAMES).ok_or(Damage("its frames are missing"));
        frames.and_then(inputs::decode).map_err(|e| self.damaged(segment, e))
    }

    /// Returns the last segment up to `segment` that begins with the whole world.
    pub fn world_before(&self, segment: usize) -> Option<usize> {
        let count = self.segments.len().min(segment + 1);
        (0..count).rev().find(|i| self.segments[*i].has_world)
    }

    /// Returns the frames of a segment with everything that the profile keeps; reads earlier
    /// segments if needed.
    ///
    /// # Errors
    ///
    /// Returns an error if a segment cannot be read.
    pub fn recorded_frames(&mut self, segment: usize) -> Result<&[RecordedFrame], RecordError> {
        if self.held != Some(segment) {
            self.held = None;
            let key = (0..=segment).rev().find(|i| self.segments[*i].is_key).unwrap_or(0);
            let goes_on = self.decoded.filter(|d| (key..segment).contains(d)).map(|d| d + 1);
            let first =
                if matches!(self.decoder, States::None) { segment } else { goes_on.unwrap_or(key) };
            self.decoded = None;
            self.load(first, segment)?;
            self.decoded = Some(segment);
            self.held = Some(segment);
        }
        Ok(&self.recorded_frames)
    }

    /// Drops the decoded segments, so that the next one is read from the file.
    pub fn forget(&mut self) {
        (self.decoded, self.held) = (None, None);
    }

    /// Reads segment `last` into `recorded_frames`, and of the segments from `first` on only what it builds
    /// on.
    fn load(&mut self, first: usize, last: usize) -> Result<(), RecordError> {
        let mut read_all = Vec::new();
        for segment in &self.segments[first..=last] {
            read_all.push(read(&self.path, &self.file, segment, &mut self.unpacker)?);
        }
        self.decode(first, &read_all).map_err(|(index, e)| self.damaged(first + index, e))
    }

    fn decode(&mut self, first: usize, read_all: &[Messages]) -> Result<(), DamageIn> {
        let mut recorded_frames = Vec::new();
        let mut written = Vec::new();
        for (index, messages) in read_all.iter().enumerate() {
            let frames = messages.of(topic::FRAMES).ok_or(Damage("its frames are missing"));
            recorded_frames = frames.and_then(inputs::decode).map_err(|e| (index, e))?;
            let bytes = messages.of(topic::KEY).or_else(|| messages.of(topic::DELTA));
            if bytes.is_none() && !matches!(self.decoder, States::None) {
                return Err((index, Damage("its actors are missing")));
            }
            written.push(Written {
                bytes: bytes.unwrap_or_default(),
                deltas: recorded_frames.iter().map(|m| m.delta_nanos).collect(),
                is_key: self.segments[first + index].is_key,
            });
        }
        // Reuses the memory of the frames that were read before.
        let mut states: Vec<_> =
            self.recorded_frames.drain(..).map(|recorded_frame| recorded_frame.actors).collect();
        match &mut self.decoder {
            States::None => states.clear(),
            States::Exact(decoder) => decoder.decode(&written, &mut states)?,
            States::Compact(decoder) => {
                decoder.decode(&written, &mut states)?;
                for state in states.iter_mut().flatten() {
                    *state = restored(state);
                }
            }
        }
        for (recorded_frame, states) in recorded_frames.iter_mut().zip(states) {
            recorded_frame.actors = states;
        }
        let world = read_all.last().and_then(|messages| messages.of(topic::WORLD));
        if let (Some(first), Some(world)) = (recorded_frames.first_mut(), world) {
            first.world = Some(world.to_vec());
        }
        self.recorded_frames = recorded_frames;
        Ok(())
    }

    fn damaged(&self, segment: usize, Damage(why): Damage) -> RecordError {
        let at = self.segments[segment].start_nanos as f64 / 1e9;
        RecordError::Damaged {
            path: self.path.clone(),
            why: format!("the second that begins at {at:.2} s: {why}"),
        }
    }
}

impl RecordedFrame {
    /// Returns whether the actors are exactly those that were shown. Only the profile `state` keeps
    /// that.
    pub fn is_as_shown(&self) -> bool {
        sum_of(&self.actors) == self.shown
    }
}

fn unpacked(map: &[u8]) -> Option<String> {
    let bytes = zstd::bulk::Decompressor::upper_bound(map)
        .filter(|len| *len <= MAP_MAX)
        .and_then(|len| zstd::bulk::decompress(map, len).ok())?;
    String::from_utf8(bytes).ok()
}
