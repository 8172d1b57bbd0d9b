//! Floods of commands: no stage misses one, and none stops.

use std::{
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use bus::Role;
use client_lib::{
    Client, Command, Pose, Spawn, TrafficParam, Weather,
    wire::{Settings, camera, output},
};
use glam::{Quat, Vec3};
use mesh::RandomStream;
use protocol::{ActorId, BATCH_MAX, SENSORS_MAX};
use rustix::process::Signal;

use crate::kit::{DELTA_NANOS, Sim, is_soak, kill, resident_bytes, run_asynchronously, thread};

/// Floods take the processor from each other.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Commands in frames of their own that fill the journal of stages.
const FULL: u64 = 64;

/// The most entries of a frame beside floods of eight clients: what it holds before commands wait, and
/// twice a batch of each client, which may be begun with room for one, and belong to the frame.
const FRAME_ENTRIES: u32 = 2048 + 2 * 8 * BATCH_MAX as u32;

const STAGES: [Role; 2] = [Role::Traffic, Role::Render];

/// Makes the world wait for ticks, and ticks until both stages have worked on new frames.
fn tick_with_both_stages(sim: &Sim, client: &mut Client) {
    client.synchronise(Duration::from_nanos(DELTA_NANOS)).unwrap();
    for _ in 0..20 {
        let frame = client.tick().unwrap();
        let control = sim.instance().control().unwrap();
        for role in STAGES {
            let slot = control.slots().iter().find(|slot| slot.role() == Some(role)).unwrap();
            assert_eq!(slot.ack(), frame, "{}", role.name());
        }
    }
}

#[test]
fn stages_that_stop_for_a_time_during_a_flood_receive_every_command() {
    let _alone = alone();
    let sim = Sim::start(&[]);
    let mut client = sim.client("driver");
    let places = client.spawn_points().unwrap();
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", places[0]).autopilot()).unwrap();
    // As fast as it can: during one stop there are more frames with commands than the journal holds.
    let settings = Settings { synchronous: 0, real_time_permille: 0, ..client.wire_settings() };
    client.apply_wire_settings(settings).unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let sent = Arc::new(AtomicU64::new(0));
    let flood = {
        let (mut client, is_over) = (sim.client("flood"), Arc::clone(&is_over));
        let sent = Arc::clone(&sent);
        thread(move || {
            while !is_over.load(Ordering::Relaxed) {
                let count = sent.fetch_add(1, Ordering::Relaxed);
                let wetness = (count % 100) as f32;
                let weather = Weather { wetness, ..Weather::default() };
                client.request("flood", &[Command::set_weather(weather)]).unwrap();
                std::thread::sleep(Duration::from_micros(100));
            }
        })
    };
    let rounds = if is_soak() { 1000 } else { 40 };
    let (mut bundle, mut most) = (None, 0);
    for round in 0..rounds {
        let pids = STAGES.map(|role| sim.pid(role).unwrap());
        pids.iter().for_each(|pid| kill(*pid, Signal::STOP));
        let before = sent.load(Ordering::Relaxed);
        if round == rounds / 2 {
            // Traffic and the renderer learn these from the journal alone.
            let stop = TrafficParam::SpeedMps(0.0);
            client.request("stop", &[Command::set_traffic_param(car, stop)]).unwrap();
            let roof = Pose::new(Vec3::Z * 2.5, Quat::IDENTITY);
            let eye = camera("eye", roof, 16, 16, 1.5, output::DEPTH);
            bundle = Some(client.create_bundle("eye", car, [eye], 2).unwrap());
        }
        // In some rounds until the journal is full, however slow the machine is.
        for _ in 0..if round % 8 == 0 { 60 } else { 1 } {
            std::thread::sleep(Duration::from_millis(50 + round % 10));
            let during = sent.load(Ordering::Relaxed) - before;
            most = most.max(during);
            if during > FULL {
                break;
            }
        }
        pids.iter().for_each(|pid| kill(*pid, Signal::CONT));
        std::thread::sleep(Duration::from_micros(500 * (round % 20)));
    }
    is_over.store(true, Ordering::Relaxed);
    flood.join().unwrap();
    println!("{sent:?} commands, stages stopped {rounds} times, {most} commands during one stop");
    assert!(most > FULL, "the journal was never full: {most} commands during one stop");
    tick_with_both_stages(&sim, &mut client);
    let mut bundle = bundle.unwrap();
    let (_, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
    assert!(measured[0].is_some(), "the renderer does not know the bundle");
    for _ in 0..100 {
        client.tick().unwrap();
    }
    // Wherever the car has come to without its driver, it stands and is not to go on.
    let state = client.world().state(car).unwrap();
    let speed = Vec3::from(state.velocity_mps).length();
    assert!(
        speed < 0.5 && state.throttle == 0.0,
        "traffic was not told to stop the car: {state:?}"
    );
    drop((client, bundle));
    let log = sim.end();
    assert!(!log.contains("died"), "{log}");
}

#[test]
fn batches_of_any_length_are_carried_out_and_answered() {
    let _alone = alone();
    let sim = Sim::start(&[]);
    let mut client = sim.client("driver");
    run_asynchronously(&mut client);
    let unknown: Vec<_> = (0..40_000).map(|i| Command::destroy(ActorId(1_000_000 + i))).collect();
    for _ in 0..5 {
        let outcomes = client.try_request("flood", &unknown).unwrap();
        assert_eq!(outcomes.len(), unknown.len());
        assert!(outcomes.iter().all(|outcome| outcome.id().is_err()));
    }
    tick_with_both_stages(&sim, &mut client);
    drop(client);
    sim.end();
}

#[test]
fn bundles_of_any_number_of_sensors_are_created_beside_a_flood() {
    let _alone = alone();
    let sim = Sim::start(&["--device", "null"]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let flood = {
        let (client, is_over) = (sim.client("flood"), Arc::clone(&is_over));
        thread(move || flood(client, 1, &is_over))
    };
    let mut owner = sim.client("owner");
    for count in [127, 128, 300, 1024, SENSORS_MAX] {
        let at = Pose::new(Vec3::Z * 30.0, Quat::IDENTITY);
        let eye = |i| camera(&format!("eye{i}"), at, 2, 2, 1.5, output::DEPTH);
        let eyes: Vec<_> = (0..count).map(eye).collect();
        let mut bundle = owner.create_bundle("many", ActorId::NONE, eyes, 2).unwrap();
        client.tick().unwrap();
        let measured = bundle.latest().unwrap().expect("a measurement");
        assert_eq!(measured.header().plane_count as usize, count);
        drop(measured);
        owner.destroy_bundle(bundle).unwrap();
    }
    is_over.store(true, Ordering::Relaxed);
    assert!(flood.join().unwrap() > 0);
    drop((client, owner));
    sim.end();
}

/// A client that sends what it can: settings, vehicles that come and go, bundles, commands that are
/// refused. Returns the number of commands.
fn flood(mut client: Client, index: u64, is_over: &AtomicBool) -> u64 {
    let mut random = RandomStream::from_state(index);
    let places = client.spawn_points().unwrap();
    let mut count = 0;
    while !is_over.load(Ordering::Relaxed) {
        let length = 1 + random.below(3000);
        let commands: Vec<_> = (0..length).map(|_| command(&mut random, &places)).collect();
        let outcomes = client.try_request("flood", &commands).unwrap();
        assert_eq!(outcomes.len(), commands.len());
        count += commands.len() as u64;
        if random.chance(0.1) {
            let name = format!("flood-{index}");
            let at = Pose::new(Vec3::Z * 30.0, Quat::IDENTITY);
            let eye = camera("eye", at, 16, 16, 1.5, output::DEPTH);
            let bundle = client.create_bundle(&name, ActorId::NONE, [eye], 2).unwrap();
            client.destroy_bundle(bundle).unwrap();
        }
    }
    count
}

fn command(random: &mut RandomStream, places: &[Pose]) -> Command {
    match random.below(100) {
        0..=2 => Spawn::new("vehicle.audi.tt", *random.choose(places)).autopilot().into(),
        3..=40 => Command::destroy(ActorId(1 + random.below(2000) as u32)),
        41..=60 => {
            Command::set_weather(Weather { wetness: random.unit() * 100.0, ..Weather::default() })
        }
        _ => Command::destroy(ActorId(1_000_000 + random.below(1000) as u32)),
    }
}

#[test]
fn a_world_with_eight_floods_goes_on_and_does_not_grow() {
    let _alone = alone();
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let floods: Vec<_> = (0..8)
        .map(|index| {
            let (client, is_over) = (sim.client("flood"), Arc::clone(&is_over));
            thread(move || flood(client, index, &is_over))
        })
        .collect();
    let ticks = if is_soak() { 20_000 } else { 200 };
    let (mut early, mut entries) = (None, Vec::new());
    let pids = || STAGES.map(|role| sim.pid(role).unwrap());
    let resident = || [sim.host_pid(), pids()[0], pids()[1]].map(resident_bytes);
    for tick in 0..ticks {
        let frame = client.tick().unwrap();
        assert_eq!(client.frame(), frame);
        entries.push(client.world().header().journal_entries);
        if tick == ticks / 4 {
            early = Some((pids(), resident()));
        }
    }
    let (early, late) = (early.unwrap(), (pids(), resident()));
    is_over.store(true, Ordering::Relaxed);
    let counts: Vec<u64> = floods.into_iter().map(|flood| flood.join().unwrap()).collect();
    entries.sort_unstable();
    let median = entries[entries.len() / 2];
    println!(
        "{counts:?} commands beside {ticks} ticks, {median} a frame (median); resident \
         {:?} -> {:?}",
        early.1, late.1
    );
    assert!(counts.iter().all(|count| *count > 0), "a flood was not served: {counts:?}");
    // Those after which the client was not scheduled for a tenth of a second may have more.
    let many = entries.iter().filter(|count| **count > FRAME_ENTRIES).count();
    assert!(many <= ticks / 20, "{many} of {ticks} frames have up to {:?} entries", entries.last());
    assert_eq!(early.0, late.0, "a stage was started again");
    for (early, late) in early.1.into_iter().zip(late.1) {
        assert!(late < early + (64 << 20), "memory grows: {early} -> {late}");
    }
    drop(client);
    let log = sim.end();
    assert!(!log.contains("died"), "{log}");
}
