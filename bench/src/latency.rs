//! `latency`: from the publication of a snapshot until the agent's control takes effect.

use client_lib::{Client, Spawn, clock, wire::VehicleControl};

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief},
    machine::Machine,
    scene,
    sim::Sim,
};

const ROUNDS: usize = 5;
const TICKS: usize = 4_000;
const WARM_UP: usize = 500;
const EGO: &str = "vehicle.tesla.model3";

/// Measures the figure.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim =
        Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null", "--wait", "latency"])?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let place = client.spawn_points()?[0];
    let ego = client.spawn(Spawn::new(EGO, place))?;
    client.tick()?;
    let mut agent = Agent { client, ego, turns: 0 };
    for _ in 0..effort.count(WARM_UP) {
        agent.turn()?;
    }
    let (mut read, mut applied) = (Vec::new(), Vec::new());
    for _ in 0..effort.rounds(ROUNDS) {
        let turns = (0..effort.count(TICKS)).map(|_| agent.turn());
        let turns = turns.collect::<anyhow::Result<Vec<_>>>()?;
        read.push(turns.iter().map(|turn| turn.read_nanos).collect());
        applied.push(turns.iter().map(|turn| turn.applied_nanos).collect());
    }
    let spread = Spread::of_rounds(&applied, 1e3);
    let read = Spread::of_rounds(&read, 1e3);
    let workload = format!(
        "from snapshot N's published_nanos to snapshot N+1's applied_nanos, with the agent's control \
         in between, found in N+1; the agent ticks; {} with one car, null tracer, strict, 4 \
         processes, --wait latency; the agent has read N after {} us (p99 {})",
        map.title,
        brief(read.p50),
        brief(read.p99),
    );
    let (name, value) = ("latency.rust_agent", spread.p50);
    let figure = Figure { name, workload, unit: Unit::Micros, value, spread, peer: None };
    sink.put(&figure, &machine)
}

/// An agent that reads a snapshot and answers with a control.
struct Agent {
    client: Client,
    ego: client_lib::ActorId,
    turns: u32,
}

struct Turn {
    read_nanos: u64,
    applied_nanos: u64,
}

impl Agent {
    /// Reads the snapshot, answers, ticks, and finds the answer in the next snapshot.
    fn turn(&mut self) -> anyhow::Result<Turn> {
        let published = self.client.world().header().published_nanos;
        let car = self.client.world().state(self.ego);
        anyhow::ensure!(car.is_some(), "the car is gone");
        let read_nanos = clock::now_nanos() - published;
        self.turns += 1;
        // Each answer differs from the one before.
        let steer = (self.turns % 512) as f32 / 1024.0;
        let control =
            VehicleControl { actor_id: self.ego, brake: 1.0, steer, ..VehicleControl::default() };
        self.client.control(&[control])?;
        let frame = self.client.tick()?;
        let found = self.client.world().state(self.ego).map(|car| car.steer);
        anyhow::ensure!(
            found == Some(steer),
            "{frame} shows steer {found:?}, the agent said {steer}"
        );
        let applied = self.client.world().header().applied_nanos;
        Ok(Turn { read_nanos, applied_nanos: applied.saturating_sub(published) })
    }
}
