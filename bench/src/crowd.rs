//! `crowd`: whole ticks with many vehicles and without sensors, as a client sees them.

use client_lib::{ActorId, TrafficParam};

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit},
    machine::Machine,
    scene::{self, Scratch},
    sim::Sim,
};

/// Frames in which traffic spreads out, before the first that counts.
const WARM_UP: usize = 200;
const ROUNDS: usize = 5;
/// Simulated time of a substep of physics. Nanoseconds.
const SUBSTEP_NANOS: u64 = 10_000_000;

struct Crowd {
    name: &'static str,
    cars: usize,
    substeps: u64,
    /// Ticks per round.
    ticks: usize,
    /// The radius of hybrid physics.
    hybrid_radius_m: Option<f32>,
    unit: Unit,
}

const CROWDS: [Crowd; 3] = [
    Crowd {
        name: "crowd.cars_100",
        cars: 100,
        substeps: 10,
        ticks: 400,
        hybrid_radius_m: None,
        unit: Unit::PerSecond("tick"),
    },
    Crowd {
        name: "crowd.cars_1000",
        cars: 1000,
        substeps: 5,
        ticks: 100,
        hybrid_radius_m: None,
        unit: Unit::TimesRealTime,
    },
    Crowd {
        name: "crowd.hybrid_10000",
        cars: 10_000,
        substeps: 5,
        ticks: 60,
        hybrid_radius_m: Some(50.0),
        unit: Unit::TimesRealTime,
    },
];

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    CROWDS.iter().try_for_each(|crowd| of_crowd(effort, sink, crowd))
}

fn of_crowd(effort: Effort, sink: &mut Sink, crowd: &Crowd) -> anyhow::Result<()> {
    let machine = Machine::look();
    let scratch = Scratch::new()?;
    let (map, title) = match crowd.cars {
        ..=1000 => ("Greatmoor".to_owned(), "Greatmoor".to_owned()),
        _ => (grid(&scratch)?, "a generated grid of 3 km".to_owned()),
    };
    let sim = Sim::start(&["--synchronous", "--map", &map, "--device", "null"])?;
    let mut client = sim.client()?;
    let delta_nanos = crowd.substeps * SUBSTEP_NANOS;
    client.synchronise(std::time::Duration::from_nanos(delta_nanos))?;
    if let Some(radius_m) = crowd.hybrid_radius_m {
        client.set_traffic_param(ActorId::NONE, TrafficParam::HybridRadiusM(radius_m))?;
        client.set_traffic_param(ActorId::NONE, TrafficParam::HybridPhysics(true))?;
    }
    let cars = scene::populate(&mut client, crowd.cars, effort.count(WARM_UP))?;
    let mut rounds = Vec::new();
    for _ in 0..effort.rounds(ROUNDS) {
        let mut round = Vec::new();
        for _ in 0..effort.count(crowd.ticks) {
            let begin = client_lib::clock::now_nanos();
            client.tick()?;
            round.push(client_lib::clock::now_nanos() - begin);
        }
        rounds.push(round);
    }
    let nanos = Spread::of_rounds(&rounds, 1.0);
    let per_tick = match crowd.unit {
        Unit::TimesRealTime => delta_nanos as f64,
        _ => 1e9,
    };
    let spread = Spread {
        p50: per_tick / nanos.p50,
        p90: per_tick / nanos.p90,
        p99: per_tick / nanos.p99,
        ..nanos
    };
    let hybrid = match crowd.hybrid_radius_m {
        Some(radius_m) => {
            format!("hybrid physics beyond {radius_m} m of an observer, of which there is none")
        }
        None => "full physics".to_owned(),
    };
    let figure = Figure {
        name: crowd.name,
        workload: format!(
            "whole ticks of a client, {title}, {cars} cars in traffic, {} substeps of 10 ms, {hybrid}, no \
             sensor; {:.2} ms a tick",
            crowd.substeps,
            nanos.p50 / 1e6
        ),
        unit: crowd.unit,
        value: spread.p50,
        spread,
        peer: None,
    };
    sink.put(&figure, &machine)
}

/// Writes a generated map with places for ten thousand cars, and returns its path.
fn grid(scratch: &Scratch) -> anyhow::Result<String> {
    let plan = mapgen::Plan {
        name: "crowd".to_owned(),
        seed: 1,
        size_m: 3000.0,
        character: mapgen::Character::Grid,
        relief_m: 5.0,
    };
    let path = scratch.path().join("crowd.xodr");
    std::fs::write(&path, mapgen::generate(&plan))?;
    path.to_str()
        .map(str::to_owned)
        .ok_or_else(|| anyhow::anyhow!("the temporary folder's name is not UTF-8"))
}
