//! `tick`: one empty tick, from a client's call to its return.

use std::process::Command;

use anyhow::{Context, ensure};
use client_lib::{Client, ClientError, clock};

use crate::{
    Effort,
    figure::{self, Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    peer, scene,
    sim::{self, Sim},
};

const ROUNDS: usize = 5;
const TICKS: usize = 20_000;
const WARM_UP: usize = 2_000;
const PEER_TICKS: usize = 2_000;

/// From the client's call: until the host begins, has executed commands, has stepped, has
/// published, and until the call returns. Nanoseconds of each tick.
pub(crate) type Parts = [Vec<u64>; 5];

/// Runs one tick: its nanoseconds, and its parts by the snapshot's timestamps.
pub(crate) fn timed(client: &mut Client, parts: &mut Parts) -> Result<u64, ClientError> {
    let begin = clock::now_nanos();
    client.tick()?;
    let end = clock::now_nanos();
    let header = client.world().header();
    let moments = [
        begin,
        header.begin_nanos,
        header.applied_nanos,
        header.stepped_nanos,
        header.published_nanos,
        end,
    ];
    for (part, span) in parts.iter_mut().zip(moments.windows(2)) {
        part.push(span[1].saturating_sub(span[0]));
    }
    Ok(end - begin)
}

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim =
        Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null", "--wait", "latency"])?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let mut peer = peer::Peer::ticking()?;
    for _ in 0..effort.count(WARM_UP) {
        client.tick()?;
    }
    for _ in 0..effort.count(PEER_TICKS / 10) {
        peer.tick()?;
    }
    let actors = client.world().states().len();
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    let mut parts = [const { Vec::new() }; 5];
    for _ in 0..effort.rounds(ROUNDS) {
        let mut round = Vec::with_capacity(TICKS);
        // The processes have gone to sleep during the peer's round.
        for _ in 0..100 {
            client.tick()?;
        }
        for _ in 0..effort.count(TICKS) {
            round.push(timed(&mut client, &mut parts)?);
        }
        ours.push(round);
        let ticks = (0..effort.count(PEER_TICKS)).map(|_| peer.tick());
        theirs.push(ticks.collect::<anyhow::Result<Vec<_>>>()?);
    }
    let (spread, tcp) = (Spread::of_rounds(&ours, 1e3), Spread::of_rounds(&theirs, 1e3));
    let parts = parts.map(|part| figure::brief(Spread::of_rounds(&[part], 1e3).p50));
    let [request, commands, physics, snapshot, arrivals] = parts;
    let workload = format!(
        "one tick, {}, {actors} actors, no sensor; host, traffic, renderer and client are 4 \
         processes; strict, --wait latency; the peer exchanges as many messages between 4 processes; by \
         the snapshot's stage clock: request {request}, commands {commands}, physics {physics}, snapshot \
         {snapshot}, arrivals and return {arrivals} us",
        map.title,
    );
    let figure = Figure {
        name: "tick.processes",
        workload,
        unit: Unit::Micros,
        value: spread.p50,
        spread,
        peer: Some(Peer { name: "loopback TCP", value: tcp.p50 }),
    };
    sink.put(&figure, &machine)?;
    drop((client, sim));
    in_one_process(effort, sink, &machine, &map, tcp.p50)
}

/// The same world with stages and client as threads of the host's process, measured there by
/// `omnibus stage tick`.
fn in_one_process(
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
    map: &scene::Map,
    tcp: f64,
) -> anyhow::Result<()> {
    let (frames, warmup) = (effort.count(TICKS), effort.count(WARM_UP));
    let output = Command::new(sim::omnibus()?)
        .args(["stage", "tick", "--single-process", "--json", "--vehicles", "0", "--map", &map.arg])
        .args(["--device", "null", "--wait", "latency"])
        .args(["--frames", &frames.to_string(), "--warmup", &warmup.to_string()])
        .output()
        .context("omnibus stage tick")?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    let report: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let micros = |key: &str| report[key].as_f64().map(|ms| ms * 1e3).context("a percentile");
    let p50 = micros("p50_ms")?;
    let spread = Spread { p50, p90: micros("p90_ms")?, p99: micros("p99_ms")?, n: frames };
    let workload = format!(
        "the same tick, {}, by omnibus stage tick: host, traffic, renderer and client are threads of one process",
        map.title
    );
    let figure = Figure {
        name: "tick.single_process",
        workload,
        unit: Unit::Micros,
        value: p50,
        spread,
        peer: Some(Peer { name: "loopback TCP", value: tcp }),
    };
    sink.put(&figure, machine)
}
