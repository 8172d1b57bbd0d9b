//! `record`: the cost of a recorder per tick, its size on disk, and its reading speed.

use std::{path::Path, process::Command};

use anyhow::{Context, anyhow};
use client_lib::{Client, Profile, clock};
use serde_json::Value;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief, median},
    machine::Machine,
    scene,
    sim::{self, Sim},
};

/// Ticks with and without a recorder alternate in groups of this size.
const TURNS: usize = 16;
const TICKS: usize = 250;
/// Recorded frames from which the size per hour is computed.
const FRAMES: usize = 6000;
/// Frames in which traffic spreads out, before the first that counts.
const WARM_UP: usize = 400;

const PROFILES: [(&str, Profile); 3] =
    [("state", Profile::State), ("inputs", Profile::Inputs), ("compact", Profile::Compact)];

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::bench_map()?;
    let home = scene::Scratch::new()?;
    let sim = Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null"])?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let cars = scene::populate(&mut client, scene::CARS, effort.count(WARM_UP))?;
    for (name, profile) in PROFILES {
        let file = home.path().join(format!("{name}.mcap"));
        cost(effort, sink, &machine, &mut client, (name, profile), &file)?;
        size(effort, sink, &machine, &mut client, (name, profile), &file, cars)?;
        if profile != Profile::Inputs {
            reading(sink, &machine, name, &file)?;
        }
    }
    Ok(())
}

fn ticks(client: &mut Client, count: usize) -> anyhow::Result<Vec<u64>> {
    let tick = |_| {
        let begin = clock::now_nanos();
        client.tick()?;
        Ok(clock::now_nanos() - begin)
    };
    (0..count).map(tick).collect()
}

/// Measures the client's tick, with the recorder on and off alternately.
fn cost(
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
    client: &mut Client,
    (name, profile): (&str, Profile),
    file: &Path,
) -> anyhow::Result<()> {
    let path = file.to_str().context("the temporary folder's name is not UTF-8")?;
    let (mut on, mut off) = (Vec::new(), Vec::new());
    for _ in 0..effort.rounds(TURNS) {
        off.push(ticks(client, effort.count(TICKS))?);
        client.start_recorder(path, profile)?;
        on.push(ticks(client, effort.count(TICKS))?);
        client.stop_recorder()?;
    }
    let (on, off) = (Spread::of_rounds(&on, 1e3), Spread::of_rounds(&off, 1e3));
    let figure = Figure {
        name: match profile {
            Profile::State => "record.tick.state",
            Profile::Inputs => "record.tick.inputs",
            Profile::Compact => "record.tick.compact",
        },
        workload: format!(
            "a tick while profile {name} is recorded; without, in turns of {TICKS} ticks, {} us \
             (p99 {}): {:+.1} %",
            brief(off.p50),
            brief(off.p99),
            (on.p50 / off.p50 - 1.0) * 100.0
        ),
        unit: Unit::Micros,
        value: on.p50,
        spread: on,
        peer: None,
    };
    sink.put(&figure, machine)
}

/// Measures the size of a recording of some minutes.
fn size(
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
    client: &mut Client,
    (name, profile): (&str, Profile),
    file: &Path,
    cars: usize,
) -> anyhow::Result<()> {
    let path = file.to_str().context("the temporary folder's name is not UTF-8")?;
    let lights = client.world().states().len() - cars;
    let frames = effort.count(FRAMES);
    client.start_recorder(path, profile)?;
    ticks(client, frames)?;
    client.stop_recorder()?;
    let bytes = file.metadata()?.len() as f64;
    let seconds = frames as f64 * scene::DELTA_NANOS as f64 / 1e9;
    let value = bytes / 1e6 * 3600.0 / seconds;
    let figure = Figure {
        name: match profile {
            Profile::State => "record.size.state",
            Profile::Inputs => "record.size.inputs",
            Profile::Compact => "record.size.compact",
        },
        workload: format!(
            "profile {name}, {cars} vehicles in traffic and {lights} lights at 20 Hz: {:.2} MB for \
             {seconds:.0} s, extrapolated to an hour",
            bytes / 1e6
        ),
        unit: Unit::MegabytesAnHour,
        value,
        spread: Spread { p50: value, p90: value, p99: value, n: 1 },
        peer: None,
    };
    sink.put(&figure, machine)
}

/// Measures the reading speed by `omnibus inspect --speed`.
fn reading(sink: &mut Sink, machine: &Machine, name: &str, file: &Path) -> anyhow::Result<()> {
    let mut report = Vec::new();
    for _ in 0..3 {
        let output = Command::new(sim::omnibus()?)
            .arg("inspect")
            .arg(file)
            .args(["--speed", "--json"])
            .output()?;
        if !output.status.success() {
            return Err(anyhow!("{}", String::from_utf8_lossy(&output.stderr).trim()));
        }
        report.push(serde_json::from_slice::<Value>(&output.stdout)?);
    }
    let middle = |key: &str| {
        let values: Option<Vec<f64>> = report.iter().map(|line| line[key].as_f64()).collect();
        values.map(|values| median(&values)).with_context(|| format!("no {key}"))
    };
    let n = middle("n")? as usize * report.len();
    let is_exact = name == "state";
    let spread = Spread {
        p50: middle("seek_p50_ms")?,
        p90: middle("seek_p90_ms")?,
        p99: middle("seek_p99_ms")?,
        n,
    };
    let figure = Figure {
        name: if is_exact { "record.seek.state" } else { "record.seek.compact" },
        workload: format!("to a random second of that recording, profile {name}, page cache warm"),
        unit: Unit::Millis,
        value: spread.p50,
        spread,
        peer: None,
    };
    sink.put(&figure, machine)?;
    let rate = middle("times_real_time")?;
    let figure = Figure {
        name: if is_exact { "record.replay.state" } else { "record.replay.compact" },
        workload: format!("every frame's actors read in order, profile {name}"),
        unit: Unit::TimesRealTime,
        value: rate,
        spread: Spread { p50: rate, p90: rate, p99: rate, n: report.len() },
        peer: None,
    };
    sink.put(&figure, machine)
}
