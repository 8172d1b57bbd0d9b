//! Profiles a running simulator from outside, or one that it starts.

use std::time::Duration;

use anyhow::{Context, anyhow, ensure};
use bus::{Instance, Queues, Role, StageClock};
use protocol::{ActorId, Command, Name, Settings, Spawn, flag};

use super::{
    args::ProfileArgs,
    sampler::{Member, SETTLED, Sampler},
};
use crate::{
    BackgroundHost,
    collect::{EGO, default_sensors, places},
    run::stop_on_signals,
};

/// Time between two looks at a simulator that runs by itself.
const POLL: Duration = Duration::from_millis(1);
/// A simulator that makes no frame for this long is not waited for.
const STILL: Duration = Duration::from_secs(10);

/// The sampled frames of one simulator.
pub(crate) struct LiveRun {
    pub(crate) map: String,
    pub(crate) settings: Settings,
    pub(crate) clocks: Vec<StageClock>,
    pub(crate) members: Vec<Member>,
    /// Frames that were overwritten before they were read.
    pub(crate) skipped: u64,
    pub(crate) queues_max: Queues,
    pub(crate) behind_max: Vec<(Role, u64)>,
}

impl LiveRun {
    fn of(instance: &Instance, sampler: &Sampler) -> anyhow::Result<LiveRun> {
        let Sampler { clocks, skipped, queues_max, behind_max, .. } = sampler;
        Ok(LiveRun {
            map: instance.episode()?.map,
            settings: sampler.settings(),
            members: sampler.members(),
            clocks: clocks.clone(),
            skipped: *skipped,
            queues_max: *queues_max,
            behind_max: behind_max.clone(),
        })
    }
}

/// Samples a running simulator. It joins nothing and changes nothing.
pub(crate) fn attached(args: &ProfileArgs) -> anyhow::Result<LiveRun> {
    ensure!(
        args.world.map.is_none(),
        "--map has no effect on a simulator that runs; --start starts one"
    );
    let instance = Instance::find(args.world.name.as_deref())
        .map_err(|why| anyhow!("{why}; --start profiles a simulator of its own"))?;
    let stop = stop_on_signals()?;
    let mut sampler = Sampler::new(&instance)?;
    let (mut frame, mut still) = (sampler.frame(), Duration::ZERO);
    while (sampler.clocks.len() as u64) < args.frames && !sampler.is_over() {
        std::thread::sleep(POLL);
        sampler.poll();
        still = if sampler.frame() == frame { still + POLL } else { Duration::ZERO };
        frame = sampler.frame();
        if still >= STILL || stop.load(std::sync::atomic::Ordering::Acquire) {
            break;
        }
    }
    ensure!(
        sampler.clocks.len() > 1,
        "simulator {:?} stands still at {frame}: its ticking client requests no frames",
        instance.id()
    );
    LiveRun::of(&instance, &sampler)
}

/// Starts a simulator with traffic and default sensors, ticks it, and samples it.
pub(crate) fn started(args: &ProfileArgs) -> anyhow::Result<LiveRun> {
    ensure!(args.vehicles > 0, "--vehicles is 0; the first vehicle carries the sensors");
    let sensors = match &args.sensors {
        Some(file) => crate::sensors_file::sensors_of(file)?,
        None => default_sensors(args.width, args.height),
    };
    let places = places(&args.world.network()?, args.world.seed());
    let settings = Settings { synchronous: 1, pipeline: args.pipeline, ..Settings::default() };
    let stop = stop_on_signals()?;
    let host = BackgroundHost::start(&args.world, settings)?;
    let mut client = host.connect("profile")?;
    let spawns: Vec<Command> = places.into_iter().take(args.vehicles).map(vehicle).collect();
    let outcomes = client.try_wire_request("spawn", &spawns)?;
    let ego = outcomes.iter().find_map(|entry| entry.outcome.result().ok());
    let ego = ActorId(ego.context("no vehicle finds a place on this map")?);
    let mut bundle = client.create_bundle("profile", ego, sensors, 2)?;
    for _ in 0..args.warmup {
        client.tick()?;
        bundle.latest()?;
    }
    let mut sampler = Sampler::new(client.instance())?;
    for _ in 0..=args.frames + SETTLED {
        client.tick()?;
        bundle.latest()?;
        sampler.poll();
        if stop.load(std::sync::atomic::Ordering::Acquire) {
            break;
        }
    }
    let run = LiveRun::of(client.instance(), &sampler)?;
    drop((bundle, client));
    host.end()?;
    Ok(run)
}

fn vehicle(pose: protocol::Pose) -> Command {
    let flags = flag::AUTOPILOT;
    Command::Spawn(Spawn { blueprint: Name::new(EGO), flags, pose, ..Spawn::default() })
}
