//! `physics` and `traffic`: one stage alone, by `omnibus stage`.

use std::process::Command;

use anyhow::{Context, anyhow};
use serde_json::Value;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, median},
    machine::Machine,
    scene, sim,
};

const ROUNDS: usize = 3;
const FRAMES: usize = 1000;

/// Takes the figure.
pub(crate) fn physics(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    measure(
        effort,
        sink,
        "physics.step",
        "physics",
        "one step of 50 ms in substeps of at most 10 ms",
    )
}

/// Takes the figure.
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
    let told = (0..effort.rounds(ROUNDS)).map(|_| ask(&args));
    let told = told.collect::<anyhow::Result<Vec<_>>>()?;
    let number = |line: &Value, key: &str| {
        line[key].as_f64().with_context(|| format!("omnibus stage {stage} says no {key}: {line}"))
    };
    let middle = |key: &str| {
        let values = told.iter().map(|line| number(line, key));
        Ok::<_, anyhow::Error>(median(&values.collect::<anyhow::Result<Vec<_>>>()?))
    };
    let spread = Spread {
        p50: middle("p50_ms")?,
        p90: middle("p90_ms")?,
        p99: middle("p99_ms")?,
        n: (middle("n")? as usize) * told.len(),
    };
    let cars = middle("vehicles")?;
    let workload = format!("{what}, {cars} vehicles driven by traffic, {}, one thread", map.title);
    let figure =
        Figure { name, workload, unit: Unit::Millis, value: spread.p50, spread, peer: None };
    sink.put(&figure, &machine)
}

/// What `omnibus` prints as JSON.
pub(crate) fn ask(args: &[&str]) -> anyhow::Result<Value> {
    let output = Command::new(sim::omnibus()?).args(args).output()?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        return Err(anyhow!("omnibus {}: {}", args.join(" "), why.trim()));
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
