//! `omnibus replay`: replays a recording, or simulates it again.

use std::{
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

use ::record::{Profile, RecordedFrame, Recording};
use anyhow::{Context, anyhow, ensure};
use bus::clock;
use carla_gateway::carla_log;
use client_lib::{Client, Replay};
use protocol::{ActorState, Settings};

use crate::{
    launch::WorldArgs,
    resimulate::resimulate,
    run::{BackgroundHost, stop_on_signals},
    saved::existing_recording,
};

/// Arguments of `omnibus replay`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ReplayArgs {
    /// The recording; a name without a folder is searched in the folder for recordings, then in
    /// this folder
    file: PathBuf,
    /// Seconds to skip at the start; negative: counted from the end
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    from: f64,
    /// Seconds to play; 0: to the end
    #[arg(long, default_value_t = 0.0)]
    duration: f64,
    /// Recorded seconds per simulated second
    #[arg(long, default_value_t = 1.0)]
    time_factor: f32,
    /// Leave out actors with the role name hero
    #[arg(long)]
    ignore_hero: bool,
    /// Simulate the recorded inputs again instead of showing the recorded states
    #[arg(long)]
    resimulate: bool,
    /// Verify every frame: the shown states, or with --resimulate the state hashes
    #[arg(long, conflicts_with_all = ["time_factor", "ignore_hero"])]
    verify: bool,
    /// The map of a CARLA log, which names but does not contain it: a name or a file
    #[arg(long)]
    map: Option<String>,
    /// The simulator's name, for clients that watch
    #[arg(long)]
    name: Option<String>,
    /// The tracer for clients that watch: auto, cpu, gpu:N, or null
    #[arg(long, default_value = "auto")]
    device: String,
}

impl ReplayArgs {
    /// Returns the selected span of recorded time, in nanoseconds.
    fn span(&self, recording: &mut Recording) -> anyhow::Result<(u64, u64)> {
        ensure!(
            self.from.is_finite() && (0.0..=1e9).contains(&self.duration),
            "--from {} --duration {}: seconds, and no negative duration",
            self.from,
            self.duration
        );
        let whole = recording.duration_nanos()?;
        let nanos = |seconds: f64| (seconds.abs() * 1e9) as u64;
        let from =
            if self.from < 0.0 { whole.saturating_sub(nanos(self.from)) } else { nanos(self.from) };
        ensure!(
            from < whole,
            "--from is {} s, the recording is {:.2} s long",
            self.from,
            whole as f64 / 1e9
        );
        let until =
            if self.duration > 0.0 { from.saturating_add(nanos(self.duration)) } else { whole };
        Ok((from, until.min(whole)))
    }

    fn decode(&self) -> Replay {
        Replay {
            from_s: self.from,
            duration_s: self.duration,
            time_factor: self.time_factor,
            ignore_hero: self.ignore_hero,
        }
    }
}

/// Replays the recording, or simulates it again.
pub(crate) fn replay(args: &ReplayArgs) -> anyhow::Result<()> {
    let path = existing_recording(&args.file)?;
    if !carla_log::is_log(&path) {
        ensure!(args.map.is_none(), "{} contains its map; leave --map out", path.display());
        return replay_recording(args, path);
    }
    ensure!(
        !args.resimulate && !args.verify,
        "{} is a CARLA log, which has no inputs and no exact states to verify",
        path.display()
    );
    let imported = import_log(&path, args.map.as_deref())?;
    replay_recording(args, imported.0.clone())
}

/// Writes a CARLA log as a recording. Without a map, it is the one that the log names.
pub(crate) fn import_log(log: &Path, map: Option<&str>) -> anyhow::Result<TemporaryFile> {
    let imported = TemporaryFile::new("mcap");
    let named = carla_log::open(log)?.header().map.clone();
    let map = map.or(named.rsplit('/').next()).unwrap_or_default();
    let episode = WorldArgs::of_map(map).episode()?;
    for blueprint in carla_log::import(log, &imported.0, episode)? {
        log::warn!("unknown blueprint {blueprint:?}; its actors are left out");
    }
    Ok(imported)
}

fn replay_recording(args: &ReplayArgs, path: PathBuf) -> anyhow::Result<()> {
    let mut recording = Recording::open(&path)?;
    if recording.segments() == 0 {
        print_line!("{} holds no frames; there is nothing to replay", path.display());
        return Ok(());
    }
    let (from, until) = args.span(&mut recording)?;
    if args.resimulate {
        return run_resimulation(&mut recording, from, until);
    }
    let settings = Settings {
        synchronous: args.verify.into(),
        no_rendering: args.verify.into(),
        ..Settings::default()
    };
    let (beside, _map) = simulator(&recording, args.name.clone(), &args.device, settings)?;
    let mut client = beside.connect("replay")?;
    if args.verify {
        verify_replay(&mut client, args, &mut recording, (from, until))?;
    } else {
        watch(&mut client, args, &path, until - from)?;
    }
    drop(client);
    beside.end()?;
    Ok(())
}

/// A file that exists while a recording is replayed.
pub(crate) struct TemporaryFile(pub(crate) PathBuf);

impl TemporaryFile {
    fn new(extension: &str) -> TemporaryFile {
        let name = format!("omnibus-replay-{}.{extension}", std::process::id());
        TemporaryFile(std::env::temp_dir().join(name))
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Starts a simulator of the recorded world. Its stages read the map from the file.
pub(crate) fn simulator(
    recording: &Recording,
    name: Option<String>,
    device: &str,
    settings: Settings,
) -> anyhow::Result<(BackgroundHost, TemporaryFile)> {
    let info = recording.info();
    ensure!(
        info.profile.has_states(),
        "{} is a recording of profile {}, which keeps no states to show; use omnibus replay \
         --resimulate",
        recording.path().display(),
        info.profile.name()
    );
    let map = TemporaryFile::new("xodr");
    std::fs::write(&map.0, &info.episode.open_drive)
        .with_context(|| map.0.display().to_string())?;
    let mut world = WorldArgs::of_map(&map.0.to_string_lossy());
    world.seed = Some(info.episode.seed);
    world.name = name;
    device.clone_into(&mut world.device);
    Ok((BackgroundHost::start(&world, settings)?, map))
}

/// Replays in real time, for clients that watch.
fn watch(
    client: &mut Client,
    args: &ReplayArgs,
    path: &Path,
    recorded_nanos: u64,
) -> anyhow::Result<()> {
    let stop = stop_on_signals()?;
    let name = path.to_string_lossy();
    client.start_replay(&name, args.decode())?;
    let begin = client.await_frame()?;
    let begin_nanos = client.world().header().stamp.sim_time_nanos;
    print_line!("simulator {:?} replays {name} from {begin} on", client.instance().id());
    let length = (recorded_nanos as f64 / f64::from(args.time_factor)) as u64;
    while client.world().header().stamp.sim_time_nanos < begin_nanos + length
        && !stop.load(Ordering::Acquire)
    {
        client.await_frame()?;
    }
    print_line!("ended at {}", client.frame());
    Ok(())
}

/// Replays at full speed and compares every shown frame with the recording.
fn verify_replay(
    client: &mut Client,
    args: &ReplayArgs,
    recording: &mut Recording,
    (from, until): (u64, u64),
) -> anyhow::Result<()> {
    let path = recording.path().to_owned();
    let name = path.to_string_lossy().into_owned();
    let exact = recording.info().profile == Profile::State;
    let settings = client.wire_settings();
    client.start_replay(&name, args.decode())?;
    let begin = clock::now_nanos();
    let (mut frames, mut at) = (0u64, 0);
    let mut started = false;
    for segment in recording.segment_at(from)..recording.segments() {
        at = recording.start_nanos(segment);
        if at >= until {
            break;
        }
        for (index, moment) in recording.recorded_frames(segment)?.iter().enumerate() {
            at += if index == 0 { 0 } else { moment.delta_nanos };
            if at < from || at >= until {
                continue;
            }
            ensure!(
                started || at == from,
                "{name}: --verify begins at a frame; {} s is between two",
                args.from
            );
            started = true;
            if client.wire_settings().delta_nanos != moment.delta_nanos {
                client.apply_wire_settings(Settings {
                    delta_nanos: moment.delta_nanos,
                    ..settings
                })?;
            }
            client.tick()?;
            if exact {
                ensure!(moment.is_as_shown(), "{name}: {} is not as recorded", moment.stamp.frame);
            }
            if let Some(what) = first_difference(moment, client.world().states()) {
                return Err(anyhow!("{name}: {} differs: {what}", moment.stamp.frame));
            }
            frames += 1;
        }
    }
    let seconds = (clock::now_nanos() - begin) as f64 / 1e9;
    let how = if exact { "to the bit" } else { "as the recording keeps it" };
    print_line!(
        "{frames} frames shown as recorded, {how}; {at:.1} s of recording in {seconds:.1} s",
        at = at.saturating_sub(from) as f64 / 1e9
    );
    Ok(())
}

fn first_difference(moment: &RecordedFrame, shown: &[ActorState]) -> Option<String> {
    let bits = |state: &ActorState| -> [u32; 32] { bytemuck::cast(*state) };
    for recorded in &moment.actors {
        let at = shown.binary_search_by_key(&recorded.actor_id, |s| s.actor_id);
        match at.map(|at| &shown[at]) {
            Ok(state) if bits(state) == bits(recorded) => {}
            Ok(_) => return Some(format!("{} is shown otherwise", recorded.actor_id)),
            Err(_) => return Some(format!("{} is not shown", recorded.actor_id)),
        }
    }
    (shown.len() > moment.actors.len())
        .then(|| format!("{} are shown, {} were", shown.len(), moment.actors.len()))
}

fn run_resimulation(recording: &mut Recording, from: u64, until: u64) -> anyhow::Result<()> {
    let begin = clock::now_nanos();
    let result = resimulate(recording, from, until)?;
    let seconds = (clock::now_nanos() - begin) as f64 / 1e9;
    if let Some(difference) = result.difference {
        return Err(anyhow!("{}: {difference}", recording.path().display()));
    }
    print_line!(
        "{} frames simulated again, every state hash as recorded; {:.1} s in {seconds:.1} s",
        result.frames,
        result.sim_nanos as f64 / 1e9,
    );
    Ok(())
}
