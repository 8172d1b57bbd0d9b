//! `omnibus record`: records traffic in a simulator of its own.

use std::{path::PathBuf, sync::atomic::Ordering};

use ::record::Recording;
use anyhow::{Context, anyhow, ensure};
use bus::clock;
use client_lib::{Client, Profile, saved_path};
use protocol::{ActorId, Command, Name, Settings, Spawn, flag};

use crate::{
    collect::places,
    launch::WorldArgs,
    run::{BackgroundHost, nanos, stop_on_signals},
};

/// Arguments of `omnibus record`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    world: WorldArgs,
    /// Vehicles in traffic
    #[arg(long, default_value_t = 50)]
    vehicles: usize,
    /// Frames to record
    #[arg(long, default_value_t = 1200)]
    frames: u64,
    /// Frames to simulate before the first that is recorded
    #[arg(long, default_value_t = 0)]
    warmup: u64,
    /// Simulated seconds per tick
    #[arg(long, default_value_t = 0.05)]
    fixed_delta: f64,
    /// The file to write; a name without a folder goes to the folder for recordings
    #[arg(long, required_unless_present = "carla_log")]
    out: Option<PathBuf>,
    /// Also write CARLA's log to this file; without --out, write only the log
    #[arg(long, value_name = "FILE")]
    carla_log: Option<PathBuf>,
    /// How much of each frame is kept
    #[arg(long, value_enum, default_value_t = ProfileArg::State)]
    profile: ProfileArg,
    /// Print one JSON object instead of a sentence
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ProfileArg {
    /// Every published field, exactly
    State,
    /// Commands and decisions: exact by re-simulation
    Inputs,
    /// Positions within 1 cm and 0.1 degrees
    Compact,
    /// Nothing: measures the cost of recording
    None,
}

impl ProfileArg {
    fn profile(self) -> Option<Profile> {
        match self {
            ProfileArg::State => Some(Profile::State),
            ProfileArg::Inputs => Some(Profile::Inputs),
            ProfileArg::Compact => Some(Profile::Compact),
            ProfileArg::None => None,
        }
    }
}

/// Records a run.
pub(crate) fn record(args: &RecordArgs) -> anyhow::Result<()> {
    ensure!(args.frames > 0, "--frames is 0, must be at least 1");
    let delta_nanos = nanos(args.fixed_delta)?;
    let files = Files::of(args)?;
    let places = places(&args.world.network()?, args.world.seed());
    let stop = stop_on_signals()?;
    let settings = Settings { no_rendering: 1, synchronous: 1, delta_nanos, ..Settings::default() };
    let beside = BackgroundHost::start(&args.world, settings)?;
    let mut client = beside.connect("record")?;
    let vehicles = spawn(&mut client, places.into_iter().take(args.vehicles).collect())?;
    for _ in 0..args.warmup {
        client.tick()?;
    }
    let path = match args.profile.profile() {
        Some(profile) => Some(client.start_recorder(&files.recording, profile)?),
        None => None,
    };
    let mut nanos = Vec::new();
    for _ in 0..args.frames {
        let begin = clock::now_nanos();
        client.tick()?;
        nanos.push(clock::now_nanos() - begin);
        if stop.load(Ordering::Acquire) {
            break;
        }
    }
    let last_state_hash = client.world().header().state_hash;
    let stopped = client.stop_recorder();
    drop(client);
    beside.end()?;
    let frames = nanos.len();
    let recorded = stopped.with_context(|| format!("{frames} frames were simulated"))?;
    ensure!(
        path.is_none() || recorded == frames as u64,
        "{recorded} of {frames} simulated frames were recorded"
    );
    let path = files.finish(path)?;
    let bytes = path.as_ref().map_or(Ok(0), |p| p.metadata().map(|m| m.len()))?;
    let seconds = frames as f64 * args.fixed_delta;
    let megabytes_per_hour = bytes as f64 / 1e6 * 3600.0 / seconds;
    nanos.sort_unstable();
    let mean_ms = nanos.iter().sum::<u64>() as f64 / frames as f64 / 1e6;
    let p50_ms = nanos[frames / 2] as f64 / 1e6;
    let p99_ms = nanos[frames * 99 / 100] as f64 / 1e6;
    if args.json {
        print_line!(
            "{}",
            serde_json::json!({
                "file": path, "profile": format!("{:?}", args.profile).to_lowercase(),
                "vehicles": vehicles, "frames": frames, "bytes": bytes,
                "megabytes_per_hour": megabytes_per_hour, "mean_ms": mean_ms, "p50_ms": p50_ms,
                "p99_ms": p99_ms, "last_state_hash": format!("{last_state_hash:016x}"),
            })
        );
    } else {
        let file = path.map_or_else(|| "nothing".to_owned(), |p| p.display().to_string());
        print_line!(
            "{file}: {frames} frames, {seconds:.1} s of {vehicles} vehicles, {:.2} MB ({:.1} MB an hour); \
             a tick took {mean_ms:.3} ms, p99 {p99_ms:.3} ms",
            bytes as f64 / 1e6,
            megabytes_per_hour,
        );
    }
    Ok(())
}

/// The files of a run.
struct Files {
    /// The path that the client passes to the host.
    recording: String,
    /// Whether the recording is removed after its log is written.
    is_temporary: bool,
    log: Option<PathBuf>,
}

impl Files {
    fn of(args: &RecordArgs) -> anyhow::Result<Files> {
        let place = |file: &PathBuf, what| {
            let path = saved_path(&file.to_string_lossy())?;
            ensure!(
                args.profile == ProfileArg::None || !path.exists(),
                "{} is there already; name another {what}, or remove it",
                path.display()
            );
            Ok(path)
        };
        let log = args.carla_log.as_ref().map(|file| place(file, "--carla-log")).transpose()?;
        ensure!(
            log.is_none() || args.profile == ProfileArg::State,
            "--carla-log is made of exact states; leave --profile out"
        );
        let path = match (&args.out, &log) {
            (Some(out), _) => place(out, "--out")?,
            (None, Some(log)) => place(&log.with_added_extension("mcap"), "--carla-log")?,
            (None, None) => return Err(anyhow!("name an --out or a --carla-log")),
        };
        let recording = path.to_string_lossy().into_owned();
        Ok(Files { recording, is_temporary: args.out.is_none(), log })
    }

    /// Writes the log, if requested, and returns the file that stays.
    fn finish(self, path: Option<PathBuf>) -> anyhow::Result<Option<PathBuf>> {
        let (Some(log), Some(recorded)) = (self.log, &path) else { return Ok(path) };
        carla_gateway::carla_log::export(&mut Recording::open(recorded)?, &log)?;
        if !self.is_temporary {
            return Ok(path);
        }
        std::fs::remove_file(recorded)?;
        Ok(Some(log))
    }
}

/// Spawns vehicles on autopilot and returns how many were accepted.
fn spawn(client: &mut Client, places: Vec<protocol::Pose>) -> anyhow::Result<usize> {
    let commands: Vec<_> = places
        .into_iter()
        .map(|pose| {
            Command::Spawn(Spawn {
                blueprint: Name::new(crate::collect::EGO),
                flags: flag::AUTOPILOT,
                pose,
                ..Spawn::default()
            })
        })
        .collect();
    if commands.is_empty() {
        return Ok(0);
    }
    let outcomes = client.try_wire_request("spawn", &commands)?;
    let ids = outcomes.iter().filter_map(|entry| entry.outcome.result().ok());
    let count = ids.filter(|id| ActorId(*id) != ActorId::NONE).count();
    ensure!(count > 0, "no vehicle finds a place on this map");
    Ok(count)
}
