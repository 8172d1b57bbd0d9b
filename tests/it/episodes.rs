//! Another map in a running simulator: the old world is removed, the new one is that of a fresh
//! start.

use std::{fs, path::Path, sync::atomic::AtomicBool, sync::atomic::Ordering};

use bus::Role;
use client_lib::{
    Client, ClientError, Pose, Profile, SensorBundle, Spawn, Weather,
    wire::{camera, kind, layer},
};
use glam::{Quat, Vec3};
use mesh::WordHash;
use protocol::{ActorId, output};
use rustix::process::Signal;

use crate::{
    kit::{DELTA_NANOS, Scratch, Sim, eventually, is_soak, kill, small_map, thread},
    record::{Bustle, Seen, seen},
};

/// Another small town.
fn other_map(folder: &Path) -> String {
    let plan = mapgen::Plan {
        name: "Thorp".to_owned(),
        seed: 9,
        size_m: 200.0,
        character: mapgen::Character::Grid,
        relief_m: 1.0,
    };
    let path = folder.join("thorp.xodr");
    fs::write(&path, mapgen::generate(&plan)).unwrap();
    path.to_str().unwrap().to_owned()
}

fn bundle(client: &mut Client) -> SensorBundle {
    let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let outputs = output::COLOR | output::INSTANCE;
    let sensors = [camera("above", Pose::new(Vec3::Z * 120.0, down), 96, 96, 1.4, outputs)];
    client.create_bundle("above", ActorId::NONE, sensors, 2).unwrap()
}

/// Runs busy traffic from now on and returns states and images of every frame.
fn live(client: &mut Client, frames: usize) -> Vec<(Seen, WordHash)> {
    let mut bustle = Bustle::new(client);
    let mut bundle = bundle(client);
    (0..frames)
        .map(|_| {
            bustle.act(client);
            let (frame, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
            let measured = measured[0].as_ref().unwrap_or_else(|| panic!("{frame} has no picture"));
            let mut digest = WordHash::new();
            digest.bytes(measured.data(0, output::COLOR).unwrap());
            digest.bytes(measured.data(0, output::INSTANCE).unwrap());
            (seen(client), digest)
        })
        .collect()
}

fn check_same(a: &[(Seen, WordHash)], b: &[(Seen, WordHash)], what: &str) {
    let at = a.iter().zip(b).position(|(a, b)| a.0 != b.0);
    assert_eq!(at, None, "{what}: the first frame whose state differs");
    let at = a.iter().zip(b).position(|(a, b)| a.1 != b.1);
    assert_eq!(at, None, "{what}: the first frame whose picture differs");
    assert_eq!(a.len(), b.len(), "{what}");
}

/// Changes everything that a client can change.
fn stir(client: &mut Client) {
    live(client, 30);
    client.set_weather(Weather { wetness: 70.0, ..Weather::default() }).unwrap();
    client.hide_layers(client_lib::Layers::from_bits_retain(layer::BUILDINGS), true).unwrap();
    client.tick().unwrap();
}

#[test]
fn whether_weather_affects_grip_is_a_setting_that_another_map_keeps() {
    let sim = Sim::start(&["--map", small_map(), "--seed", "3"]);
    let mut client = sim.ticker();
    let mut reload = |felt: Option<bool>| {
        if let Some(on) = felt {
            client.set_weather_affects_grip(on).unwrap();
        }
        client.reload_map().unwrap();
        client.tick().unwrap();
        client.world().header().state_hash
    };
    let (dry, felt) = (reload(None), reload(Some(true)));
    assert_ne!(felt, dry, "the new world does not know that its weather is felt");
    assert_eq!(reload(None), felt, "and the one after it");
    assert_eq!(reload(Some(false)), dry);
    sim.end();
}

#[test]
fn a_loaded_world_is_the_one_that_a_simulator_starts_with() {
    let scratch = Scratch::new();
    let thorp = other_map(scratch.path());
    let frames = if is_soak() { 600 } else { 80 };
    let fresh = |map: &str| {
        let sim = Sim::start(&["--map", map, "--seed", "3"]);
        let lived = live(&mut sim.ticker(), frames);
        sim.end();
        lived
    };
    let (in_hamlet, in_thorp) = (fresh(small_map()), fresh(&thorp));
    let sim = Sim::start(&["--seed", "3"]);
    let mut client = sim.ticker();
    stir(&mut client);
    let before = client.frame();
    let first = client.load_map(&thorp).unwrap();
    assert!(first > before, "{first} after {before}");
    let header = *client.world().header();
    assert_eq!((header.stamp.episode, header.stamp.sim_time_nanos), (2, 0));
    let is_of_the_map = |a: &client_lib::wire::ActorState| a.kind == kind::TRAFFIC_LIGHT;
    assert!(client.world().states().iter().all(is_of_the_map), "an actor of the old world is left");
    check_same(&live(&mut client, frames), &in_thorp, "another map");
    stir(&mut client);
    client.reload_map().unwrap();
    check_same(&live(&mut client, frames), &in_thorp, "the same map");
    client.load_map(small_map()).unwrap();
    check_same(&live(&mut client, frames), &in_hamlet, "the first map");
    assert_eq!(client.episode(), 4);
    drop(client);
    sim.end();
}

#[test]
fn a_map_that_cannot_be_loaded_leaves_the_world_as_it_is() {
    let scratch = Scratch::new();
    let bad = scratch.path().join("bad.xodr");
    let text = fs::read_to_string(small_map()).unwrap();
    fs::write(&bad, &text[..text.len() / 2]).unwrap();
    let undisturbed = {
        let sim = Sim::start(&[]);
        live(&mut sim.ticker(), 40)
    };
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    for (map, told) in [
        ("Atlantis", "no map is named"),
        (bad.to_str().unwrap(), "bad.xodr: line"),
        ("/nowhere/at/all.xodr", "/nowhere/at/all.xodr"),
    ] {
        let said = client.load_map(map).unwrap_err().to_string();
        assert!(said.contains(told), "{said}");
    }
    assert_eq!((client.episode(), client.frame().0), (1, 0));
    check_same(&live(&mut client, 40), &undisturbed, "after three refusals");
}

#[test]
fn a_bundle_reports_that_its_world_is_gone_and_a_recording_ends_with_it() {
    let scratch = Scratch::new();
    let thorp = other_map(scratch.path());
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut old = bundle(&mut client);
    let path = scratch.path().join("old.mcap");
    client.start_recorder(path.to_str().unwrap(), Profile::Inputs).unwrap();
    for _ in 0..5 {
        client.tick().unwrap();
    }
    client.load_map(&thorp).unwrap();
    let gone = |e: ClientError| matches!(e, ClientError::WorldGone { standing: 2, .. });
    assert!(gone(client.tick_and_collect(&mut [&mut old]).err().unwrap()));
    while let Ok(Some(_)) = old.receive() {}
    assert!(gone(client.await_measurement(&mut old).err().unwrap()));
    let mut new = bundle(&mut client);
    let (_, measured) = client.tick_and_collect(&mut [&mut new]).unwrap();
    assert!(measured[0].is_some());
    let mut recording = ::record::Recording::open(&path).unwrap();
    assert!(recording.info().is_complete);
    let again = omnibus::resimulate(&mut recording, 0, u64::MAX).unwrap();
    assert_eq!((again.frames, again.difference), (5, None));
    assert_eq!(client.stop_recorder().unwrap(), 0, "none goes on");
    drop(client);
    sim.end();
}

#[test]
fn a_client_that_ticks_without_pause_sees_worlds_change_and_never_hangs() {
    let scratch = Scratch::new();
    let maps = [other_map(scratch.path()), small_map().to_owned()];
    let sim = Sim::start(&["--pipeline", "2"]);
    let mut ticker = sim.ticker();
    let stop = std::sync::Arc::new(AtomicBool::new(false));
    let told = std::sync::Arc::clone(&stop);
    let ticking = thread(move || {
        let (mut last, mut worlds) = (ticker.frame(), vec![1]);
        while !told.load(Ordering::Acquire) {
            ticker.tick().unwrap();
            assert!(ticker.frame() > last);
            last = ticker.frame();
            let episode = ticker.world().header().stamp.episode;
            if worlds.last() != Some(&episode) {
                worlds.push(episode);
            }
        }
        worlds
    });
    let mut loader = sim.client("loader");
    let loads = if is_soak() { 200 } else { 8 };
    for load in 0..loads {
        match load % 4 {
            3 => loader.reload_map().unwrap(),
            n => loader.load_map(&maps[n % 2]).unwrap(),
        };
    }
    stop.store(true, Ordering::Release);
    let worlds = ticking.join().unwrap();
    assert!(worlds.is_sorted(), "{worlds:?}");
    assert_eq!(loader.episode() as usize, loads + 1);
    drop(loader);
    sim.end();
}

#[test]
fn a_stage_that_is_killed_while_worlds_change_restarts_in_the_right_one() {
    let scratch = Scratch::new();
    let thorp = other_map(scratch.path());
    let frames = 40;
    let wanted = {
        let sim = Sim::start(&["--map", &thorp]);
        live(&mut sim.ticker(), frames)
    };
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let rounds = if is_soak() { 40 } else { 6 };
    for round in 0..rounds {
        let role = [Role::Traffic, Role::Render][round % 2];
        eventually("the stage is there", || sim.pid(role).is_some());
        let pid = sim.pid(role).unwrap();
        let wait = std::time::Duration::from_millis(round as u64 * 13 % 120);
        let killer = thread(move || {
            std::thread::sleep(wait);
            kill(pid, Signal::KILL);
        });
        client.load_map(&thorp).unwrap();
        killer.join().unwrap();
        check_same(&live(&mut client, frames), &wanted, &format!("{} after {wait:?}", role.name()));
        client.load_map(small_map()).unwrap();
    }
    drop(client);
    sim.end();
}

#[test]
fn a_bundle_destroyed_before_its_first_frame_disturbs_no_other() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    for _ in 0..3 {
        let brief = bundle(&mut client);
        client.destroy_bundle(brief).unwrap();
        client.tick().unwrap();
    }
    let mut bundle = bundle(&mut client);
    let (_, measured) = client.tick_and_collect(&mut [&mut bundle]).unwrap();
    assert!(measured[0].is_some());
    drop(client);
    assert!(!sim.end().contains("died"));
}

#[test]
fn a_world_that_runs_by_itself_can_be_changed_too() {
    let scratch = Scratch::new();
    let thorp = other_map(scratch.path());
    let sim = Sim::start(&[]);
    let mut client = sim.client("watcher");
    let settings = client_lib::wire::Settings {
        synchronous: 0,
        delta_nanos: DELTA_NANOS,
        ..client.wire_settings()
    };
    client.apply_wire_settings(settings).unwrap();
    let place = client.spawn_points().unwrap()[0];
    client.spawn(Spawn::new("vehicle.tesla.model3", place)).unwrap();
    client.await_frame().unwrap();
    let before = client.frame();
    client.load_map(&thorp).unwrap();
    assert!(client.frame() > before);
    assert_eq!(client.wire_settings(), settings, "time passes as before");
    let loaded = client.frame();
    eventually("frames go on", || client.await_frame().unwrap().0 > loaded.0 + 5);
    assert!(client.world().states().iter().all(|a| a.kind == kind::TRAFFIC_LIGHT));
    assert!(client.available_maps().unwrap().iter().any(|name| name == "Town03"));
    drop(client);
    sim.end();
}
