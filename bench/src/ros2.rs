//! `ros2`: images from the renderer to a subscriber of ROS 2 in another implementation of DDS, and
//! the tick beside the node.

use std::{
    collections::BTreeMap,
    ffi::OsString,
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
    time::{Duration, Instant},
};

use anyhow::{Context, ensure};
use client_lib::{
    ActorId, Client, Spawn, clock,
    wire::{camera, output},
};
use glam::Vec3;
use rustix::process::{Pid, Signal, kill_process};

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    scene::{self, Scratch},
    sim::{Sim, omnibus},
};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/ros2_receiver.py");
const ROUNDS: usize = 3;
const TICKS: usize = 200;
/// One of few domains that are not used by hand.
const DOMAIN: &str = "97";
const SIZE: [u32; 2] = [800, 600];
const SENSORS: &str = "[[sensor]]\nname = \"front\"\nkind = \"camera\"\nposition_m = [1.5, 0, 2]\n";

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim = Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null"])?;
    let mut client = sim.client()?;
    client.synchronise(Duration::from_nanos(scene::DELTA_NANOS))?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    client.tick()?;
    let folder = Scratch::new()?;
    let sensors = folder.path().join("sensors.toml");
    std::fs::write(&sensors, SENSORS)?;
    let count = effort.count(TICKS);
    let (mut latencies, mut lost) = (Vec::new(), 0);
    let [mut alone, mut idle, mut busy] = [const { Vec::new() }; 3];
    for _ in 0..effort.rounds(ROUNDS) {
        alone.push(beside_own_camera(&mut client, car, count)?);
        let node = Node::start(&sim, car, &sensors)?;
        idle.push(paced(&mut client, count)?.iter().map(|tick| tick.nanos).collect());
        let receiver = Receiver::start()?;
        let ticks = paced(&mut client, count)?;
        let received = receiver.end()?;
        let arrivals = ticks.iter().map(|tick| (received.get(&tick.stamp_nanos), tick));
        let latency =
            |(arrived, tick): (Option<&u64>, &Tick)| Some(arrived? - tick.delivered_nanos);
        latencies.push(arrivals.filter_map(latency).collect());
        lost += ticks.iter().filter(|tick| !received.contains_key(&tick.stamp_nanos)).count();
        busy.push(ticks.iter().map(|tick| tick.nanos).collect());
        node.end()?;
    }
    let spread = Spread::of_rounds(&latencies, 1e3);
    let [width, height] = SIZE;
    let workload = format!(
        "a {width}x{height} image, from the renderer's last write to its arrival in Cyclone DDS over \
         UDP, 20 frames a second, null tracer; {lost} of {} did not arrive",
        effort.rounds(ROUNDS) * count
    );
    let unit = Unit::Micros;
    let figure =
        Figure { name: "ros2.image", workload, unit, value: spread.p50, spread, peer: None };
    sink.put(&figure, &machine)?;
    let alone = Spread::of_rounds(&alone, 1e3);
    for (name, ticks, with) in [
        ("ros2.tick_idle", idle, "no subscriber"),
        ("ros2.tick_subscribed", busy, "one of its images"),
    ] {
        let spread = Spread::of_rounds(&ticks, 1e3);
        let workload = format!(
            "a tick, 20 a second, beside the node with a camera of {width}x{height} pixels, null \
             tracer, and {with}"
        );
        let peer = Some(Peer { name: "the client's own camera, no node", value: alone.p50 });
        let figure = Figure { name, workload, unit, value: spread.p50, spread, peer };
        sink.put(&figure, &machine)?;
    }
    Ok(())
}

/// Measures ticks beside a camera of the client's own.
fn beside_own_camera(client: &mut Client, car: ActorId, count: usize) -> anyhow::Result<Vec<u64>> {
    let at = client_lib::Pose::level(Vec3::new(1.5, 0.0, 2.0), 0.0);
    let [width, height] = SIZE;
    let spec = camera("front", at, width, height, std::f32::consts::FRAC_PI_2, output::COLOR);
    let bundle = client.create_bundle("bench", car, [spec], 2)?;
    let ticks = paced(client, count)?;
    client.destroy_bundle(bundle)?;
    Ok(ticks.iter().map(|tick| tick.nanos).collect())
}

/// One tick, with the simulated time of its frame.
struct Tick {
    stamp_nanos: u64,
    /// How long it took.
    nanos: u64,
    /// When the renderer had sent the frame's measurement.
    delivered_nanos: u64,
}

/// Ticks 20 times a second.
fn paced(client: &mut Client, count: usize) -> anyhow::Result<Vec<Tick>> {
    // The sensors begin with the next frame.
    client.tick()?;
    let mut ticks = Vec::with_capacity(count);
    for _ in 0..count {
        let next = Instant::now() + Duration::from_nanos(scene::DELTA_NANOS);
        let begin = clock::now_nanos();
        let frame = client.tick()?;
        let nanos = clock::now_nanos() - begin;
        let delivered = client.stage_clock(frame).delivered_nanos;
        ticks.push(Tick {
            stamp_nanos: client.world().sim_time().as_nanos() as u64,
            nanos,
            delivered_nanos: delivered.context("the frame was not rendered")?,
        });
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    Ok(ticks)
}

/// A running `omnibus ros2`; dropped, it is killed.
struct Node(Child);

impl Node {
    fn start(sim: &Sim, car: ActorId, sensors: &Path) -> anyhow::Result<Node> {
        let mut child = Command::new(omnibus()?)
            .args(["ros2", "--name", sim.name(), "--actor", &car.0.to_string()])
            .args(["--domain", DOMAIN, "--sensors"])
            .arg(sensors)
            .stdout(Stdio::piped())
            .spawn()
            .context("omnibus ros2")?;
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().expect("it is piped")).read_line(&mut line)?;
        ensure!(line.contains("publishes"), "omnibus ros2 did not start");
        Ok(Node(child))
    }

    fn end(mut self) -> anyhow::Result<()> {
        let pid = Pid::from_raw(self.0.id() as i32).context("no process")?;
        kill_process(pid, Signal::INT)?;
        ensure!(self.0.wait()?.success(), "omnibus ros2 failed");
        Ok(())
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The subscriber in Python; dropped, it is killed.
struct Receiver {
    child: Child,
    stdin: Option<ChildStdin>,
    said: BufReader<ChildStdout>,
}

impl Receiver {
    fn start() -> anyhow::Result<Receiver> {
        let python =
            std::env::var_os("OMNIBUS_ROS2_PYTHON").unwrap_or_else(|| OsString::from("python3"));
        let mut child = Command::new(python)
            .args([SCRIPT, DOMAIN, "/carla/ego_vehicle/front/image"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .context("Python with cyclonedds; OMNIBUS_ROS2_PYTHON names one that has it")?;
        let stdin = child.stdin.take();
        let said = BufReader::new(child.stdout.take().expect("it is piped"));
        let mut receiver = Receiver { child, stdin, said };
        let line = receiver.line()?;
        ensure!(
            line == "matched\n",
            "the receiver says {line:?}; OMNIBUS_ROS2_PYTHON names a Python that has cyclonedds"
        );
        Ok(receiver)
    }

    fn line(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        self.said.read_line(&mut line)?;
        Ok(line)
    }

    /// Returns when each image arrived, by its stamp.
    fn end(mut self) -> anyhow::Result<BTreeMap<u64, u64>> {
        drop(self.stdin.take());
        let line = self.line()?;
        let pairs: Vec<(u64, u64)> = serde_json::from_str(&line).context("the receiver")?;
        Ok(pairs.into_iter().collect())
    }
}

impl Drop for Receiver {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
