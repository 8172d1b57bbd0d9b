//! `host`: the steps of the host in a tick, by the timestamps in the snapshot's header.

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit, brief},
    machine::Machine,
    scene,
    sim::Sim,
};

/// Large enough for a thousand cars.
const MAP: &str = "Greatmoor";
/// Frames in which traffic spreads out, before the first that counts.
const WARM_UP: usize = 200;
const ROUNDS: usize = 5;
/// Ticks per round, by the number of cars.
const CROWDS: [(usize, usize, &str); 3] =
    [(0, 5000, "host.empty"), (100, 500, "host.cars_100"), (1000, 100, "host.cars_1000")];

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    CROWDS.into_iter().try_for_each(|crowd| of_crowd(effort, sink, crowd))
}

fn of_crowd(
    effort: Effort,
    sink: &mut Sink,
    (cars, ticks, name): (usize, usize, &'static str),
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let sim = Sim::start(&["--synchronous", "--map", MAP, "--device", "null"])?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let cars = scene::populate(&mut client, cars, effort.count(WARM_UP))?;
    let others = client.world().states().len() - cars;
    // Commands, physics, snapshot, the sum; then until the last stage has arrived.
    let mut spans = [const { Vec::new() }; 5];
    for _ in 0..effort.rounds(ROUNDS) {
        let mut rounds = [const { Vec::new() }; 5];
        for _ in 0..effort.count(ticks) {
            client.tick()?;
            let end = client_lib::clock::now_nanos();
            let header = client.world().header();
            let (begin, applied) = (header.begin_nanos, header.applied_nanos);
            let (stepped, published) = (header.stepped_nanos, header.published_nanos);
            let all = [
                (begin, applied),
                (applied, stepped),
                (stepped, published),
                (begin, published),
                (published, end),
            ];
            for (round, (from, to)) in rounds.iter_mut().zip(all) {
                round.push(to.saturating_sub(from));
            }
        }
        spans.iter_mut().zip(rounds).for_each(|(span, round)| span.push(round));
    }
    let [commands, physics, snapshot, all, arrivals] =
        spans.each_ref().map(|rounds| Spread::of_rounds(rounds, 1e3));
    let report = |spread: Spread| format!("{} (p99 {})", brief(spread.p50), brief(spread.p99));
    let figure = Figure {
        name,
        workload: format!(
            "sim-host's part of a tick, {MAP}, {cars} cars in traffic and {others} lights, substeps \
             of 10 ms, no sensor: commands {}, physics {}, snapshot and journal {} us; then until \
             traffic has planned and the client sees the frame {} us",
            report(commands),
            report(physics),
            report(snapshot),
            report(arrivals)
        ),
        unit: Unit::Micros,
        value: all.p50,
        spread: all,
        peer: None,
    };
    sink.put(&figure, &machine)
}
