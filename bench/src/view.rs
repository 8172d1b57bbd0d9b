//! `view`: the tick beside the viewer, with a page that reads its images and with one that does not.

use std::{
    io::{BufRead, BufReader},
    net::TcpStream,
    process::{Child, Command, Stdio},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use anyhow::{Context, ensure};
use client_lib::{
    ActorId, Client, Pose, Spawn, clock,
    wire::{camera, output},
};
use glam::Vec3;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::{
    Effort,
    figure::{Figure, Peer, Sink, Spread, Unit},
    machine::Machine,
    scene,
    sim::{Sim, omnibus},
};

const ROUNDS: usize = 5;
const TICKS: usize = 300;
const SIZE: [u32; 2] = [640, 360];
/// Time between two ticks: 30 a second.
const PERIOD: Duration = Duration::from_nanos(1_000_000_000 / 30);
/// After this time without an acknowledgement, the viewer takes a page for stalled.
const STALLED: Duration = Duration::from_millis(2500);

/// Measures the figures.
pub(crate) fn measure(effort: Effort, sink: &mut Sink) -> anyhow::Result<()> {
    let machine = Machine::look();
    let map = scene::one_road()?;
    let sim = Sim::start(&["--synchronous", "--map", &map.arg, "--device", "null"])?;
    let mut client = sim.client()?;
    client.synchronise(PERIOD)?;
    let place = client.spawn_points()?[0];
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", place))?;
    client.tick()?;
    let count = effort.count(TICKS);
    let [mut own, mut page, mut none, mut stalled] = [const { Vec::new() }; 4];
    let mut images = 0;
    for _ in 0..effort.rounds(ROUNDS) {
        none.push(paced(&mut client, count)?);
        own.push(beside_own_camera(&mut client, car, count)?);
        let viewer = Viewer::start(&sim)?;
        let reader = Reader::start(viewer.page(&mut client, car)?)?;
        page.push(paced(&mut client, count)?);
        images += reader.end(&mut client)?;
        let socket = viewer.page(&mut client, car)?;
        let begin = Instant::now();
        while begin.elapsed() < STALLED {
            paced(&mut client, 1)?;
        }
        stalled.push(paced(&mut client, count)?);
        drop(socket);
        viewer.end()?;
    }
    ensure!(images > 0, "the page received no image");
    let [own, page, none, stalled] =
        [own, page, none, stalled].map(|rounds| Spread::of_rounds(&rounds, 1e3));
    let [width, height] = SIZE;
    let ticks = effort.rounds(ROUNDS) * count;
    for (name, spread, with, peer) in [
        (
            "view.tick_page",
            page,
            format!("that shows {width}x{height} pixels of it: {images} images of {ticks} frames"),
            Peer { name: "the client's own camera, no page", value: own.p50 },
        ),
        (
            "view.tick_stalled",
            stalled,
            "that reads nothing".to_owned(),
            Peer { name: "no camera, no page", value: none.p50 },
        ),
    ] {
        let workload =
            format!("a tick, 30 a second, null tracer, beside a page of the viewer {with}");
        let (unit, value, peer) = (Unit::Micros, spread.p50, Some(peer));
        sink.put(&Figure { name, workload, unit, value, spread, peer }, &machine)?;
    }
    Ok(())
}

/// Ticks 30 times a second and returns how long each tick took.
fn paced(client: &mut Client, count: usize) -> anyhow::Result<Vec<u64>> {
    let mut ticks = Vec::with_capacity(count);
    for _ in 0..count {
        let next = Instant::now() + PERIOD;
        let begin = clock::now_nanos();
        client.tick()?;
        ticks.push(clock::now_nanos() - begin);
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    Ok(ticks)
}

/// Measures ticks beside a camera of the client's own.
fn beside_own_camera(client: &mut Client, car: ActorId, count: usize) -> anyhow::Result<Vec<u64>> {
    let at = Pose::level(Vec3::new(1.5, 0.0, 2.0), 0.0);
    let spec = camera("front", at, SIZE[0], SIZE[1], std::f32::consts::FRAC_PI_2, output::COLOR);
    let bundle = client.create_bundle("bench", car, [spec], 2)?;
    let ticks = paced(client, count)?;
    client.destroy_bundle(bundle)?;
    Ok(ticks)
}

/// A running `omnibus view`; dropped, it is killed.
struct Viewer {
    child: Child,
    /// `127.0.0.1:PORT`.
    host: String,
}

impl Viewer {
    fn start(sim: &Sim) -> anyhow::Result<Viewer> {
        let mut child = Command::new(omnibus()?)
            .args(["view", "--name", sim.name(), "--port", "0", "--no-open"])
            .stdout(Stdio::piped())
            .spawn()
            .context("omnibus view")?;
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().expect("it is piped")).read_line(&mut line)?;
        let host = line.split("http://").nth(1).and_then(|rest| rest.split('/').next());
        let host = host.context("omnibus view did not start")?.to_owned();
        Ok(Viewer { child, host })
    }

    /// Opens a page with a camera, and ticks until its sensor exists.
    fn page(&self, client: &mut Client, car: ActorId) -> anyhow::Result<WebSocket<TcpStream>> {
        let stream = TcpStream::connect(&self.host)?;
        let (mut socket, _) = tungstenite::client(format!("ws://{}/socket", self.host), stream)
            .map_err(|e| anyhow::anyhow!("{e}"))?;
        let tile = json!({
            "output": "color", "on": car.0, "position_m": [1.5, 0.0, 2.0], "yaw_rad": 0.0,
            "pitch_rad": 0.0, "size": SIZE, "fov_rad": std::f32::consts::FRAC_PI_2
        });
        socket.send(Message::text(json!({"type": "tiles", "tiles": [tile]}).to_string()))?;
        // The world stands between two ticks, and commands are carried out at once.
        loop {
            let Message::Text(text) = socket.read()? else { continue };
            let text: Value = serde_json::from_str(&text)?;
            ensure!(text["type"] != "error", "{text}");
            if text["type"] == "done" {
                break;
            }
        }
        client.tick()?;
        Ok(socket)
    }

    fn end(mut self) -> anyhow::Result<()> {
        let pid = Pid::from_raw(self.child.id() as i32).context("no process")?;
        kill_process(pid, Signal::INT)?;
        ensure!(self.child.wait()?.success(), "omnibus view failed");
        Ok(())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page that reads and acknowledges, in a thread.
struct Reader {
    stream: TcpStream,
    thread: JoinHandle<usize>,
}

impl Reader {
    fn start(mut socket: WebSocket<TcpStream>) -> anyhow::Result<Reader> {
        let stream = socket.get_ref().try_clone()?;
        let read = move || {
            let mut images = 0;
            while let Ok(message) = socket.read() {
                let channel = match message {
                    Message::Text(text) if text.contains("\"type\":\"state\"") => 255,
                    Message::Binary(bytes) if bytes[0] == 1 => {
                        images += 1;
                        0
                    }
                    _ => continue,
                };
                let ack = json!({"type": "ack", "channel": channel}).to_string();
                if socket.send(Message::text(ack)).is_err() {
                    break;
                }
            }
            images
        };
        let thread = std::thread::Builder::new().name("bench-page".to_owned()).spawn(read)?;
        Ok(Reader { stream, thread })
    }

    /// Closes the page and returns the number of images that it received.
    fn end(self, client: &mut Client) -> anyhow::Result<usize> {
        self.stream.shutdown(std::net::Shutdown::Both)?;
        let images = self.thread.join().map_err(|_| anyhow::anyhow!("the page panicked"))?;
        // Its camera is destroyed with it.
        paced(client, 30)?;
        Ok(images)
    }
}
