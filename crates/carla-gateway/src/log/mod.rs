//! CARLA's own log of a run: a header and packets, frame by frame, little endian.
//!
//! ```text
//! recording ──moments──▶ Telling ──▶ Frame ──▶ bytes: CARLA's file
//!                                     │  ▲
//!  tables (CARLA's three texts) ◀─────┘  └── bytes of CARLA or of us ──▶ moments: a replay
//! ```
//!
//! A [`Frame`] speaks as the file does: centimetres, degrees, the left hand; velocities are metres
//! and degrees per second.

mod bytes;
mod shown;
mod told;

use std::{
    fs::File,
    io::{BufReader, BufWriter, Read, Write},
    path::{Path, PathBuf},
};

use ::record::{Profile, RecordError, Recording, RecordingConfig};
use anyhow::Context;
use client_lib::{ActorId, wire::Episode};

pub use bytes::{Reader, Writer};
pub use shown::Showing;
use told::Telling;

/// What a log begins with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// CARLA's number of the form: 1.
    pub version: u16,
    /// Seconds since 1970.
    pub date_secs: i64,
    /// The map's name.
    pub map: String,
}

/// Somebody comes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Created {
    /// The actor's id.
    pub id: u32,
    /// 0 other, 1 vehicle, 2 walker, 3 traffic light.
    pub kind: u8,
    /// Centimetres.
    pub location: [f32; 3],
    /// Roll, pitch, yaw. Degrees.
    pub rotation: [f32; 3],
    /// The blueprint's number.
    pub uid: u32,
    /// The blueprint.
    pub blueprint: String,
    /// Type, name, value.
    pub attributes: Vec<(u8, String, String)>,
}

impl Created {
    /// An attribute's value.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(_, of, _)| of == name).map(|(_, _, value)| value.as_str())
    }
}

/// Two touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Touch {
    /// Its number in the frame.
    pub id: u32,
    /// Who; the other may be nobody, `u32::MAX`.
    pub actors: [u32; 2],
    /// Who of them is a hero.
    pub heroes: [bool; 2],
}

/// Where an actor is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Who.
    pub id: u32,
    /// Centimetres.
    pub location: [f32; 3],
    /// Roll, pitch, yaw. Degrees.
    pub rotation: [f32; 3],
}

/// A traffic light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// Which.
    pub id: u32,
    /// It stays as it is.
    pub frozen: bool,
    /// Seconds in this state.
    pub elapsed_s: f32,
    /// 0 red, 1 yellow, 2 green, 3 off.
    pub state: u8,
}

/// A vehicle's pedals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pedals {
    /// Whose.
    pub id: u32,
    /// Positive to the right.
    pub steer: f32,
    /// 0 to 1.
    pub throttle: f32,
    /// 0 to 1.
    pub brake: f32,
    /// It is on.
    pub handbrake: bool,
    /// −1 reverse.
    pub gear: i32,
}

/// How an actor moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Who.
    pub id: u32,
    /// Metres per second.
    pub velocity: [f32; 3],
    /// Degrees per second.
    pub spin: [f32; 3],
}

/// All that is read of a frame. Of what CARLA may write besides, nothing is kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// From 1 on.
    pub number: u64,
    /// Seconds that it took.
    pub duration_s: f64,
    /// Seconds since the first.
    pub elapsed_s: f64,
    /// Who came.
    pub created: Vec<Created>,
    /// Who went.
    pub destroyed: Vec<u32>,
    /// Child and parent.
    pub parents: Vec<[u32; 2]>,
    /// Who touched whom.
    pub touches: Vec<Touch>,
    /// Where everybody is.
    pub places: Vec<Place>,
    /// Traffic lights.
    pub lights: Vec<Light>,
    /// Vehicles.
    pub pedals: Vec<Pedals>,
    /// Walkers and their speeds, centimetres per second.
    pub walkers: Vec<(u32, f32)>,
    /// Vehicles and their lamps: bits of CARLA's `VehicleLightState`.
    pub lamps: Vec<(u32, u32)>,
    /// Vehicles, a door of each, and whether it is open.
    pub doors: Vec<(u32, u8, bool)>,
    /// Velocities.
    pub motions: Vec<Motion>,
}

/// Somewhere frames come from.
pub enum Source {
    /// A recording of ours.
    Recording(Box<Recording>),
    /// A log.
    Log(PathBuf),
}

impl Source {
    /// A recording or a log, whichever the file is.
    pub fn open(path: &Path) -> anyhow::Result<Source> {
        Ok(if is_log(path) {
            Source::Log(path.to_owned())
        } else {
            Source::Recording(Box::new(Recording::open(path)?))
        })
    }

    /// What it begins with.
    pub fn head(&self) -> anyhow::Result<Head> {
        Ok(match self {
            Source::Recording(recording) => head_of(recording),
            Source::Log(path) => open(path)?.head().clone(),
        })
    }

    /// Every frame in turn.
    pub fn each(&mut self, mut look: impl FnMut(&Frame)) -> anyhow::Result<()> {
        match self {
            Source::Recording(recording) => each_of(recording, |frame| {
                look(frame);
                Ok(())
            }),
            Source::Log(path) => {
                let mut reader = open(path)?;
                while let Some(frame) = read(path, &mut reader)? {
                    look(&frame);
                }
                Ok(())
            }
        }
    }
}

/// Whether a file begins as CARLA's logs do.
pub fn is_log(path: &Path) -> bool {
    let mut magic = [0; 18];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic[2..] == *b"\x0e\0CARLA_RECORDER"
}

/// A log, from its first frame on.
pub fn open(path: &Path) -> anyhow::Result<Reader<BufReader<File>>> {
    let file = File::open(path).with_context(|| path.display().to_string())?;
    Reader::new(BufReader::new(file)).with_context(|| path.display().to_string())
}

/// Its next frame; none at its end, or where it was cut off.
pub fn read(path: &Path, reader: &mut Reader<impl Read>) -> anyhow::Result<Option<Frame>> {
    reader.frame().with_context(|| path.display().to_string())
}

fn head_of(recording: &Recording) -> Head {
    let told = recording.info();
    Head { version: 1, date_secs: told.unix_time_secs as i64, map: told.episode.map.clone() }
}

fn each_of(
    recording: &mut Recording,
    mut look: impl FnMut(&Frame) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut telling = Telling::new(recording);
    for segment in 0..recording.segments() {
        for moment in recording.moments(segment)? {
            look(telling.turn(moment))?;
        }
    }
    Ok(())
}

/// Writes a recording as CARLA would have; answers its frames and bytes.
pub fn export(recording: &mut Recording, path: &Path) -> anyhow::Result<(u64, u64)> {
    let told = |e| RecordError::File { path: path.to_owned(), why: e };
    let file = File::create(path).map_err(told)?;
    let mut writer = Writer::new(BufWriter::new(file), &head_of(recording)).map_err(told)?;
    let mut frames = 0;
    each_of(recording, |frame| {
        frames += 1;
        Ok(writer.put(frame).map_err(told)?)
    })?;
    writer.finish().and_then(|mut file| file.flush()).map_err(told)?;
    Ok((frames, path.metadata().map_err(told)?.len()))
}

/// Makes a recording of a log, in the world that is told; answers the blueprints of those who had
/// to be left out.
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
    let mut writer = ::record::Writer::create(&config)?;
    let mut showing = Showing::default();
    let mut reader = open(log)?;
    while let Some(frame) = read(log, &mut reader)? {
        writer.put(showing.turn(&frame))?;
        writer.spent().for_each(drop);
    }
    writer.finish()?;
    Ok(showing.strange().to_vec())
}

#[cfg(test)]
mod tests;
