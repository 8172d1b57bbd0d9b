//! The client library: what it loses, how long it waits, and what it leaves behind.

use std::{sync::Arc, time::Duration};

use client_lib::{
    Client, ClientError, Deadlines, Pose, SensorBundle,
    wire::{Settings, camera},
};
use glam::{Quat, Vec3};
use protocol::{ActorId, output};
use rustix::process::Signal;

use crate::kit::{Sim, eventually, kill};

fn lookout(client: &mut Client) -> SensorBundle {
    let at = Pose::new(Vec3::Z * 60.0, Quat::IDENTITY);
    let spec = camera("c", at, 64, 48, 1.5, output::DEPTH);
    client.create_bundle("lookout", ActorId::NONE, [spec], 4).unwrap()
}

#[test]
fn measurements_of_other_frames_are_counted_as_missed() {
    // A renderer that trails by up to two frames: a tick finds measurements of earlier frames.
    let sim = Sim::start_with(&[], &[("OMNIBUS_DELAY", "sensor-render:8000")]);
    let mut client = sim.ticker();
    client.apply_wire_settings(Settings { pipeline: 2, ..client.wire_settings() }).unwrap();
    let mut bundle = lookout(&mut client);
    let mut received = 0;
    for _ in 0..30 {
        let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
        if let Some(measurement) = &measured[0] {
            assert_eq!(measurement.frame(), frame);
            received += 1;
        }
    }
    while bundle.last() < client.frame() {
        client.await_measurement(&mut bundle).unwrap();
        received += 1;
    }
    assert_eq!(received + bundle.missed(), 30, "every frame was received or counted");
    assert!(bundle.missed() > 0, "nothing was pipelined");
    drop((client, bundle));
    sim.end();
}

#[test]
fn a_timeout_reports_the_deadline_that_passed() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let short = Duration::from_millis(300);
    let deadlines = Deadlines::default().with_answer(short).with_world(short * 2);
    client.set_deadlines(deadlines.with_frame(Some(short)));
    kill(sim.host_pid(), Signal::STOP);
    let waited = |e: ClientError| match e {
        ClientError::Timeout { waited, .. } => waited,
        other => panic!("{other}"),
    };
    assert_eq!(waited(client.destroy(ActorId(7)).unwrap_err()), short);
    let late = client.reload_map().unwrap_err();
    assert!(late.to_string().contains("within 0.6 s"), "{late}");
    assert_eq!(waited(late), short * 2);
    assert_eq!(waited(client.tick().unwrap_err()), short);
    kill(sim.host_pid(), Signal::CONT);
    drop(client);
    sim.end();
}

#[test]
fn a_dropped_bundle_is_destroyed_while_its_client_goes_on() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    client.tick().unwrap();
    let before = sim.shared_memory().len();
    let mut bundle = lookout(&mut client);
    assert!(client.tick_and_collect(&mut [&mut bundle]).unwrap().1[0].is_some());
    assert!(sim.shared_memory().len() > before);
    drop(bundle);
    eventually("the bundle's channel is removed", || {
        client.tick().unwrap();
        sim.shared_memory().len() <= before
    });
    drop(client);
    sim.end();
}

#[test]
fn the_map_is_parsed_once_for_each_world() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let first = client.map().unwrap();
    assert!(Arc::ptr_eq(&first, &client.map().unwrap()));
    client.reload_map().unwrap();
    let second = client.map().unwrap();
    assert!(!Arc::ptr_eq(&first, &second));
    assert_eq!(first.spawn_points().len(), second.spawn_points().len());
    drop(client);
    sim.end();
}

fn is_send<T: Send>() {}
fn is_sync<T: Sync>() {}

#[test]
fn halves_bundles_and_measurements_can_go_to_other_threads() {
    is_send::<Client>();
    is_send::<client_lib::Observer>();
    is_send::<client_lib::Controller>();
    is_send::<SensorBundle>();
    is_send::<client_lib::Measurement>();
    is_send::<client_lib::World>();
    is_sync::<client_lib::World>();
    is_sync::<client_lib::Measurement>();
    is_send::<client_lib::Ticket>();
    is_send::<ClientError>();
    is_sync::<ClientError>();
}
