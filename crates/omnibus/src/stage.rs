//! `omnibus stage`: measures one stage alone on inputs captured from a short run, a whole tick, or
//! the steps that load a map.

pub(crate) mod memory;
pub(crate) mod percentile;
mod tick;
mod world;

use std::{convert::Infallible, sync::Arc};

use anyhow::{Context, anyhow};
use bake::Cache;
use bus::clock;
use protocol::{
    ActorId, ActorState, Command, Episode, Frame, Name, Settings, Spawn, Stamp, StandingCommand,
    TrafficParam, TrafficParts, VehicleControl, Weather, WorldCommand, flag, layout, param,
};
use sensor_render::{BundleJob, Scene, Tracer, pose_planes};
use sim_host::{Decision, Inputs, NoServices, Services, Sim};
use town::Town;
use traffic::Planner;

use crate::{
    collect::{default_sensors, places},
    launch::{SIMULATOR_OPTIONS, WorldArgs},
};

/// What `omnibus stage` takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct StageArgs {
    /// Which stage
    stage: Which,
    #[command(flatten)]
    world: WorldArgs,
    /// Frames to measure, or worlds to make [default: 300, of worlds 5]
    #[arg(long)]
    frames: Option<u64>,
    /// Frames to simulate before the first that is measured
    #[arg(long, default_value_t = 100)]
    warmup: u64,
    /// Vehicles in traffic
    #[arg(long, default_value_t = 50)]
    vehicles: usize,
    /// Threads on which physics moves vehicles
    #[arg(long, value_name = "N", default_value_t = 1)]
    physics_threads: usize,
    /// Substeps of physics in a frame of 50 ms
    #[arg(long, value_name = "N", default_value_t = 5)]
    substeps: u64,
    /// Hybrid physics: full only within this distance from the first vehicle, in metres
    #[arg(long, value_name = "METRES")]
    hybrid_radius: Option<f32>,
    /// The camera's pixels across
    #[arg(long, default_value_t = 800)]
    width: u32,
    /// The camera's pixels down
    #[arg(long, default_value_t = 600)]
    height: u32,
    /// One JSON object instead of a sentence
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Which {
    /// One step of the world
    Physics,
    /// One plan of traffic
    Traffic,
    /// One measurement of the default bundle
    Render,
    /// A whole tick without sensors: bus, barrier, host and stages
    Tick,
    /// The steps that load a map: its network, its town, the scene of ray tracing
    World,
}

/// Defaults of `--frames`: measured frames, and loaded worlds for `stage world`.
const FRAMES: u64 = 300;
const WORLDS: u64 = 5;

/// Heading of the options that only `stage tick` takes; the other stages run without a simulator.
pub(crate) const TICK_ONLY: &str = "Only with `tick`, which runs a whole simulator";

/// Lists the options of a simulator under [`TICK_ONLY`].
pub(crate) fn group_options(command: clap::Command) -> clap::Command {
    command.mut_args(|arg| {
        let is_tick_only = arg.get_long().is_some_and(|name| SIMULATOR_OPTIONS.contains(&name));
        if is_tick_only { arg.help_heading(TICK_ONLY) } else { arg }
    })
}

impl StageArgs {
    fn frames(&self) -> u64 {
        self.frames.unwrap_or(FRAMES)
    }
}

/// Measures the stage and prints the percentiles.
pub(crate) fn stage(args: &StageArgs) -> anyhow::Result<()> {
    anyhow::ensure!(args.frames != Some(0), "--frames is 0, must be at least 1");
    for (what, pixels) in [("--width", args.width), ("--height", args.height)] {
        anyhow::ensure!((16..=8192).contains(&pixels), "{what} is {pixels}; use 16 to 8192");
    }
    let (name, (nanos, vehicles)) = match args.stage {
        Which::World => {
            let made = world::measure(&args.world, args.frames.unwrap_or(WORLDS))?;
            if args.json {
                print_line!("{}", made.json(args.world.map.as_deref()));
            } else {
                print_line!("{}", made.sentence());
            }
            return Ok(());
        }
        Which::Tick => {
            let commands: Vec<Command> =
                hybrid_params(args.hybrid_radius).map(Command::TrafficParam).collect();
            let settings = settings_of(args)?;
            let measured = tick::measure(
                &args.world,
                settings,
                &commands,
                args.vehicles,
                args.warmup,
                args.frames(),
            );
            ("tick", measured?)
        }
        Which::Physics => ("physics", alone(args, |captured| captured.physics())?),
        Which::Traffic => ("traffic", alone(args, |captured| Ok(captured.traffic()))?),
        Which::Render => ("render", alone(args, |captured| captured.render(args))?),
    };
    let times = Percentiles::of(nanos);
    if args.json {
        print_line!("{}", times.json(name, args, vehicles));
    } else {
        print_line!("{}", times.sentence(name, vehicles));
    }
    Ok(())
}

/// Measures a stage without bus and barrier.
fn alone(
    args: &StageArgs,
    measure: impl FnOnce(&Captured) -> anyhow::Result<Vec<u64>>,
) -> anyhow::Result<(Vec<u64>, usize)> {
    anyhow::ensure!(args.vehicles > 0, "--vehicles is 0; the stages work for at least one");
    args.world.expect_no_simulator("a stage alone; `stage tick` runs a whole simulator")?;
    let captured = Captured::from_run(args)?;
    Ok((measure(&captured)?, captured.vehicles.len()))
}

/// Returns the parameters that switch hybrid physics on with a radius.
fn hybrid_params(radius_m: Option<f32>) -> impl Iterator<Item = TrafficParam> {
    radius_m.into_iter().flat_map(|radius_m| {
        [(param::HYBRID_RADIUS_M, radius_m), (param::HYBRID_PHYSICS, 1.0)]
            .map(|(param, value)| TrafficParam { actor_id: ActorId::NONE, param, value })
    })
}

/// Returns the settings of time: frames of the default length, in so many substeps.
fn settings_of(args: &StageArgs) -> anyhow::Result<Settings> {
    anyhow::ensure!(
        (1..=100).contains(&args.substeps),
        "--substeps is {}; use 1 to 100",
        args.substeps
    );
    let settings = Settings::default();
    let substep_max_nanos = settings.delta_nanos.div_ceil(args.substeps);
    Ok(Settings { substep_max_nanos, ..settings })
}

/// The inputs of all stages, captured from a run of physics and traffic in one thread, without
/// the bus.
struct Captured {
    network: Arc<road::Network>,
    town: Town,
    seed: u64,
    settings: Settings,
    hybrid_radius_m: Option<f32>,
    physics_threads: usize,
    vehicles: Vec<Spawn>,
    /// The controls that traffic planned on each frame, including the warm-up.
    controls: Vec<Vec<VehicleControl>>,
    /// The actors of each frame, including the warm-up.
    snapshots: Vec<Vec<ActorState>>,
    warmup: usize,
}

impl Captured {
    fn from_run(args: &StageArgs) -> anyhow::Result<Captured> {
        let Episode { map, open_drive, seed } = args.world.episode()?;
        let cache = Cache::from_environment();
        let network = Arc::new(cache.network(&map, &open_drive)?);
        let mut captured = Captured {
            town: cache.town_around(&network, &open_drive, seed),
            seed,
            settings: settings_of(args)?,
            hybrid_radius_m: args.hybrid_radius,
            physics_threads: args.physics_threads,
            vehicles: Vec::new(),
            controls: Vec::new(),
            snapshots: Vec::new(),
            warmup: args.warmup as usize,
            network,
        };
        let mut sim = captured.empty_world()?;
        for pose in places(&captured.network, seed) {
            if captured.vehicles.len() == args.vehicles {
                break;
            }
            let spawn = Spawn {
                blueprint: Name::new(crate::collect::EGO),
                flags: flag::AUTOPILOT,
                role: Name::new(if captured.vehicles.is_empty() { "hero" } else { "" }),
                pose,
                ..Spawn::default()
            };
            if sim.apply_world(&WorldCommand::Spawn(spawn)).is_ok() {
                captured.vehicles.push(spawn);
            }
        }
        anyhow::ensure!(!captured.vehicles.is_empty(), "no vehicle finds a place on this map");
        let mut planner = Planner::new(Arc::clone(&captured.network), seed);
        for _ in 0..args.warmup + args.frames() {
            step(&mut sim, planner.parts(&[]), &mut NoServices::default())?;
            let actors = sim.states().to_vec();
            planner.plan(captured.settings.delta_nanos, &actors, &[]);
            captured.controls.push(planner.controls().to_vec());
            captured.snapshots.push(actors);
        }
        Ok(captured)
    }

    fn empty_world(&self) -> anyhow::Result<Sim> {
        let mut sim = Sim::new(&self.town, self.seed);
        sim.world_mut().set_threads(self.physics_threads);
        let hybrid = hybrid_params(self.hybrid_radius_m).map(StandingCommand::TrafficParam);
        let settings = StandingCommand::SetSettings(self.settings);
        for command in std::iter::once(settings).chain(hybrid) {
            let outcome = sim.apply_standing(&command, sim.stamp());
            outcome.map_err(|why| anyhow!("{}", why.reason))?;
        }
        Ok(sim)
    }

    fn stamp(&self, frame: u64) -> Stamp {
        let sim_time_nanos = frame * self.settings.delta_nanos;
        Stamp { frame: Frame(frame), sim_time_nanos, episode: 1, reserved: 0 }
    }

    /// Returns the time that physics takes for each step of the same drive, with the recorded controls.
    fn physics(&self) -> anyhow::Result<Vec<u64>> {
        let mut sim = self.empty_world()?;
        for spawn in &self.vehicles {
            let spawned = sim.apply_world(&WorldCommand::Spawn(*spawn));
            spawned.map_err(|why| anyhow!("spawn: {why}"))?;
        }
        let mut nanos = Vec::new();
        let mut controls: &[VehicleControl] = &[];
        for (index, next) in self.controls.iter().enumerate() {
            let mut stopwatch = Stopwatch::default();
            let parts = TrafficParts { controls, ..TrafficParts::default() };
            step(&mut sim, parts, &mut stopwatch)?;
            if index >= self.warmup {
                nanos.push(stopwatch.nanos);
            }
            controls = next;
        }
        let same = sim.states().iter().zip(self.snapshots.last().context("no frame")?);
        let differing = same.filter(|(a, b)| a.pose != b.pose).count();
        anyhow::ensure!(differing == 0, "{differing} actors have another pose in the second run");
        Ok(nanos)
    }

    /// Returns the time that a new planner takes for each of the same snapshots.
    fn traffic(&self) -> Vec<u64> {
        let mut planner = Planner::new(Arc::clone(&self.network), self.seed);
        let mut nanos = Vec::new();
        for (index, actors) in self.snapshots.iter().enumerate() {
            let begin = clock::now_nanos();
            planner.plan(self.settings.delta_nanos, actors, &[]);
            if index >= self.warmup {
                nanos.push(clock::now_nanos() - begin);
            }
        }
        nanos
    }

    /// Returns the time that the default bundle on the first vehicle takes for each snapshot.
    fn render(&self, args: &StageArgs) -> anyhow::Result<Vec<u64>> {
        let config = args.world.render()?;
        let scene = Scene::of_town(&self.town)?;
        let mut tracer =
            if config.null { Tracer::Null } else { Tracer::open(config.device, config.threads)? };
        let sensors = default_sensors(args.width, args.height);
        let (mut planes, byte_len) = layout(&sensors);
        let mut bytes = vec![0u64; byte_len.div_ceil(8) as usize];
        let mut world = sensor_render::World::new();
        world.set_quality(config.quality);
        let mut nanos = Vec::new();
        for (index, actors) in self.snapshots.iter().enumerate().skip(self.warmup) {
            let ego = actors.iter().find(|a| a.has(flag::AUTOPILOT)).context("the ego is gone")?;
            let begin = clock::now_nanos();
            let stamp = self.stamp(index as u64 + 1);
            let delta = self.settings.delta_nanos;
            world.place(&scene, stamp, delta, &Weather::default(), actors, |actor| {
                let [r, g, b, _] = actor.color.to_le_bytes();
                [r, g, b]
            });
            pose_planes(&mut planes, &sensors, &ego.pose);
            let out = bytemuck::cast_slice_mut(&mut bytes);
            tracer.measure(
                &scene,
                &world,
                &mut [BundleJob {
                    parent: protocol::ActorId::NONE,
                    sensors: &sensors,
                    planes: &planes,
                    out,
                }],
            )?;
            nanos.push(clock::now_nanos() - begin);
        }
        Ok(nanos)
    }
}

/// Measures the physics of one frame.
#[derive(Default)]
struct Stopwatch {
    begin_nanos: u64,
    nanos: u64,
}

impl Services for Stopwatch {
    type Error = Infallible;

    fn commands_applied(&mut self) {
        self.begin_nanos = clock::now_nanos();
    }

    fn physics_stepped(&mut self, _sim: &mut Sim) {
        self.nanos = clock::now_nanos() - self.begin_nanos;
    }
}

/// Advances the simulation core by one frame.
fn step<S: Services>(
    sim: &mut Sim,
    parts: TrafficParts<'_>,
    services: &mut S,
) -> Result<(), S::Error> {
    let decision = Some(Decision { parts, hash: 0 });
    sim.step(&Inputs { decision, requests: &[] }, services).map(drop)
}

/// How long frames took.
struct Percentiles {
    sorted: Vec<u64>,
}

impl Percentiles {
    fn of(mut nanos: Vec<u64>) -> Percentiles {
        nanos.sort_unstable();
        Percentiles { sorted: nanos }
    }

    /// The time that `share` of all frames kept, in milliseconds.
    fn at(&self, share: f64) -> f64 {
        percentile::percentile_ms(&self.sorted, share)
    }

    fn rate_hz(&self) -> f64 {
        self.sorted.len() as f64 * 1e9 / self.sorted.iter().sum::<u64>().max(1) as f64
    }

    fn sentence(&self, stage: &str, vehicles: usize) -> String {
        format!(
            "{stage}, {vehicles} vehicles, {} frames: {:.1} frames/s; p50 {:.3} ms, p90 {:.3} ms, \
             p99 {:.3} ms, longest {:.3} ms",
            self.sorted.len(),
            self.rate_hz(),
            self.at(0.5),
            self.at(0.9),
            self.at(0.99),
            self.at(1.0),
        )
    }

    fn json(&self, stage: &str, args: &StageArgs, vehicles: usize) -> serde_json::Value {
        serde_json::json!({
            "stage": stage,
            "map": args.world.map,
            "device": args.world.device,
            "vehicles": vehicles,
            "n": self.sorted.len(),
            "frames_per_s": self.rate_hz(),
            "p50_ms": self.at(0.5),
            "p90_ms": self.at(0.9),
            "p99_ms": self.at(0.99),
            "max_ms": self.at(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentile_is_a_time_that_was_measured() {
        let times = Percentiles::of((1..=100).rev().map(|ms| ms * 1_000_000).collect());
        assert_eq!([0.5, 0.9, 0.99, 1.0].map(|s| times.at(s)), [50.0, 90.0, 99.0, 100.0]);
        assert_eq!(Percentiles::of(vec![7_000_000]).at(0.01), 7.0);
    }
}
