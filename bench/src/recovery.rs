//! `recovery`: from the kill of a process until what it did is done again.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    time::Duration,
};

use anyhow::Context;
use client_lib::{
    ActorId, Client, Pose, SensorBundle, Spawn, clock,
    wire::{camera, output},
};
use glam::Vec3;
use rustix::process::{Pid, Signal, kill_process};

use crate::{
    Effort,
    figure::{Figure, Sink, Spread, Unit},
    machine::Machine,
    scene,
    sim::{Sim, pid_of},
};

const KILLS: usize = 200;
const CARS: usize = 50;
/// Ticks between two kills: a stage that dies again and again in one frame is not started again.
const TICKS_BETWEEN: usize = 5;
/// Kills of a stage for each kill of the CARLA server.
const STAGE_KILLS: usize = 4;
/// A server that lives shorter than a second is started again with a delay.
const SERVER_LIFE: Duration = Duration::from_millis(1100);

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let sim = Sim::start(&["--synchronous", "--device", "cpu", "--carla-port", &port.to_string()])?;
    let mut client = sim.client()?;
    client.synchronise(Duration::from_nanos(scene::DELTA_NANOS))?;
    let mut bundle = furnish(&mut client)?;
    let kills = effort.count(KILLS);
    let mut put = |name, what: &str, nanos: Vec<u64>| {
        let spread = Spread::of_rounds(&[nanos], 1e6);
        let workload = format!(
            "SIGKILL of {what}; the map that ships, {CARS} cars in traffic, a 320x240 colour camera, \
             CPU tracer"
        );
        let (unit, value) = (Unit::Millis, spread.p50);
        sink.put(&Figure { name, workload, unit, value, spread, peer: None }, &machine)
    };
    let undisturbed = (0..kills).map(|_| tick(&mut client, &mut bundle));
    let undisturbed = undisturbed.collect::<anyhow::Result<Vec<_>>>()?;
    put("recovery.none", "nothing: the same tick and its image", undisturbed)?;
    for (name, role) in [("recovery.traffic", "traffic"), ("recovery.renderer", "sensor-render")] {
        let mut nanos = Vec::new();
        for _ in 0..kills {
            for _ in 0..TICKS_BETWEEN {
                tick(&mut client, &mut bundle)?;
            }
            let begin = clock::now_nanos();
            kill(pid_of(&client, role)?)?;
            tick(&mut client, &mut bundle)?;
            nanos.push(clock::now_nanos() - begin);
        }
        put(
            name,
            &format!("{role}, to the end of the tick that begins then, its image in hand"),
            nanos,
        )?;
    }
    let kills = (kills / STAGE_KILLS).max(2);
    let nanos = (0..kills).map(|_| gateway(&client, port)).collect::<anyhow::Result<Vec<_>>>()?;
    put("recovery.gateway", "the CARLA server, to its answer to a new connection", nanos)
}

/// Spawns cars in traffic, and a camera above the first.
fn furnish(client: &mut Client) -> anyhow::Result<SensorBundle> {
    let places = client.spawn_points()?;
    let mut first = ActorId::NONE;
    for place in places.iter().step_by((places.len() / CARS).max(1)).take(CARS) {
        let car = client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot())?;
        first = if first == ActorId::NONE { car } else { first };
    }
    let roof = Pose::level(Vec3::Z * 2.5, 0.0);
    let eye = camera("roof", roof, 320, 240, std::f32::consts::FRAC_PI_2, output::COLOR);
    Ok(client.create_bundle("recovery", first, [eye], 2)?)
}

/// Ticks, and returns the time until the image is there.
fn tick(client: &mut Client, bundle: &mut SensorBundle) -> anyhow::Result<u64> {
    let begin = clock::now_nanos();
    let (frame, measured) = client.tick_and_collect(&mut [bundle])?;
    anyhow::ensure!(measured[0].is_some(), "{frame} has no image");
    Ok(clock::now_nanos() - begin)
}

fn kill(pid: u32) -> anyhow::Result<()> {
    let pid = Pid::from_raw(pid as i32).context("no process")?;
    kill_process(pid, Signal::KILL).context("kill")
}

/// Kills the CARLA server, and returns the time until its successor answers.
fn gateway(client: &Client, port: u16) -> anyhow::Result<u64> {
    answer(port).context("the CARLA server")?;
    std::thread::sleep(SERVER_LIFE);
    let control = client.instance().control()?;
    // A successor that joins before the death is noticed has a number behind the name.
    let is_it = |name: client_lib::wire::Name| format!("{name}").starts_with("gateway");
    let slot = control.slots().iter().find(|slot| slot.pid() != 0 && is_it(slot.name()));
    let begin = clock::now_nanos();
    kill(slot.context("no CARLA server")?.pid())?;
    while answer(port).is_err() {
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(clock::now_nanos() - begin)
}

/// Calls `version` through a new connection.
fn answer(port: u16) -> std::io::Result<()> {
    // The list [0, 1, "version", []] as MessagePack.
    const VERSION: &[u8] = b"\x94\x00\x01\xa7version\x90";
    let mut stream = TcpStream::connect(("127.0.0.1", port))?;
    stream.set_read_timeout(Some(Duration::from_secs(60)))?;
    stream.write_all(VERSION)?;
    let mut first = [0];
    stream.read_exact(&mut first)
}
