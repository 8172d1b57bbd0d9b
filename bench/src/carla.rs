//! `carla-client`: the official `carla` package through the CARLA server, alternating with the same
//! by client-lib, in one simulator.

use std::{
    ffi::OsString,
    net::TcpListener,
    process::Command,
    sync::atomic::{AtomicBool, Ordering},
};

use anyhow::{Context, ensure};
use client_lib::{
    ActorId, Client, Pose, Spawn, clock,
    wire::{VehicleControl, camera, output},
};
use glam::{Quat, Vec3};

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    scene,
    sim::Sim,
};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/carla_client.py");
const ROUNDS: usize = 3;
const TICKS: usize = 2_000;
const IMAGES: usize = 300;
const CARS: usize = 100;
const CALLS: usize = 1_000;

/// Nanoseconds of each measurement, by round.
type Rounds = Vec<Vec<u64>>;

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let port = free_port()?;
    let args = ["--synchronous", "--map", &map.arg, "--device", "null"];
    let sim = Sim::start(&[&args[..], &["--carla-port", &port.to_string()]].concat())?;
    let mut put = |name, workload: String, (official, ours): (Rounds, Rounds)| {
        let (theirs, ours) = (Spread::of_rounds(&official, 1e3), Spread::of_rounds(&ours, 1e3));
        let peer = Some(Peer { name: "client-lib", value: ours.p50 });
        let unit = Unit::Micros;
        sink.put(
            &Figure { name, workload, unit, value: theirs.p50, spread: theirs, peer },
            &machine,
        )
    };
    let (ticks, rounds) = (effort.count(TICKS), effort.rounds(ROUNDS));
    let tick = |props: usize| {
        in_turn(rounds, &sim, port, "tick", ticks, move |client| {
            fill(client, props)?;
            timed(ticks, || Ok(client.tick().map(drop)?))
        })
    };
    let ticked = |props: usize| format!("one tick, {props} static props and nothing else");
    put("carla.tick_3", ticked(3), tick(3)?)?;
    let both = in_turn(rounds, &sim, port, "image", effort.count(IMAGES), |client| {
        let at = Pose::level(Vec3::Z * 20.0, 0.0);
        let spec = camera("front", at, 800, 600, std::f32::consts::FRAC_PI_2, output::COLOR);
        let mut bundle = client.create_bundle("bench", ActorId::NONE, [spec], 2)?;
        let times = timed(ticks, || {
            let (_, measured) = client.tick_and_collect(&mut [&mut bundle])?;
            ensure!(measured[0].is_some(), "a frame has no image");
            Ok(())
        });
        client.destroy_bundle(bundle)?;
        times
    })?;
    put("carla.image", "tick to 800x600 image in hand, nothing traced, 3 props".to_owned(), both)?;
    put("carla.tick_100", ticked(100), tick(100)?)?;
    put("carla.tick_500", ticked(500), tick(500)?)?;
    let both = in_turn(rounds, &sim, port, "batch", ticks, |client| {
        let cars = cars(client)?;
        let control = |id: &ActorId| VehicleControl {
            actor_id: *id,
            throttle: 0.3,
            ..VehicleControl::default()
        };
        let controls: Vec<_> = cars.iter().map(control).collect();
        timed(ticks, || Ok(client.control(&controls)?))
    })?;
    put("carla.batch", format!("pedals of {CARS} cars in one batch"), both)?;
    let both = in_turn(rounds, &sim, port, "call", ticks, |client| {
        timed(ticks, || {
            std::hint::black_box(client.wire_settings());
            Ok(())
        })
    })?;
    put("carla.call", "the smallest question: the version, or the settings".to_owned(), both)?;
    beside_image(effort, sink, &machine, &map.arg)
}

/// Measures calls of the official package while another client's image is traced on the processor,
/// and the same calls while the world stands still.
fn beside_image(
    effort: Effort,
    sink: &mut Sink,
    machine: &Machine,
    map: &str,
) -> anyhow::Result<()> {
    let port = free_port()?;
    let args = ["--synchronous", "--map", map, "--device", "cpu"];
    let sim = Sim::start(&[&args[..], &["--carla-port", &port.to_string()]].concat())?;
    let mut client = sim.client()?;
    client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    let above = Pose::level(Vec3::Z * 2.0, 0.0);
    let spec = camera("front", above, 1920, 1080, std::f32::consts::FRAC_PI_2, output::COLOR);
    let mut bundle = client.create_bundle("bench", car, [spec], 2)?;
    client.tick()?;
    let (rounds, calls) = (effort.rounds(ROUNDS), effort.count(CALLS));
    for (job, name, what) in [
        ("actor", "carla.actor_beside_image", "an actor's physics control"),
        ("manager", "carla.manager_beside_image", "a setting of the Traffic Manager"),
    ] {
        let job = format!("{job}:{}", car.0);
        let (mut disturbed, mut alone) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            alone.push(official_package(port, &job, calls)?);
            let is_over = AtomicBool::new(false);
            disturbed.push(std::thread::scope(|scope| {
                let ticking = std::thread::Builder::new().name("ticks".into()).spawn_scoped(
                    scope,
                    || -> anyhow::Result<()> {
                        while !is_over.load(Ordering::Relaxed) {
                            client.tick_and_collect(&mut [&mut bundle])?;
                        }
                        Ok(())
                    },
                )?;
                let measured = official_package(port, &job, calls);
                is_over.store(true, Ordering::Relaxed);
                ticking.join().map_err(|_| anyhow::anyhow!("the ticking thread panicked"))??;
                measured
            })?);
        }
        let (value, alone) = (Spread::of_rounds(&disturbed, 1e3), Spread::of_rounds(&alone, 1e3));
        let figure = Figure {
            name,
            workload: format!("{what}, while another client's 1920x1080 image is traced"),
            unit: Unit::Micros,
            value: value.p50,
            spread: value,
            peer: Some(Peer { name: "the world stands still", value: alone.p50 }),
        };
        sink.put(&figure, machine)?;
    }
    Ok(())
}

/// Measures both, round by round; the other client is not connected.
fn in_turn(
    rounds: usize,
    sim: &Sim,
    port: u16,
    job: &str,
    count: usize,
    mut ours: impl FnMut(&mut Client) -> anyhow::Result<Vec<u64>>,
) -> anyhow::Result<(Rounds, Rounds)> {
    let (mut official, mut own) = (Vec::new(), Vec::new());
    for _ in 0..rounds {
        let mut client = sim.client()?;
        take_tick(&mut client)?;
        client.synchronise(std::time::Duration::from_nanos(scene::DELTA_NANOS))?;
        own.push(ours(&mut client)?);
        drop(client);
        official.push(official_package(port, job, count)?);
    }
    Ok((official, own))
}

/// The server releases the tick when its last client has disconnected.
pub(crate) fn take_tick(client: &mut Client) -> anyhow::Result<()> {
    for _ in 0..1000 {
        if client.take_tick().is_ok() {
            return Ok(());
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    Ok(client.take_tick()?)
}

fn timed(count: usize, mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<Vec<u64>> {
    let mut times = Vec::with_capacity(count);
    for _ in 0..count {
        let begin = clock::now_nanos();
        work()?;
        times.push(clock::now_nanos() - begin);
    }
    Ok(times)
}

/// Returns the nanoseconds of each measurement of the official package.
fn official_package(port: u16, job: &str, count: usize) -> anyhow::Result<Vec<u64>> {
    let python =
        std::env::var_os("OMNIBUS_CARLA_PYTHON").unwrap_or_else(|| OsString::from("python3"));
    let output = Command::new(python)
        .args([SCRIPT, &port.to_string(), job, &count.to_string()])
        .output()
        .context("Python with the carla package; OMNIBUS_CARLA_PYTHON names one that has it")?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "{}; OMNIBUS_CARLA_PYTHON names a Python that has the carla package",
        said.lines().last().unwrap_or("no words")
    );
    let seconds: Vec<f64> = serde_json::from_slice(&output.stdout)?;
    Ok(seconds.into_iter().map(|secs| (secs * 1e9) as u64).collect())
}

/// Spawns props far from the road, up to this number.
fn fill(client: &mut Client, props: usize) -> anyhow::Result<()> {
    let is_prop = |id: &str| id.starts_with("static.");
    let blueprint = client.blueprints().iter().find(|b| is_prop(&b.id)).context("no prop")?;
    let blueprint = blueprint.id.clone();
    client.tick()?;
    for index in client.world().states().len()..props {
        let at = Vec3::new(index as f32 * 10.0, 3000.0, 300.0);
        client.spawn(Spawn::new(&blueprint, Pose::new(at, Quat::IDENTITY)).kinematic())?;
    }
    client.tick()?;
    Ok(())
}

/// Spawns cars in the air, to receive controls.
fn cars(client: &mut Client) -> anyhow::Result<Vec<ActorId>> {
    let is_car = |a: &&client_lib::wire::ActorState| a.kind == client_lib::wire::kind::VEHICLE;
    let there = client.world().states().iter().filter(is_car).count();
    for index in there..CARS {
        let at = Vec3::new(index as f32 * 10.0, -3000.0, 300.0);
        let spawn = Spawn::new("vehicle.audi.tt", Pose::new(at, Quat::IDENTITY));
        client.spawn(spawn.kinematic())?;
    }
    client.tick()?;
    Ok(client.world().states().iter().filter(is_car).map(|a| a.actor_id).collect())
}

/// Returns a port that is free, as is the next one, at the time of the call.
pub(crate) fn free_port() -> anyhow::Result<u16> {
    for _ in 0..100 {
        let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
        if port < u16::MAX && TcpListener::bind(("127.0.0.1", port + 1)).is_ok() {
            return Ok(port);
        }
    }
    anyhow::bail!("no two free ports side by side")
}
