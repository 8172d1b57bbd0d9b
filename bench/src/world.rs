//! `world`: from OpenDRIVE text to a furnished town for ray tracing, by `omnibus stage world`.

use std::path::PathBuf;

use anyhow::Context;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief},
    machine::Machine,
    map, scene, stage,
};

const ROUNDS: usize = 5;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let town = scene::bench_map()?;
    figure(effort, sink, "world.town", &town.title, &town.arg)?;
    let Some(city) = map::city()? else {
        sink.skip("world.city", "OMNIBUS_MAPS names no folder of maps");
        return Ok(());
    };
    let path =
        Scratch(std::env::temp_dir().join(format!("bench-{}-city.xodr", std::process::id())));
    std::fs::write(&path.0, city).with_context(|| path.0.display().to_string())?;
    let arg = path.0.to_str().context("the folder for temporary files is not UTF-8")?;
    figure(effort, sink, "world.city", "a netconvert city", arg)
}

/// A file that is removed when it is dropped.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // In a folder that the system cleans up.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn figure(
    effort: Effort,
    sink: &mut Sink,
    name: &'static str,
    title: &str,
    arg: &str,
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let rounds = effort.rounds(ROUNDS).to_string();
    let report = stage::ask(&["stage", "world", "--json", "--map", arg, "--frames", &rounds])?;
    let number = |key: &str| {
        report[key]
            .as_f64()
            .with_context(|| format!("omnibus stage world reports no {key}: {report}"))
    };
    let workload = format!(
        "{title}, {:.2} MB: network {} ms, town {} ms, scene {} ms; {} triangles, {} objects; at \
         most {} MB of memory; every core",
        number("megabytes")?,
        brief(number("network_ms")?),
        brief(number("town_ms")?),
        brief(number("scene_ms")?),
        number("triangles")?,
        number("objects")?,
        brief(number("peak_mb")?),
    );
    let spread = Spread {
        p50: number("p50_ms")?,
        p90: number("p90_ms")?,
        p99: number("p99_ms")?,
        n: number("n")? as usize,
    };
    let value = spread.p50;
    sink.put(&Figure { name, workload, unit: Unit::Millis, value, spread, peer: None }, &machine)
}
