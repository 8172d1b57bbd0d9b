//! Debug drawings: cameras show them in place for their lifetime, also after a stage died.

use bus::Role;
use client_lib::{ActorId, Client, Draw, Measurement, Pose, SensorBundle, wire::camera};
use glam::{Vec3, vec3};
use protocol::output;
use rustix::process::Signal;

use crate::kit::{Scratch, Sim, eventually, kill, lives};

const SIZE: [u32; 2] = [320, 240];
const FOV_RAD: f32 = 1.4;
/// High above the town, where only the tests' own shapes are in view.
const EYE: Vec3 = Vec3::new(10.0, 20.0, 300.0);
const RED: [u8; 4] = [255, 0, 0, 255];

fn bundle(client: &mut Client) -> SensorBundle {
    let outputs = output::COLOR | output::DEPTH | output::TAG;
    let sensors = [camera("level", Pose::level(EYE, 0.0), SIZE[0], SIZE[1], FOV_RAD, outputs)];
    client.create_bundle("level", ActorId::NONE, sensors, 4).unwrap()
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> Measurement {
    let (_, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    measured.pop().flatten().expect("a measurement of this frame")
}

/// Returns the columns and rows of all red pixels.
fn red(measured: &Measurement) -> Vec<[f32; 2]> {
    let color = measured.color(0).unwrap().iter().enumerate();
    let red = color.filter(|(_, pixel)| **pixel == RED);
    let width = SIZE[0] as usize;
    red.map(|(at, _)| [(at % width) as f32 + 0.5, (at / width) as f32 + 0.5]).collect()
}

/// By the formula in docs/sensors.md.
fn pinhole(at: Vec3) -> [f32; 2] {
    let focal = SIZE[0] as f32 / (2.0 * (FOV_RAD / 2.0).tan());
    let at = at - EYE;
    [SIZE[0] as f32 / 2.0 - focal * at.y / at.x, SIZE[1] as f32 / 2.0 - focal * at.z / at.x]
}

fn line() -> (Vec3, Vec3) {
    (EYE + vec3(30.0, 12.0, -6.0), EYE + vec3(30.0, -15.0, 9.0))
}

fn drawn() -> Draw {
    let (begin, end) = line();
    Draw::line(begin, end).color([255, 0, 0])
}

#[test]
fn a_line_is_drawn_by_the_pinhole_formula_until_it_expires() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = bundle(&mut client);
    let bare = look(&mut client, &mut bundle);
    assert!(red(&bare).is_empty());
    client.draw(&[drawn().secs(0.15)]).unwrap();
    for frame in 0..3 {
        let measured = look(&mut client, &mut bundle);
        let red = red(&measured);
        let (begin, end) = line();
        let [[u0, v0], [u1, v1]] = [pinhole(begin), pinhole(end)];
        assert!(red.len() as f32 >= u0.max(u1) - u0.min(u1), "frame {frame}: {}", red.len());
        for [u, v] in &red {
            let on_line = v0 + (v1 - v0) * (u - u0) / (u1 - u0);
            assert!((v - on_line).abs() < 1.2, "frame {frame}: {u}, {v} is not on the line");
        }
        assert!(measured.depth(0) == bare.depth(0), "colours alone show it");
        assert!(measured.tags(0) == bare.tags(0));
    }
    assert!(red(&look(&mut client, &mut bundle)).is_empty(), "0.15 s are three frames");
    client.draw(&[drawn().once()]).unwrap();
    assert!(!red(&look(&mut client, &mut bundle)).is_empty());
    assert!(red(&look(&mut client, &mut bundle)).is_empty());
    drop((bare, bundle, client));
    sim.end();
}

#[test]
fn a_restarted_renderer_draws_the_standing_shapes() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = bundle(&mut client);
    let label = Draw::text(EYE + vec3(20.0, 4.0, 5.0), "7 m").unwrap().color([255, 0, 0]);
    client.draw(&[drawn(), label, Draw::point(EYE + Vec3::X * 9.0).once()]).unwrap();
    let before = look(&mut client, &mut bundle);
    assert!(red(&before).len() > 60);
    let renderer = sim.pid(Role::Render).unwrap();
    kill(renderer, Signal::KILL);
    eventually("its end", || !lives(renderer));
    let after = look(&mut client, &mut bundle);
    assert_eq!(red(&after), red(&before));
    let count = red(&after).len();
    client.erase_texts().unwrap();
    let without = red(&look(&mut client, &mut bundle)).len();
    assert!(without > 30 && without < count, "{without} of {count}");
    client.erase().unwrap();
    assert!(red(&look(&mut client, &mut bundle)).is_empty());
    drop((before, after, bundle, client));
    sim.end();
}

#[test]
fn shapes_are_part_of_a_saved_state_and_of_no_other_world() {
    let scratch = Scratch::new();
    let path = scratch.path().join("state");
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut own = bundle(&mut client);
    client.draw(&[drawn(), drawn().secs(0.2)]).unwrap();
    let measured = look(&mut client, &mut own);
    let hash = measured.header().state_hash;
    client.save_state_to(&path).unwrap();
    client.erase().unwrap();
    client.draw(&[Draw::point(EYE + Vec3::X * 9.0).color([255, 0, 0]).thick_m(1.0)]).unwrap();
    let point = look(&mut client, &mut own);
    assert_ne!(red(&point), red(&measured));
    let future = point.header().state_hash;
    assert_ne!(hash, future, "time is part of it");
    client.load_state_from(&path).unwrap();
    let again = look(&mut client, &mut own);
    assert_eq!(red(&again), red(&measured));
    assert_eq!(again.header().state_hash, future, "what is drawn decides nothing");
    drop((measured, point, again, own));
    client.reload_map().unwrap();
    let mut own = bundle(&mut client);
    assert!(red(&look(&mut client, &mut own)).is_empty(), "it went with its world");
    drop((own, client));
    sim.end();
}

#[test]
fn an_invalid_shape_is_refused_by_name() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let nowhere = Draw::point(vec3(0.0, f32::NAN, 0.0));
    for (shape, words) in [
        (nowhere, "a shape's place is NaN"),
        (drawn().thick_m(f32::INFINITY), "thickness is inf"),
        (drawn().pixels(1e6), "1000000, not 0 to 256"),
    ] {
        let why = client.draw(&[shape]).unwrap_err().to_string();
        assert!(why.contains(words), "{why}");
    }
    let long = Draw::text(Vec3::ZERO, &"x".repeat(125)).unwrap_err().to_string();
    assert!(long.contains("125 bytes, not 0 to 124"), "{long}");
    let many = vec![drawn(); protocol::SHAPES_MAX];
    client.draw(&many).unwrap();
    let full = client.draw(&[drawn()]).unwrap_err().to_string();
    assert!(full.contains("SHAPES_MAX"), "{full}");
    client.erase().unwrap();
    client.draw(&[drawn()]).unwrap();
    drop(client);
    sim.end();
}
