//! Worlds are created and destroyed, and one world is ticked, for a long time; memory does not grow.

use bus::Role;
use client_lib::{
    Client, Pose, SensorBundle, Spawn,
    wire::{camera, output},
};
use glam::vec3;

use crate::kit::{Sim, is_soak, resident_bytes};

/// Worlds, and ticks per world.
fn counts() -> (usize, usize) {
    if is_soak() { (10_000, 100) } else { (1000, 50) }
}

/// The number of samples.
const SAMPLES: usize = 40;
/// Samples before this one are not judged, because caches fill.
const SETTLED: usize = 8;
/// Allowed growth over the maximum of the first half, in bytes and as a fraction.
const SLACK_BYTES: u64 = 2 << 20;
const SLACK: f64 = 0.03;

/// Resource use at one time, in bytes except for the number of files.
#[derive(Clone, Copy, Debug)]
struct Held {
    /// Of the host, traffic, the renderer, and this client.
    resident: [u64; 4],
    shared: u64,
    files: u64,
}

/// The columns of the printed samples.
const HEADING: &str = "resets ticks sim-host traffic sensor-render client /dev/shm (kB) files";

const NAMES: [&str; 6] = ["sim-host", "traffic", "sensor-render", "client", "/dev/shm", "files"];

impl Held {
    /// Returns what a simulator holds now, and prints it.
    fn of(sim: &Sim, resets: usize, ticks: usize) -> Held {
        let shared = sim.shared_memory();
        let stage = |role| sim.pid(role).unwrap_or_else(|| panic!("no {role:?}"));
        let pids = [sim.host_pid(), stage(Role::Traffic), stage(Role::Render), std::process::id()];
        let held = Held {
            resident: pids.map(resident_bytes),
            shared: shared.iter().map(|(_, len)| len).sum(),
            files: shared.len() as u64,
        };
        let [memory @ .., files] = held.values();
        let memory = memory.map(|bytes| (bytes / 1024).to_string()).join(" ");
        println!("{resets} {ticks} {memory} {files}");
        held
    }

    fn values(&self) -> [u64; 6] {
        let [host, traffic, render, client] = self.resident;
        [host, traffic, render, client, self.shared, self.files]
    }
}

/// Five cars in traffic, one with a small camera.
fn furnish(client: &mut Client) -> SensorBundle {
    let places = client.spawn_points().unwrap();
    let spread = places.len() / 5;
    let cars: Vec<_> = places
        .iter()
        .step_by(spread)
        .take(5)
        .map(|place| client.spawn(Spawn::new("vehicle.tesla.model3", *place).autopilot()).unwrap())
        .collect();
    let eye = camera("eye", Pose::level(vec3(0.5, 0.0, 1.6), 0.0), 16, 16, 1.5, output::DEPTH);
    client.create_bundle("eye", cars[0], [eye], 2).unwrap()
}

#[test]
fn many_worlds_and_ticks_need_no_more_memory() {
    let (resets, ticks) = counts();
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    let mut samples = Vec::new();
    println!("{HEADING}");
    for reset in 0..resets {
        if reset % (resets / SAMPLES) == 0 {
            samples.push(Held::of(&sim, reset, reset * ticks));
        }
        client.reload_map().unwrap();
        let mut bundle = furnish(&mut client);
        for _ in 0..ticks {
            client.tick().unwrap();
        }
        assert!(bundle.latest().unwrap().is_some(), "world {reset} was not seen");
    }
    expect_no_growth(&samples);
    drop(client);
    sim.end();
}

#[test]
fn many_ticks_of_one_world_need_no_more_memory() {
    let ticks = if is_soak() { 10_000_000 } else { 20_000 };
    let sim = Sim::start(&["--seed", "3", "--wait", "latency"]);
    let mut client = sim.ticker();
    let bundle = furnish(&mut client);
    // The world is what is tested, not the tracer.
    client.destroy_bundle(bundle).unwrap();
    let mut samples = Vec::new();
    println!("{HEADING}");
    for tick in 0..ticks {
        if tick % (ticks / SAMPLES) == 0 {
            samples.push(Held::of(&sim, 0, tick));
        }
        client.tick().unwrap();
    }
    expect_no_growth(&samples);
    drop(client);
    sim.end();
}

/// Asserts that the later samples hold no more than the earlier ones.
fn expect_no_growth(samples: &[Held]) {
    let (early, late) = samples[SETTLED..].split_at((SAMPLES - SETTLED) / 2);
    for (index, name) in NAMES.into_iter().enumerate() {
        // Other tests run in this process, except in the soak.
        if name == "client" && !is_soak() {
            continue;
        }
        let most = |of: &[Held]| of.iter().map(|held| held.values()[index]).max().unwrap();
        let (early, late) = (most(early), most(late));
        let slack = if name == "files" { 0 } else { SLACK_BYTES };
        let limit = early + ((early as f64 * SLACK) as u64).max(slack);
        assert!(late <= limit, "{name} grows: {early}, later {late}");
    }
}
