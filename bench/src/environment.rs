//! `environment`: steps of a driving environment in this process, and the begin of an episode.

use std::{fs, process::Command, sync::Arc, time::Instant};

use bake::Cache;
use environment::{Action, Camera, Config, Environment, EnvironmentMap, Physics};

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit, median},
    machine::Machine,
};

const ROUNDS: usize = 5;
const STEPS: usize = 5000;
const RESETS: usize = 200;
/// Worlds beside the first, for their memory.
const WORLDS: u64 = 10;
const PEER_STEPS: usize = 500;
/// Steps with a camera, which are slower.
const CAMERA_STEPS: usize = 1000;
/// MetaDrive takes seconds for a step without a GPU.
const PEER_CAMERA_STEPS: usize = 10;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let (name, open_drive) = mapgen::default_map();
    let cache = Cache::from_environment();
    let load = || EnvironmentMap::load(&cache, name, &open_drive, 1);
    // The first time fills the cache.
    drop(load()?);
    let begin = Instant::now();
    let map = Arc::new(load()?);
    let load_ms = begin.elapsed().as_secs_f64() * 1e3;
    let config = |physics| Config { frames_per_step: 1, physics, ..Config::default() };
    let first = Environment::new(Arc::clone(&map), config(Physics::All), 1)?;
    let first_ms = begin.elapsed().as_secs_f64() * 1e3;
    let resident_mb = resident_bytes()? as f64 / 1e6;
    let more = (2..2 + WORLDS)
        .map(|seed| Environment::new(Arc::clone(&map), config(Physics::All), seed))
        .collect::<Result<Vec<_>, _>>()?;
    let further_mb = (resident_bytes()? as f64 / 1e6 - resident_mb) / WORLDS as f64;
    drop((first, more));
    let steps_asked = effort.count(PEER_STEPS);
    let peers = [
        ("MetaDrive", ask("metadrive", "OMNIBUS_METADRIVE_PYTHON", steps_asked)),
        ("highway-env", ask("highway-env", "OMNIBUS_HIGHWAY_ENV_PYTHON", steps_asked)),
    ];
    for (figure, physics, bodies) in [
        ("environment.step", Physics::All, "all vehicles with full physics"),
        ("environment.step.ego", Physics::Ego, "the ego vehicle with full physics"),
    ] {
        let mut environment = Environment::new(Arc::clone(&map), config(physics), 1)?;
        let mut lidar = Vec::new();
        let observe = |environment: &mut Environment| {
            environment.lidar(0, &mut lidar);
            Ok(())
        };
        let rounds = steps(&mut environment, effort, STEPS, observe)?;
        let spread = Spread::of_rounds(&rounds, 1e9).as_rates(1.0);
        let workload = format!(
            "one step of 50 ms on one core: ego and 12 cars, {bodies}, traffic, state vector, lidar \
             of 240 rays; the map that ships, {load_ms:.0} ms from the cache, {first_ms:.0} ms to \
             the first world, {resident_mb:.0} MB resident, {further_mb:.1} MB for each further \
             world"
        );
        let unit = Unit::PerSecond("steps");
        let figure = |peer, workload| {
            let (name, value) = (figure, spread.p50);
            Figure { name, workload, unit, value, spread, peer }
        };
        sink.put(&figure(None, workload), &machine)?;
        for (peer, report) in &peers {
            let Some(report) = report else {
                sink.skip(figure(None, String::new()).name, &format!("{peer} is not installed"));
                continue;
            };
            let what = format!("the same beside {peer} with as many rays");
            let (workload, peer) = peer_of(peer, &what, report);
            sink.put(&figure(Some(peer), workload), &machine)?;
        }
    }
    camera(&map, effort, sink, &machine)?;
    let mut environment = Environment::new(map, config(Physics::All), 1)?;
    let mut resets = Vec::new();
    for round in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        for seed in 0..effort.count(RESETS) {
            let begin = Instant::now();
            environment.reset((round * RESETS + seed) as u64)?;
            nanos.push(begin.elapsed().as_nanos() as u64);
        }
        resets.push(nanos);
    }
    let spread = Spread::of_rounds(&resets, 1e6);
    let workload = "another episode on the same map: 13 vehicles, a route of 300 m, ten frames in \
                    which the vehicles settle"
        .to_owned();
    let (name, value) = ("environment.reset", spread.p50);
    sink.put(&Figure { name, workload, unit: Unit::Millis, value, spread, peer: None }, &machine)?;
    let (mut pixels, mut rasters) = (Vec::new(), Vec::new());
    for _ in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        for _ in 0..effort.count(STEPS) {
            let begin = Instant::now();
            environment.birds_eye(0, &mut pixels);
            nanos.push(begin.elapsed().as_nanos() as u64);
        }
        rasters.push(nanos);
    }
    let spread = Spread::of_rounds(&rasters, 1e3);
    let workload = "a bird's-eye raster of 6 channels of 84 x 84 pixels, 13 vehicles".to_owned();
    let (name, value) = ("environment.birds_eye", spread.p50);
    sink.put(&Figure { name, workload, unit: Unit::Micros, value, spread, peer: None }, &machine)
}

/// Measures steps with a camera.
fn camera(
    map: &Arc<EnvironmentMap>,
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
) -> anyhow::Result<()> {
    let mut image = Vec::new();
    let config = Config { frames_per_step: 1, ..Config::default() };
    let Camera { width_px, height_px, .. } = config.camera;
    // The first image keeps the scene in the cache, if it had to be built.
    Environment::new(Arc::clone(map), config.clone(), 1)?.camera(0, &mut image)?;
    let (name, open_drive) = mapgen::default_map();
    let begin = Instant::now();
    let cache = Cache::from_environment();
    let map = Arc::new(EnvironmentMap::load(&cache, name, &open_drive, 1)?);
    let mut environment = Environment::new(map, config, 1)?;
    environment.camera(0, &mut image)?;
    let first_ms = begin.elapsed().as_secs_f64() * 1e3;
    let rounds = steps(&mut environment, effort, CAMERA_STEPS, |environment| {
        Ok(environment.camera(0, &mut image)?)
    })?;
    let spread = Spread::of_rounds(&rounds, 1e9).as_rates(1.0);
    let figure = |peer, workload| {
        let (name, unit, value) = ("environment.camera", Unit::PerSecond("steps"), spread.p50);
        Figure { name, workload, unit, value, spread, peer }
    };
    let workload = format!(
        "one step of 50 ms in one thread: ego and 12 cars with full physics, traffic, state vector, a \
         front camera of {width_px} x {height_px} pixels in color; {first_ms:.0} ms from the cache to \
         the first image"
    );
    sink.put(&figure(None, workload), machine)?;
    let steps = effort.count(PEER_CAMERA_STEPS);
    match ask("metadrive-camera", "OMNIBUS_METADRIVE_PYTHON", steps) {
        Some(report) => {
            let what = "the same beside MetaDrive with its camera of as many pixels";
            let (workload, peer) = peer_of("MetaDrive", what, &report);
            sink.put(&figure(Some(peer), workload), machine)
        }
        None => {
            sink.skip("environment.camera", "MetaDrive is not installed, or has no OpenGL");
            Ok(())
        }
    }
}

/// Returns the nanoseconds of each step with its observations, in rounds.
fn steps(
    environment: &mut Environment,
    effort: Effort,
    count: usize,
    mut observe: impl FnMut(&mut Environment) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<Vec<u64>>> {
    let (mut rounds, mut seed) = (Vec::new(), 1);
    for _ in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        for _ in 0..effort.count(count) {
            let begin = Instant::now();
            let state = environment.egos()[0].state();
            let steer = (2.0 * state[11].atan2(state[10])).clamp(-1.0, 1.0);
            let pedal = (0.5 * (5.0 - state[0] * 30.0)).clamp(-1.0, 1.0);
            let step = environment.step(&[Action::Pedals { steer, pedal }])?[0];
            observe(environment)?;
            nanos.push(begin.elapsed().as_nanos() as u64);
            if step.ending.is_some() {
                seed += 1;
                environment.reset(seed)?;
            }
        }
        rounds.push(nanos);
    }
    Ok(rounds)
}

const PEERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/environment_peers.py");

/// Returns what a peer measured; `None` if it is not installed or fails.
fn ask(name: &str, variable: &str, steps: usize) -> Option<serde_json::Value> {
    let python = std::env::var_os(variable).unwrap_or_else(|| "python3".into());
    let output = Command::new(python).args([PEERS, name, &steps.to_string()]).output().ok()?;
    let report = String::from_utf8_lossy(&output.stdout);
    let report: serde_json::Value = serde_json::from_str(report.lines().last()?).ok()?;
    report.is_object().then_some(report)
}

/// Returns the workload and the value of a peer from its report.
fn peer_of(name: &'static str, what: &str, report: &serde_json::Value) -> (String, Peer) {
    let number = |key: &str| report[key].as_f64().unwrap_or(f64::NAN);
    let rates = report["steps_per_s"].as_array().into_iter().flatten();
    let rates: Vec<f64> = rates.filter_map(serde_json::Value::as_f64).collect();
    let workload = format!(
        "{what} and {:.1} cars: {:.1} s from before its import to the first observation, {:.0} MB \
         resident",
        number("others"),
        number("first_observation_s"),
        number("resident_mb")
    );
    (workload, Peer { name, value: median(&rates) })
}

/// Resident memory of this process.
fn resident_bytes() -> anyhow::Result<u64> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    let kilobytes = line.trim().trim_end_matches(" kB").parse::<u64>()?;
    Ok(kilobytes << 10)
}
