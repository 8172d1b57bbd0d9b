//! `environment`: steps of a driving environment in this process, and the begin of an episode.

use std::{fs, sync::Arc, time::Instant};

use bake::Cache;
use environment::{Action, Config, Environment, EnvironmentMap};

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit},
    machine::Machine,
};

const ROUNDS: usize = 5;
const STEPS: usize = 5000;
const RESETS: usize = 200;

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
    let config = Config { frames_per_step: 1, ..Config::default() };
    let mut environment = Environment::new(map, config, 1)?;
    let resident_mb = resident_bytes()? as f64 / 1e6;
    let (mut steps, mut resets) = (Vec::new(), Vec::new());
    let mut seed = 1;
    for _ in 0..effort.rounds(ROUNDS) {
        let mut nanos = Vec::new();
        let mut lidar = Vec::new();
        for _ in 0..effort.count(STEPS) {
            let begin = Instant::now();
            let state = environment.egos()[0].state();
            let steer = (2.0 * state[11].atan2(state[10])).clamp(-1.0, 1.0);
            let pedal = (0.5 * (5.0 - state[0] * 30.0)).clamp(-1.0, 1.0);
            let step = environment.step(&[Action::Pedals { steer, pedal }])?[0];
            environment.lidar(0, &mut lidar);
            nanos.push(begin.elapsed().as_nanos() as u64);
            if step.ending.is_some() {
                seed += 1;
                environment.reset(seed)?;
            }
        }
        steps.push(nanos);
        let mut nanos = Vec::new();
        for _ in 0..effort.count(RESETS) {
            seed += 1;
            let begin = Instant::now();
            environment.reset(seed)?;
            nanos.push(begin.elapsed().as_nanos() as u64);
        }
        resets.push(nanos);
    }
    let spread = Spread::of_rounds(&steps, 1e9).as_rates(1.0);
    let workload = format!(
        "one step of 50 ms on one core: ego and 12 cars with full physics, traffic, state vector, \
         lidar of 240 rays; the map that ships, loaded from the cache in {load_ms:.0} ms, \
         {resident_mb:.0} MB resident"
    );
    let (name, value) = ("environment.step", spread.p50);
    let unit = Unit::PerSecond("steps");
    sink.put(&Figure { name, workload, unit, value, spread, peer: None }, &machine)?;
    let spread = Spread::of_rounds(&resets, 1e6);
    let workload = "another episode on the same map: 13 vehicles, a route of 300 m, ten frames in \
                    which the vehicles settle"
        .to_owned();
    let (name, value) = ("environment.reset", spread.p50);
    sink.put(&Figure { name, workload, unit: Unit::Millis, value, spread, peer: None }, &machine)
}

/// Resident memory of this process.
fn resident_bytes() -> anyhow::Result<u64> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or_default();
    let kilobytes = line.trim().trim_end_matches(" kB").parse::<u64>()?;
    Ok(kilobytes << 10)
}
