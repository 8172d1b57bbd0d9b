//! `collect`: `omnibus collect` from its first kept frame to its last file.

use std::{fs, process::Command};

use anyhow::{Context, anyhow};
use serde_json::Value;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, median},
    machine::Machine,
    scene::Scratch,
    sim,
};

const ROUNDS: usize = 3;
const FRAMES: usize = 120;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    measure_at("collect.default", "standard", effort, sink)?;
    measure_at("collect.low", "low", effort, sink)
}

fn measure_at(
    name: &'static str,
    quality: &str,
    effort: Effort,
    sink: &mut Sink,
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let frames = effort.count(FRAMES);
    let mut runs = Vec::new();
    for _ in 0..effort.rounds(ROUNDS) {
        runs.push(run(frames, quality)?);
    }
    let mut rates: Vec<f64> = runs.iter().map(|run| run.rate_hz).collect();
    rates.sort_by(|a, b| b.total_cmp(a));
    let value = median(&rates);
    let slowest = rates[rates.len() - 1];
    let Run { tracer, bound, .. } = &runs[runs.len() - 1];
    let workload = format!(
        "omnibus collect --vehicles 50 --frames {frames} --quality {quality}: 800x600 colour, depth, tag and instance, \
         32-channel lidar, boxes, to files; tracer {tracer}; {bound}; percentiles are of runs"
    );
    let figure = Figure {
        name,
        workload,
        unit: Unit::PerSecond("frames"),
        value,
        spread: Spread { p50: value, p90: slowest, p99: slowest, n: rates.len() },
        peer: None,
    };
    sink.put(&figure, &machine)
}

struct Run {
    rate_hz: f64,
    bound: String,
    tracer: String,
}

fn run(frames: usize, quality: &str) -> anyhow::Result<Run> {
    let home = Scratch::new()?;
    let out = home.path().join("set");
    let output = Command::new(sim::omnibus()?)
        .args(["collect", "--name", &sim::unique_name(), "--vehicles", "50"])
        .args(["--frames", &frames.to_string(), "--quality", quality])
        .arg("--out")
        .arg(&out)
        .output()?;
    if !output.status.success() {
        let why = String::from_utf8_lossy(&output.stderr);
        return Err(anyhow!("omnibus collect: {}", why.trim()));
    }
    let report = String::from_utf8_lossy(&output.stdout).into_owned();
    let rate_hz = rate_of(&report).with_context(|| format!("no frames/s in: {report}"))?;
    let bound = report.lines().find(|line| line.starts_with("bound by")).unwrap_or_default();
    let metadata = fs::read(out.join("metadata.json")).unwrap_or_default();
    let metadata: Value = serde_json::from_slice(&metadata).unwrap_or_default();
    let tracer = metadata["tracers"][0].as_str().unwrap_or("unknown").to_owned();
    Ok(Run { rate_hz, bound: bound.to_owned(), tracer })
}

/// Returns the rate in `120 frames in 5.0 s: 24.0 frames/s, …`.
fn rate_of(report: &str) -> Option<f64> {
    let (before, _) = report.split_once(" frames/s")?;
    before.rsplit(' ').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_found_in_the_summary() {
        assert_eq!(rate_of("120 frames in 5.0 s: 24.0 frames/s, 96.0 images/s"), Some(24.0));
        assert_eq!(rate_of("nothing was collected"), None);
    }
}
