//! `start`: from the start of the process to the first image at the client, and the time in which a
//! running simulator loads another map.

use std::{f32::consts::FRAC_PI_2, time::Duration};

use anyhow::anyhow;
use client_lib::{
    ActorId, Client, Pose, clock,
    wire::{camera, output},
};
use glam::Vec3;

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief},
    machine::Machine,
    scene,
    sim::Sim,
};

const STARTS: usize = 5;
const CHANGES: usize = 15;
const PATIENCE_NANOS: u64 = 120_000_000_000;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let starts = (0..effort.rounds(STARTS)).map(|_| start());
    let starts = starts.collect::<anyhow::Result<Vec<_>>>()?;
    let first_image: Vec<u64> = starts.iter().map(|s| s.image_nanos).collect();
    let connected: Vec<u64> = starts.iter().map(|s| s.connected_nanos).collect();
    let spread = Spread::of_rounds(&[first_image], 1e6);
    let workload = format!(
        "omnibus run of the map that ships, CPU tracer, one 800x600 colour camera; process start to \
         first image in the client's hand; the client is let in after {} ms; percentiles are of starts",
        brief(Spread::of_rounds(&[connected], 1e6).p50),
    );
    let (name, value) = ("start.first_image", spread.p50);
    let figure = Figure { name, workload, unit: Unit::Millis, value, spread, peer: None };
    sink.put(&figure, &machine)?;
    let [other, same] = changes(effort.rounds(CHANGES))?;
    for (name, what, nanos) in [
        ("start.other_map", "between Town01 and Town02, both baked before", other),
        ("start.same_map", "the running map again", same),
    ] {
        let spread = Spread::of_rounds(&[nanos], 1e6);
        let workload = format!(
            "a running simulator loads {what}; from the call until every process stands and the \
             client sees the new world; one camera measured before; percentiles are of loads"
        );
        let (unit, value) = (Unit::Millis, spread.p50);
        sink.put(&Figure { name, workload, unit, value, spread, peer: None }, &machine)?;
    }
    Ok(())
}

/// Measures loading another map, and the same map.
fn changes(rounds: usize) -> anyhow::Result<[Vec<u64>; 2]> {
    let begin = clock::now_nanos();
    let mut sim = Sim::spawn(&["--synchronous", "--device", "cpu", "--map", "Town01"])?;
    let mut client = connect(&mut sim, begin)?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    client.load_map("Town02")?;
    let mut nanos = [Vec::new(), Vec::new()];
    for round in 0..2 * rounds {
        let at = Pose::level(Vec3::Z * 20.0, 0.0);
        let sensors = [camera("front", at, 64, 64, FRAC_PI_2, output::COLOR)];
        let mut bundle = client.create_bundle("change", ActorId::NONE, sensors, 2)?;
        client.tick_and_collect(&mut [&mut bundle])?;
        let is_same = round % 2;
        let map = ["Town01", "Town02"][round / 2 % 2];
        let begin = clock::now_nanos();
        client.load_map(map)?;
        nanos[is_same].push(clock::now_nanos() - begin);
    }
    Ok(nanos)
}

struct Start {
    connected_nanos: u64,
    image_nanos: u64,
}

fn start() -> anyhow::Result<Start> {
    let begin = clock::now_nanos();
    let mut sim = Sim::spawn(&["--synchronous", "--device", "cpu"])?;
    let mut client = connect(&mut sim, begin)?;
    let connected_nanos = clock::now_nanos() - begin;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let at = Pose::level(Vec3::Z * 20.0, 0.0);
    let sensors = [camera("front", at, 800, 600, FRAC_PI_2, output::COLOR)];
    let mut bundle = client.create_bundle("start", ActorId::NONE, sensors, 2)?;
    let (frame, measured) = client.tick_and_collect(&mut [&mut bundle])?;
    anyhow::ensure!(measured.iter().flatten().count() == 1, "{frame} has no image");
    Ok(Start { connected_nanos, image_nanos: clock::now_nanos() - begin })
}

/// Connects, trying every millisecond.
fn connect(sim: &mut Sim, begin: u64) -> anyhow::Result<Client> {
    loop {
        let refused = match Client::connect(Some(sim.name()), "bench") {
            Ok(client) => return Ok(client),
            Err(e) => e,
        };
        if let Some(why) = sim.has_ended() {
            return Err(anyhow!("omnibus run: {}", why.trim()));
        }
        if clock::now_nanos() - begin > PATIENCE_NANOS {
            return Err(refused.into());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}
