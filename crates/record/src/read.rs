//! Reading: a segment at a time, from anywhere.

use std::{
    fs::File,
    path::{Path, PathBuf},
};

use protocol::{ActorId, Episode};

use crate::{
    Moment, Profile, RecordError,
    columns::{DamageIn, Decoder, Unpacker, Written},
    compact::{Compact, restored},
    error::Damage,
    inputs,
    moment::sum_of,
    predict::Exact,
    scan::{Messages, Scan, Segment, read, scan},
    write::{FORMAT_VERSION, topic},
};

/// No map is larger.
const MAP_MAX: usize = 1 << 30;

/// What a recording tells of itself.
#[derive(Clone, Debug)]
pub struct RecordingInfo {
    /// How much of the run it keeps.
    pub profile: Profile,
    /// The world: map, seed, and the map itself.
    pub episode: Episode,
    /// When it was begun, seconds since 1970.
    pub unix_time_secs: u64,
    /// The build that wrote it.
    pub omnibus_version: String,
    /// The catalogue: ids of blueprints, by their index.
    pub blueprints: Vec<String>,
    /// What those who were there at the start were called, if anything.
    pub roles: Vec<(ActorId, String)>,
    /// It was closed in order; else its writer was killed, and up to a second is missing.
    pub is_complete: bool,
}

enum States {
    None,
    Exact(Decoder<Exact>),
    Compact(Decoder<Compact>),
}

/// A recording that is read.
pub struct Recording {
    path: PathBuf,
    file: File,
    info: RecordingInfo,
    segments: Vec<Segment>,
    decoder: States,
    unpacker: Unpacker,
    /// The segment whose end the decoder knows.
    decoded: Option<usize>,
    moments: Vec<Moment>,
    /// The segment that `moments` hold.
    held: Option<usize>,
}

impl Recording {
    /// Opens it and finds its segments; whether they are sound is seen when they are read.
    pub fn open(path: &Path) -> Result<Recording, RecordError> {
        let file = File::open(path).map_err(|e| RecordError::file(path, e))?;
        if file.metadata().is_ok_and(|m| m.is_dir()) {
            let why = "it is a folder".to_owned();
            return Err(RecordError::NotARecording { path: path.to_owned(), why });
        }
        let Scan { about, map, segments, is_complete } = scan(path, &file)?;
        let field = |name: &str| about.get(name).map_or("", String::as_str);
        // Versions up to 4 named themselves under another key.
        let version = about.get("format_version").or(about.get("form")).map_or("", String::as_str);
        if version != FORMAT_VERSION.to_string() {
            let (path, found) = (path.to_owned(), version.to_owned());
            return Err(RecordError::Version { path, found, supported: FORMAT_VERSION });
        }
        let damaged =
            |why: &str| RecordError::Damaged { path: path.to_owned(), why: why.to_owned() };
        let profile = Profile::by_name(field("profile"))
            .ok_or_else(|| damaged("it names no profile that we know"))?;
        let open_drive = unpacked(&map).ok_or_else(|| damaged("its map cannot be unpacked"))?;
        let roles = field("roles").lines().filter_map(|line| {
            let (id, role) = line.split_once(' ')?;
            Some((ActorId(id.parse().ok()?), role.to_owned()))
        });
        let info = RecordingInfo {
            profile,
            episode: Episode {
                map: field("map").to_owned(),
                seed: field("seed").parse().map_err(|_| damaged("it names no seed"))?,
                open_drive,
            },
            unix_time_secs: field("unix_time_secs").parse().unwrap_or(0),
            omnibus_version: field("omnibus_version").to_owned(),
            blueprints: field("blueprints").lines().map(str::to_owned).collect(),
            roles: roles.collect(),
            is_complete,
        };
        if segments.is_empty() {
            return Err(damaged("it holds no frame"));
        }
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
            moments: Vec::new(),
            held: None,
        })
    }

    /// What it tells of itself.
    pub fn info(&self) -> &RecordingInfo {
        &self.info
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How many segments there are; never 0.
    pub fn segments(&self) -> usize {
        self.segments.len()
    }

    /// Recorded time at a segment's first frame: 0 for the first.
    pub fn start_nanos(&self, segment: usize) -> u64 {
        self.segments[segment].start_nanos
    }

    /// The segment that holds this recorded time, or the last one.
    pub fn segment_at(&self, nanos: u64) -> usize {
        self.segments.partition_point(|s| s.start_nanos <= nanos).saturating_sub(1)
    }

    /// Recorded time in all.
    pub fn duration_nanos(&mut self) -> Result<u64, RecordError> {
        let last = self.segments.len() - 1;
        let start = self.start_nanos(last);
        let inside: u64 = self.frames(last)?.iter().map(|m| m.delta_nanos).sum();
        Ok(start + inside)
    }

    /// A segment's frames, without actors.
    pub fn frames(&mut self, segment: usize) -> Result<Vec<Moment>, RecordError> {
        let messages = read(&self.path, &self.file, &self.segments[segment], &mut self.unpacker)?;
        let frames = messages.of(topic::FRAMES).ok_or(Damage("its frames are missing"));
        frames.and_then(inputs::decode).map_err(|e| self.damaged(segment, e))
    }

    /// The last segment up to `segment` that begins with the whole world.
    pub fn world_before(&self, segment: usize) -> Option<usize> {
        (0..=segment).rev().find(|i| self.segments[*i].has_world)
    }

    /// A segment's frames with all that its profile keeps; those before it are read if need be.
    pub fn moments(&mut self, segment: usize) -> Result<&[Moment], RecordError> {
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
        Ok(&self.moments)
    }

    /// Forgets what was read: the next second is read from the file.
    pub fn forget(&mut self) {
        (self.decoded, self.held) = (None, None);
    }

    /// Reads `last` into `moments`; of those from `first` on only what the next one builds on.
    fn load(&mut self, first: usize, last: usize) -> Result<(), RecordError> {
        let mut read_all = Vec::new();
        for segment in &self.segments[first..=last] {
            read_all.push(read(&self.path, &self.file, segment, &mut self.unpacker)?);
        }
        self.decode(first, &read_all).map_err(|(index, e)| self.damaged(first + index, e))
    }

    fn decode(&mut self, first: usize, read_all: &[Messages]) -> Result<(), DamageIn> {
        let mut moments = Vec::new();
        let mut written = Vec::new();
        for (index, messages) in read_all.iter().enumerate() {
            let frames = messages.of(topic::FRAMES).ok_or(Damage("its frames are missing"));
            moments = frames.and_then(inputs::decode).map_err(|e| (index, e))?;
            let bytes = messages.of(topic::KEY).or_else(|| messages.of(topic::DELTA));
            if bytes.is_none() && !matches!(self.decoder, States::None) {
                return Err((index, Damage("its actors are missing")));
            }
            written.push(Written {
                bytes: bytes.unwrap_or_default(),
                deltas: moments.iter().map(|m| m.delta_nanos).collect(),
                is_key: self.segments[first + index].is_key,
            });
        }
        // The lists of the frames that were read before are used again.
        let mut states: Vec<_> = self.moments.drain(..).map(|moment| moment.actors).collect();
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
        for (moment, states) in moments.iter_mut().zip(states) {
            moment.actors = states;
        }
        let world = read_all.last().and_then(|messages| messages.of(topic::WORLD));
        if let (Some(first), Some(world)) = (moments.first_mut(), world) {
            first.world = Some(world.to_vec());
        }
        self.moments = moments;
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

impl Moment {
    /// Whether the actors are those that were shown. Only the profile `state` keeps that exactly.
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
