//! `omnibus inspect`: describes a data set, a recording, a map, or the running simulators.

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use ::record::Recording;
use anyhow::{anyhow, ensure};
use bake::Cache;
use bus::{Instance, SLOTS, SlotState, clock};
use serde_json::{Value, json};

use carla_gateway::{
    carla_log::{self, Source},
    tables,
};

use crate::{collect, launch::WorldArgs, saved::existing_recording};

/// Arguments of `omnibus inspect`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct InspectArgs {
    /// The folder of a data set or of the scenes of a plan, a recording, an OpenDRIVE file, or the name
    /// of a map; default: the running simulators
    what: Option<PathBuf>,
    /// Recording: print CARLA's table of its contents
    #[arg(long, group = "table")]
    info: bool,
    /// With --info: print every position too
    #[arg(long, requires = "info")]
    all: bool,
    /// Recording: print CARLA's table of collisions between two kinds of h, v, w, t, o, a, as `v,a`
    #[arg(long, group = "table", value_name = "KINDS")]
    collisions: Option<String>,
    /// Recording: print CARLA's table of blocked actors: seconds, centimetres, as `30,10`
    #[arg(long, group = "table", value_name = "LIMITS")]
    blocked: Option<String>,
    /// Recording: measure how fast it is read, from its start and at random positions
    #[arg(long, group = "table")]
    speed: bool,
    /// Recording: print one JSON object
    #[arg(long)]
    json: bool,
}

/// Describes and checks what the argument names.
pub(crate) fn inspect(args: &InspectArgs) -> anyhow::Result<()> {
    match &args.what {
        None => running(),
        Some(dir) if dir.is_dir() => {
            print_line!("{}", collect::inspect(dir)?);
            Ok(())
        }
        Some(name) => match existing_recording(name) {
            Ok(file) if is_recording(&file) || args.asks_for_table() => {
                inspect_recording(args, &file)
            }
            _ => inspect_map(name),
        },
    }
}

impl InspectArgs {
    fn asks_for_table(&self) -> bool {
        self.info || self.speed || self.collisions.is_some() || self.blocked.is_some()
    }
}

/// Returns whether a file begins as MCAP files or CARLA logs do.
fn is_recording(path: &Path) -> bool {
    let mut magic = [0; 5];
    let read = bus::open_regular(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic == *b"\x89MCAP" || carla_log::is_log(path)
}

fn inspect_recording(args: &InspectArgs, path: &Path) -> anyhow::Result<()> {
    let mut source = Source::open(path)?;
    if let Some(kinds) = &args.collisions {
        let kinds: Vec<char> = kinds.split(',').flat_map(str::chars).collect();
        let kinds = <[char; 2]>::try_from(kinds)
            .map_err(|_| anyhow!("--collisions needs two kinds of h, v, w, t, o, a, as v,a"))?;
        let found = tables::collisions(&mut source, kinds)?;
        print_result(args.json, || found.json(), || found.text());
        return Ok(());
    }
    if let Some(limits) = &args.blocked {
        let limits = limits.split_once(',').map(|(time, way)| (time.parse(), way.parse()));
        let Some((Ok(time_s), Ok(distance_cm))) = limits else {
            return Err(anyhow!("--blocked needs seconds and centimetres, as 30,10"));
        };
        let found = tables::blocked(&mut source, time_s, distance_cm)?;
        print_result(args.json, || found.json(), || found.text());
        return Ok(());
    }
    if args.info && !args.json {
        let text = tables::file_info(&mut source, args.all, usize::MAX)?;
        print_line!("{}", text.trim_end());
        return Ok(());
    }
    let mut recording = match source {
        Source::Recording(recording) => recording,
        Source::Log(_) => return inspect_log(args, path, source),
    };
    if args.speed {
        ensure!(recording.segments() > 0, "{} holds no frames to read", path.display());
        let found = Speed::of(&mut recording)?;
        print_result(args.json, || found.json(), || found.text());
        return Ok(());
    }
    let seconds = recording.duration_nanos()? as f64 / 1e9;
    let (mut frames, mut first, mut last) = (0u64, None, None);
    for segment in 0..recording.segments() {
        for moment in recording.frames(segment)? {
            first.get_or_insert(moment.stamp.frame);
            last = Some(moment.stamp.frame);
            frames += 1;
        }
    }
    let info = recording.info();
    let bytes = path.metadata()?.len();
    let (first, last) = (first.unwrap_or_default().0, last.unwrap_or_default().0);
    print_result(
        args.json,
        || {
            json!({ "file": path, "profile": info.profile.name(), "map": info.episode.map,
                "seed": info.episode.seed, "unix_time_secs": info.unix_time_secs, "omnibus_version": info.omnibus_version,
                "frames": frames, "first_frame": first, "last_frame": last, "seconds": seconds,
                "bytes": bytes, "is_complete": info.is_complete })
        },
        || {
            let end = if info.is_complete { "" } else { "; its writer was killed" };
            let span = match frames {
                0 => "no frames".to_owned(),
                _ => format!("frames {first} to {last}"),
            };
            format!(
                "recording of {}, seed {}, profile {}, by version {}: {span}, {seconds:.2} s, \
                 {:.2} MB{end}",
                info.episode.map,
                info.episode.seed,
                info.profile.name(),
                info.omnibus_version,
                bytes as f64 / 1e6
            )
        },
    );
    Ok(())
}

fn inspect_log(args: &InspectArgs, path: &Path, mut source: Source) -> anyhow::Result<()> {
    ensure!(!args.speed, "--speed needs a recording; {} is a CARLA log", path.display());
    let (mut frames, mut actors, mut seconds) = (0u64, 0, 0.0);
    source.each(|frame| {
        frames += 1;
        actors += frame.created.len();
        seconds = frame.elapsed_s;
    })?;
    let head = source.header()?;
    let bytes = path.metadata()?.len();
    print_result(
        args.json,
        || {
            json!({ "file": path, "carla_log": head.version, "map": head.map,
                "unix_time_secs": head.date_secs, "frames": frames, "actors": actors,
                "seconds": seconds, "bytes": bytes })
        },
        || {
            format!(
                "CARLA's log of {}, version {}: {frames} frames of {actors} actors, {seconds:.2} s, \
                 {:.2} MB",
                head.map,
                head.version,
                bytes as f64 / 1e6
            )
        },
    );
    Ok(())
}

/// The reading speed of a recording.
struct Speed {
    times_real_time: f64,
    /// Milliseconds to read a random segment, sorted.
    seeks_ms: Vec<f64>,
}

/// The number of random segments that are read.
const SEEKS: u64 = 500;

impl Speed {
    fn of(recording: &mut Recording) -> anyhow::Result<Speed> {
        let seconds = recording.duration_nanos()? as f64 / 1e9;
        let begin = clock::now_nanos();
        for segment in 0..recording.segments() {
            recording.recorded_frames(segment)?;
        }
        let times_real_time = seconds / ((clock::now_nanos() - begin) as f64 / 1e9);
        let mut seeks_ms = Vec::new();
        for seek in 0..SEEKS {
            // Scattered, and the same in every run.
            let place = seek.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let segment = ((place * recording.segments() as u64) >> 32) as usize;
            recording.forget();
            let begin = clock::now_nanos();
            recording.recorded_frames(segment)?;
            seeks_ms.push((clock::now_nanos() - begin) as f64 / 1e6);
        }
        seeks_ms.sort_by(f64::total_cmp);
        Ok(Speed { times_real_time, seeks_ms })
    }

    fn at(&self, share: f64) -> f64 {
        self.seeks_ms[((self.seeks_ms.len() - 1) as f64 * share) as usize]
    }

    fn text(&self) -> String {
        format!(
            "read {:.0} times as fast as real time; a random second in {:.2} ms, p99 {:.2} ms",
            self.times_real_time,
            self.at(0.5),
            self.at(0.99)
        )
    }

    fn json(&self) -> Value {
        json!({ "times_real_time": self.times_real_time, "seek_p50_ms": self.at(0.5),
            "seek_p90_ms": self.at(0.9), "seek_p99_ms": self.at(0.99), "n": self.seeks_ms.len() })
    }
}

fn print_result(as_json: bool, json: impl FnOnce() -> Value, text: impl FnOnce() -> String) {
    if as_json {
        print_line!("{}", json());
    } else {
        print_line!("{}", text().trim_end());
    }
}

fn running() -> anyhow::Result<()> {
    let instances = Instance::running();
    if instances.is_empty() {
        print_line!("no simulator runs");
    }
    for instance in instances {
        let control = instance.control()?;
        let map = instance.episode()?.map;
        let mode = if control.is_synchronous() { "synchronous" } else { "asynchronous" };
        print_line!("{} on {map}, {mode}, at frame {}", instance.id(), control.complete.get());
        for index in 0..SLOTS {
            let slot = control.slot(index);
            if slot.state() != SlotState::Free {
                let role = slot.role().map_or("?", |role| role.name());
                let ticks = if control.ticker() == Some(index) { ", holds the tick" } else { "" };
                print_line!(
                    "  {role:<8} {:<24} process {:>7}, {:?}, frame {}{ticks}",
                    slot.name().as_str(),
                    slot.pid(),
                    slot.state(),
                    slot.ack().0,
                );
            }
        }
    }
    Ok(())
}

fn inspect_map(map: &Path) -> anyhow::Result<()> {
    let world = WorldArgs::of_map(&map.to_string_lossy());
    let episode = world.episode()?;
    let cache = Cache::from_environment();
    let network = cache.network(&episode.map, &episode.open_drive)?;
    let town = cache.town_around(&network, &episode.open_drive, episode.seed);
    let (low, high) = network.bounds();
    let size = high - low;
    print_line!("{}: {:.0} m by {:.0} m", episode.map, size.x, size.y);
    print_line!(
        "{} roads, {} lanes, {} junctions, {} signals, {} spawn points",
        network.roads().len(),
        network.lanes().len(),
        network.junctions().len(),
        network.signals().len(),
        network.spawn_points().len(),
    );
    print_line!(
        "furnished: {} triangles, {} objects",
        town.mesh.triangles.len(),
        town.objects.len()
    );
    Ok(())
}
