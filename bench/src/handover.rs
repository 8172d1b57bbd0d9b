//! `handover`: an image without tracing, from the renderer's last clock reading to the client's
//! view.

use std::hint::black_box;

use client_lib::{
    ActorId, Client, Measurement, Pose, SensorBundle, clock,
    wire::{SensorSpec, camera, output},
};

use crate::{
    Effort,
    cores::{self, Pinned},
    figure::{self, Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    peer, scene,
    sim::{Sim, pid_of},
};

const ROUNDS: usize = 5;
const IMAGES: usize = 2_000;
const PEER_IMAGES: usize = 300;
/// Every chunk of the bundle's memory has been touched after this many images.
const WARM_UP: usize = 100;
/// How long a reader waits for an image before it gives up.
const PATIENCE_NANOS: u64 = 10_000_000_000;

const SIZES: [(u32, u32); 2] = [(800, 600), (1920, 1080)];

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let Some(cores) = cores::two() else {
        for name in [
            "handover.polling.800x600",
            "handover.polling_10khz.800x600",
            "handover.woken_cross_core.800x600",
        ] {
            sink.skip(name, "this machine has one core");
        }
        return woken(effort, sink, "handover.woken_same_core.800x600", [0, 0]);
    };
    let seldom = ["handover.polling.800x600", "handover.polling.1920x1080"];
    polling(effort, sink, cores, seldom, 1_000)?;
    let often = ["handover.polling_10khz.800x600", "handover.polling_10khz.1920x1080"];
    polling(effort, sink, cores, often, 10_000)?;
    woken(effort, sink, "handover.woken_same_core.800x600", [cores[0]; 2])?;
    woken(effort, sink, "handover.woken_cross_core.800x600", cores)
}

fn sensors((width, height): (u32, u32)) -> Vec<SensorSpec> {
    vec![camera("front", Pose::IDENTITY, width, height, 1.5, output::COLOR)]
}

/// The client polls without sleeping, on a core of its own; the world runs on its own clock. A rare
/// image finds the renderer's caches cold, a frequent one finds them warm.
fn polling(
    effort: Effort,
    sink: &mut Sink,
    [theirs, ours]: [usize; 2],
    names: [&'static str; 2],
    rate_hz: u32,
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim = Sim::start(&[
        "--map",
        &map.arg,
        "--device",
        "null",
        "--wait",
        "batch",
        "--fixed-delta",
        &(1.0 / f64::from(rate_hz)).to_string(),
    ])?;
    let mut client = sim.client()?;
    pin_all(&sim, &client, theirs)?;
    let _pinned = Pinned::to(ours)?;
    let mut bus = [Vec::new(), Vec::new()];
    let mut tcp = [Vec::new(), Vec::new()];
    for _ in 0..effort.rounds(ROUNDS) {
        for (index, size) in SIZES.into_iter().enumerate() {
            let mut bundle = client.create_bundle("handover", ActorId::NONE, sensors(size), 2)?;
            let mut round = Vec::with_capacity(IMAGES);
            for image in 0..WARM_UP + effort.count(IMAGES) {
                let nanos = poll(&mut bundle)?;
                if image >= WARM_UP {
                    round.push(nanos);
                }
            }
            client.destroy_bundle(bundle)?;
            bus[index].push(round);
            tcp[index].push(over_tcp(effort, size, true, theirs)?);
        }
    }
    let mut first = 0.0;
    for (index, name) in names.into_iter().enumerate() {
        let (spread, peer) =
            (Spread::of_rounds(&bus[index], 1e3), Spread::of_rounds(&tcp[index], 1e3));
        let (width, height) = SIZES[index];
        let mut workload = format!(
            "{width}x{height} RGBA, null tracer, from the renderer's end_nanos to the client's view; \
             the client polls and yields on a core of its own, {rate_hz} images a second; the peer \
             polls as many bytes"
        );
        if index == 0 {
            first = spread.p50;
        } else {
            workload.push_str(&format!("; {} times 800x600", figure::brief(spread.p50 / first)));
        }
        put(sink, &machine, name, workload, spread, peer)?;
    }
    Ok(())
}

/// The client sleeps until its tick is over; every process sleeps at once (`--wait batch`).
fn woken(
    effort: Effort,
    sink: &mut Sink,
    name: &'static str,
    [theirs, ours]: [usize; 2],
) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim =
        Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null", "--wait", "batch"])?;
    let mut client = sim.client()?;
    pin_all(&sim, &client, theirs)?;
    let _pinned = Pinned::to(ours)?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let size = SIZES[0];
    let mut bundle = client.create_bundle("handover", ActorId::NONE, sensors(size), 2)?;
    for _ in 0..WARM_UP {
        client.tick_and_collect(&mut [&mut bundle])?;
    }
    let (mut bus, mut tcp) = (Vec::new(), Vec::new());
    for _ in 0..effort.rounds(ROUNDS) {
        let mut round = Vec::with_capacity(IMAGES);
        for _ in 0..effort.count(IMAGES) {
            let (frame, measurements) = client.tick_and_collect(&mut [&mut bundle])?;
            let measurement = measurements.into_iter().flatten().next();
            let Some(measurement) = measurement else { anyhow::bail!("{frame} has no image") };
            round.push(in_hand(&measurement));
        }
        bus.push(round);
        tcp.push(over_tcp(effort, size, false, theirs)?);
    }
    let relation = if theirs == ours { "the same core" } else { "another core" };
    let workload = format!(
        "800x600 RGBA, null tracer, from the renderer's end_nanos to the client's view; the client \
         sleeps on {relation} and is woken through the barrier (renderer, host, client); the peer \
         blocks in a read of as many bytes"
    );
    let (spread, peer) = (Spread::of_rounds(&bus, 1e3), Spread::of_rounds(&tcp, 1e3));
    put(sink, &machine, name, workload, spread, peer)
}

fn put(
    sink: &mut Sink,
    machine: &Machine,
    name: &'static str,
    workload: String,
    spread: Spread,
    peer: Spread,
) -> anyhow::Result<()> {
    let peer = Some(Peer { name: "loopback TCP", value: peer.p50 });
    let figure = Figure { name, workload, unit: Unit::Micros, value: spread.p50, spread, peer };
    sink.put(&figure, machine)
}

/// Moves host and stages to one core.
fn pin_all(sim: &Sim, client: &Client, core: usize) -> anyhow::Result<()> {
    let stages = [pid_of(client, "traffic")?, pid_of(client, "sensor-render")?];
    [sim.host_pid()].into_iter().chain(stages).try_for_each(|pid| cores::pin_process(pid, core))
}

/// Polls until the next image has arrived, as the waiters of the bus do: some polls, then a yield.
fn poll(bundle: &mut SensorBundle) -> anyhow::Result<u64> {
    let begin = clock::now_nanos();
    loop {
        for _ in 0..16 {
            if let Some(measurement) = bundle.receive()? {
                return Ok(in_hand(&measurement));
            }
            std::hint::spin_loop();
        }
        std::thread::yield_now();
        anyhow::ensure!(
            clock::now_nanos() - begin < PATIENCE_NANOS,
            "no image after {} s",
            PATIENCE_NANOS / 1_000_000_000
        );
    }
}

/// Returns the time since the renderer finished, as soon as the pixels can be read.
fn in_hand(measurement: &Measurement) -> u64 {
    black_box(measurement.color(0));
    clock::now_nanos().saturating_sub(measurement.header().end_nanos)
}

fn over_tcp(
    effort: Effort,
    (width, height): (u32, u32),
    is_polling: bool,
    core: usize,
) -> anyhow::Result<Vec<u64>> {
    let mut image = vec![0; width as usize * height as usize * 4];
    let mut peer = peer::Peer::sending(image.len())?;
    cores::pin_process(peer.pid(), core)?;
    let mut nanos = Vec::new();
    for index in 0..10 + effort.count(PEER_IMAGES) {
        let took = peer.receive(&mut image, is_polling)?;
        if index >= 10 {
            nanos.push(took);
        }
    }
    Ok(nanos)
}
