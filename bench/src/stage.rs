//! `physics` and `traffic`: one stage alone, by `omnibus stage`.

use std::process::Command;

use anyhow::{Context, anyhow};
use serde_json::Value;

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit, median},
    machine::Machine,
    scene, sim,
};

const ROUNDS: usize = 3;
const FRAMES: usize = 1000;

/// Measures the figure.
pub(crate) fn physics(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    measure(
        effort,
        sink,
        "physics.step",
        "physics",
        "one step of 50 ms in substeps of at most 10 ms",
    )?;
    beside_peers(effort, sink)?;
    crowds(effort, sink)?;
    hybrid(effort, sink)
}

/// Large enough for ten thousand cars.
const LARGE_MAP: &str = "Greatmoor";
/// The number of cars, the frames, and the names of the figures.
const CROWDS: [(usize, usize, [&str; 2]); 3] = [
    (100, 400, ["physics.car_substep.cars_100", "physics.car_substep.cars_100.cores"]),
    (1000, 100, ["physics.car_substep.cars_1000", "physics.car_substep.cars_1000.cores"]),
    (3000, 40, ["physics.car_substep.cars_3000", "physics.car_substep.cars_3000.cores"]),
];

/// Measures one car's share of one substep, on one thread and on all cores.
fn crowds(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for (cars, frames, names) in CROWDS {
        for (name, threads) in names.into_iter().zip([1, cores]) {
            let (frames, cars) = (effort.count(frames).to_string(), cars.to_string());
            let threads_arg = threads.to_string();
            let args = ["stage", "physics", "--json", "--map", LARGE_MAP, "--frames", &frames];
            let more = ["--vehicles", &cars, "--physics-threads", &threads_arg];
            let what = format!("substep of 10 ms on {threads} threads");
            per_car(effort, sink, &machine, name, &[&args[..], &more].concat(), &what)?;
        }
    }
    Ok(())
}

/// Measures one car's share of one substep with hybrid physics.
fn hybrid(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let frames = effort.count(40).to_string();
    for (name, cars) in
        [("physics.hybrid.cars_1000", "1000"), ("physics.hybrid.cars_10000", "10000")]
    {
        let args = ["stage", "physics", "--json", "--map", LARGE_MAP, "--frames", &frames];
        let more = ["--vehicles", cars, "--hybrid-radius", "50"];
        let what = "substep of 10 ms with hybrid physics 50 m around one car, on one thread";
        per_car(effort, sink, &machine, name, &[&args[..], &more].concat(), what)?;
    }
    Ok(())
}

/// Measures one car's share of one substep with these arguments of `omnibus`.
fn per_car(
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
    name: &'static str,
    args: &[&str],
    what: &str,
) -> anyhow::Result<()> {
    const SUBSTEPS: f64 = 5.0;
    let mut rounds = Vec::new();
    let mut cars = 0.0;
    for _ in 0..effort.rounds(ROUNDS) {
        let report = ask(args)?;
        let number =
            |key: &str| report[key].as_f64().with_context(|| format!("no {key}: {report}"));
        cars = number("vehicles")?;
        let [p50, p90, p99] = ["p50_ms", "p90_ms", "p99_ms"].map(number);
        let share = 1e3 / SUBSTEPS / cars;
        let n = number("n")? as usize;
        rounds.push(Spread { p50: p50? * share, p90: p90? * share, p99: p99? * share, n });
    }
    let middle = |of: fn(&Spread) -> f64| median(&rounds.iter().map(of).collect::<Vec<_>>());
    let n = rounds.iter().map(|round| round.n).sum();
    let spread =
        Spread { p50: middle(|s| s.p50), p90: middle(|s| s.p90), p99: middle(|s| s.p99), n };
    let workload = format!("a car's share of a {what}, {cars} cars in traffic, {LARGE_MAP}");
    let unit = Unit::Micros;
    sink.put(&Figure { name, workload, unit, value: spread.p50, spread, peer: None }, machine)
}

/// Compares one car's share of one substep with the peers'.
fn beside_peers(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    const SUBSTEPS: f64 = 5.0;
    let machine = Machine::look();
    let map = scene::bench_map()?;
    let (frames, vehicles) = (effort.count(FRAMES).to_string(), scene::CARS.to_string());
    let args = ["stage", "physics", "--json", "--map", &map.arg, "--frames", &frames, "--vehicles"];
    // Product and peers alternate.
    let (mut own, mut peers) = (Vec::new(), Vec::new());
    for _ in 0..effort.rounds(ROUNDS) {
        let report = ask(&[&args[..], &[&vehicles]].concat())?;
        let number =
            |key: &str| report[key].as_f64().with_context(|| format!("no {key}: {report}"));
        let per_car = 1e3 / SUBSTEPS / number("vehicles")?;
        let n = number("n")? as usize;
        let [p50, p90, p99] = ["p50_ms", "p90_ms", "p99_ms"].map(number);
        own.push(Spread { p50: p50? * per_car, p90: p90? * per_car, p99: p99? * per_car, n });
        peers.push(ask_peers(effort.count(400))?);
    }
    let middle = |of: fn(&Spread) -> f64| median(&own.iter().map(of).collect::<Vec<_>>());
    let spread = Spread {
        p50: middle(|s| s.p50),
        p90: middle(|s| s.p90),
        p99: middle(|s| s.p99),
        n: own.iter().map(|s| s.n).sum(),
    };
    for (name, peer, key) in [
        ("physics.car_substep.mujoco", "MuJoCo", "mujoco"),
        ("physics.car_substep.pybullet", "PyBullet", "pybullet"),
    ] {
        let values: Option<Vec<f64>> = peers.iter().map(|report| report[key].as_f64()).collect();
        let Some(values) = values else {
            sink.skip(name, &format!("{peer} is not in the Python of OMNIBUS_PEERS_PYTHON"));
            continue;
        };
        let workload = format!(
            "a car's share of a substep of 10 ms, {} cars in traffic, {}, one thread; a car on \
             rays with a tyre model beside {PEER_CARS} multi-body ones of {peer} on a plane",
            scene::CARS,
            map.title
        );
        let peer = Some(Peer { name: peer, value: median(&values) });
        let unit = Unit::Micros;
        sink.put(&Figure { name, workload, unit, value: spread.p50, spread, peer }, &machine)?;
    }
    Ok(())
}

const PEERS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/physics_peers.py");
const PEER_CARS: usize = 20;

/// Returns the times of MuJoCo and PyBullet in microseconds; null for one that is not installed.
fn ask_peers(substeps: usize) -> anyhow::Result<Value> {
    let python = std::env::var_os("OMNIBUS_PEERS_PYTHON").unwrap_or_else(|| "python3".into());
    let output = Command::new(python)
        .args([PEERS, &PEER_CARS.to_string(), &substeps.to_string()])
        .output()
        .context("Python; OMNIBUS_PEERS_PYTHON names one that has mujoco and pybullet")?;
    let said = String::from_utf8_lossy(&output.stderr);
    let why = said.lines().last().unwrap_or("no output");
    anyhow::ensure!(output.status.success(), "{PEERS}: {why}");
    let report = String::from_utf8_lossy(&output.stdout);
    // PyBullet prints a greeting when it is loaded.
    Ok(serde_json::from_str(report.lines().last().unwrap_or_default())?)
}

/// Measures the figure.
pub(crate) fn traffic(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    measure(effort, sink, "traffic.plan", "traffic", "one plan of traffic")
}

fn measure(
    effort: Effort,
    sink: &mut Sink,
    name: &'static str,
    stage: &str,
    what: &str,
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::bench_map()?;
    let frames = effort.count(FRAMES).to_string();
    let vehicles = scene::CARS.to_string();
    let args =
        ["stage", stage, "--json", "--map", &map.arg, "--frames", &frames, "--vehicles", &vehicles];
    let report = (0..effort.rounds(ROUNDS)).map(|_| ask(&args));
    let report = report.collect::<anyhow::Result<Vec<_>>>()?;
    let number = |line: &Value, key: &str| {
        line[key].as_f64().with_context(|| format!("omnibus stage {stage} says no {key}: {line}"))
    };
    let middle = |key: &str| {
        let values = report.iter().map(|line| number(line, key));
        Ok::<_, anyhow::Error>(median(&values.collect::<anyhow::Result<Vec<_>>>()?))
    };
    let spread = Spread {
        p50: middle("p50_ms")?,
        p90: middle("p90_ms")?,
        p99: middle("p99_ms")?,
        n: (middle("n")? as usize) * report.len(),
    };
    let cars = middle("vehicles")?;
    let workload = format!("{what}, {cars} vehicles driven by traffic, {}, one thread", map.title);
    let figure =
        Figure { name, workload, unit: Unit::Millis, value: spread.p50, spread, peer: None };
    sink.put(&figure, &machine)
}

/// Returns the JSON that `omnibus` prints.
pub(crate) fn ask(args: &[&str]) -> anyhow::Result<Value> {
    let output = Command::new(sim::omnibus()?).args(args).output()?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        return Err(anyhow!("omnibus {}: {}", args.join(" "), why.trim()));
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
