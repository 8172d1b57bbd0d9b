//! `quiet`: the tick of a client beside others that send floods of commands, hold many connections,
//! or do not read.

use std::{
    io::Write,
    net::{TcpListener, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::Duration,
};

use client_lib::{
    ActorId, Client, Command, Pose, SensorBundle, Spawn, Weather, clock,
    wire::{camera, output},
};
use glam::Vec3;

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit, median},
    machine::Machine,
    scene,
    sim::Sim,
};

const ROUNDS: usize = 5;
const TICKS: usize = 200;
const CARS: usize = 50;
const CONNECTIONS: usize = 500;
/// Commands of one request of a flood.
const FLOOD: usize = 10_000;

/// What other clients do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beside {
    Nothing,
    Floods(usize),
    Connections,
    SlowReader,
}

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let sim = Sim::start(&["--synchronous", "--device", "cpu", "--carla-port", &port.to_string()])?;
    let mut client = sim.client()?;
    client.synchronise(Duration::from_nanos(scene::DELTA_NANOS))?;
    let places = client.spawn_points()?;
    for place in places.iter().step_by((places.len() / CARS).max(1)).take(CARS) {
        client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot())?;
    }
    let above = Pose::level(Vec3::Z * 20.0, 0.0);
    let eye = camera("above", above, 320, 240, std::f32::consts::FRAC_PI_2, output::COLOR);
    let mut bundle = client.create_bundle("quiet", ActorId::NONE, [eye], 2)?;
    let rounds = effort.rounds(ROUNDS);
    for (name, beside, what) in [
        (
            "quiet.flood",
            Beside::Floods(1),
            format!("a client that sends {FLOOD} commands at a time"),
        ),
        (
            "quiet.floods_8",
            Beside::Floods(8),
            format!("eight clients, each {FLOOD} commands at a time"),
        ),
        (
            "quiet.connections",
            Beside::Connections,
            format!("{CONNECTIONS} connections to the CARLA server"),
        ),
        (
            "quiet.slow_reader",
            Beside::SlowReader,
            "a client that reads none of its images".to_owned(),
        ),
    ] {
        let (mut quiet, mut disturbed) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            for (times, beside) in [(&mut quiet, Beside::Nothing), (&mut disturbed, beside)] {
                let others = Others::start(&sim, port, beside)?;
                times.push(ticks(&mut client, &mut bundle, effort.count(TICKS))?);
                others.end()?;
            }
        }
        let spread = Spread::of_rounds(&disturbed, 1e6);
        let usual: Vec<f64> = quiet
            .iter()
            .map(|round| Spread::of_rounds(std::slice::from_ref(round), 1e6).p99)
            .collect();
        let workload = format!(
            "p99 of a tick with its 320x240 image, {CARS} cars in traffic, CPU tracer, beside {what}; \
             in turn with the same tick beside nothing"
        );
        let (unit, value) = (Unit::Millis, spread.p99);
        let peer = Some(Peer { name: "beside nothing", value: median(&usual) });
        sink.put(&Figure { name, workload, unit, value, spread, peer }, &machine)?;
    }
    Ok(())
}

fn ticks(client: &mut Client, bundle: &mut SensorBundle, count: usize) -> anyhow::Result<Vec<u64>> {
    let tick = |_| {
        let begin = clock::now_nanos();
        let (frame, measured) = client.tick_and_collect(&mut [bundle])?;
        anyhow::ensure!(measured[0].is_some(), "{frame} has no image");
        Ok(clock::now_nanos() - begin)
    };
    (0..count).map(tick).collect()
}

/// The other clients, until [`Others::end`].
struct Others {
    is_over: Arc<AtomicBool>,
    floods: Vec<JoinHandle<anyhow::Result<u64>>>,
    _connections: Vec<TcpStream>,
    _slow: Option<(Client, SensorBundle)>,
}

impl Others {
    fn start(sim: &Sim, port: u16, beside: Beside) -> anyhow::Result<Others> {
        let is_over = Arc::new(AtomicBool::new(false));
        let (mut floods, mut connections, mut slow) = (Vec::new(), Vec::new(), None);
        match beside {
            Beside::Nothing => {}
            Beside::Floods(count) => {
                for index in 0..count {
                    let client = Client::connect(Some(sim.name()), &format!("flood-{index}"))?;
                    let is_over = Arc::clone(&is_over);
                    let work = move || flood(client, &is_over);
                    floods.push(std::thread::Builder::new().name("flood".into()).spawn(work)?);
                }
            }
            Beside::Connections => {
                for _ in 0..CONNECTIONS {
                    let mut stream = TcpStream::connect(("127.0.0.1", port))?;
                    // The list [0, 1, "version", []] as MessagePack; the answer is not read.
                    stream.write_all(b"\x94\x00\x01\xa7version\x90")?;
                    connections.push(stream);
                }
            }
            Beside::SlowReader => {
                let mut client = Client::connect(Some(sim.name()), "slow")?;
                let above = Pose::level(Vec3::Z * 20.0, 0.0);
                let eye = camera("slow", above, 32, 24, std::f32::consts::FRAC_PI_2, output::DEPTH);
                let bundle = client.create_bundle("slow", ActorId::NONE, [eye], 2)?;
                slow = Some((client, bundle));
            }
        }
        // The others have begun.
        std::thread::sleep(Duration::from_millis(200));
        Ok(Others { is_over, floods, _connections: connections, _slow: slow })
    }

    fn end(self) -> anyhow::Result<()> {
        self.is_over.store(true, Ordering::Relaxed);
        for flood in self.floods {
            let count = flood.join().map_err(|_| anyhow::anyhow!("a flood panicked"))??;
            anyhow::ensure!(count > 0, "a flood sent nothing");
        }
        Ok(())
    }
}

/// Requests that change little, as many as are carried out.
fn flood(mut client: Client, is_over: &AtomicBool) -> anyhow::Result<u64> {
    let mut count = 0;
    let destroy = |i| Command::destroy(ActorId(1_000_000 + i));
    let mut commands: Vec<_> = (0..FLOOD as u32).map(destroy).collect();
    commands[0] = Command::set_weather(Weather::default());
    while !is_over.load(Ordering::Relaxed) {
        client.try_request("flood", &commands)?;
        count += 1;
    }
    Ok(count)
}
