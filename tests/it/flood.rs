//! Floods of commands: no stage misses one, and none stops.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use bus::Role;
use client_lib::{
    Client, Command, Pose, Spawn, TrafficParam, Weather,
    wire::{Settings, camera, output},
};
use glam::{Quat, Vec3};
use protocol::ActorId;
use rustix::process::Signal;

use crate::kit::{DELTA_NANOS, Sim, is_soak, kill, run_asynchronously, thread};

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
    let sim = Sim::start(&[]);
    let mut client = sim.client("driver");
    let places = client.spawn_points().unwrap();
    let car = client.spawn(Spawn::new("vehicle.tesla.model3", places[0]).autopilot()).unwrap();
    // As fast as it can: during one stop there are more frames with commands than the journal holds.
    let settings = Settings { synchronous: 0, real_time_permille: 0, ..client.wire_settings() };
    client.apply_wire_settings(settings).unwrap();
    let is_over = Arc::new(AtomicBool::new(false));
    let flood = {
        let (mut client, is_over) = (sim.client("flood"), Arc::clone(&is_over));
        thread(move || {
            let mut count = 0;
            while !is_over.load(Ordering::Relaxed) {
                count += 1;
                let wetness = (count % 100) as f32;
                let weather = Weather { wetness, ..Weather::default() };
                client.request("flood", &[Command::set_weather(weather)]).unwrap();
                std::thread::sleep(Duration::from_micros(100));
            }
            count
        })
    };
    let rounds = if is_soak() { 1000 } else { 40 };
    let mut bundle = None;
    for round in 0..rounds {
        let pids = STAGES.map(|role| sim.pid(role).unwrap());
        pids.iter().for_each(|pid| kill(*pid, Signal::STOP));
        if round == rounds / 2 {
            // Traffic and the renderer learn these from the journal alone.
            let stop = TrafficParam::SpeedMps(0.0);
            client.request("stop", &[Command::set_traffic_param(car, stop)]).unwrap();
            let roof = Pose::new(Vec3::Z * 2.5, Quat::IDENTITY);
            let eye = camera("eye", roof, 16, 16, 1.5, output::DEPTH);
            bundle = Some(client.create_bundle("eye", car, [eye], 2).unwrap());
        }
        std::thread::sleep(Duration::from_millis(60 + round % 10));
        pids.iter().for_each(|pid| kill(*pid, Signal::CONT));
        std::thread::sleep(Duration::from_micros(500 * (round % 20)));
    }
    is_over.store(true, Ordering::Relaxed);
    let count: u64 = flood.join().unwrap();
    println!("{count} commands, stages stopped {rounds} times");
    assert!(count > 64 * 10, "the flood had no force: {count} commands");
    tick_with_both_stages(&sim, &mut client);
    let mut bundle = bundle.unwrap();
    let (_, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
    assert!(measured[0].is_some(), "the renderer does not know the bundle");
    for _ in 0..100 {
        client.tick().unwrap();
    }
    let speed = client.world().state(car).unwrap().velocity_mps;
    assert!(Vec3::from(speed).length() < 0.5, "traffic was not told to stop the car: {speed:?}");
    drop((client, bundle));
    let log = sim.end();
    assert!(!log.contains("died"), "{log}");
}

#[test]
fn batches_of_any_length_are_carried_out_and_answered() {
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
