//! Hidden parts of the town are neither seen nor hit, from one frame on.

use bus::Role;
use client_lib::{
    ActorId, Client, Frame, Measurement, Pose, SensorBundle, Spawn, Weather, wire::camera,
};
use glam::{Quat, Vec3, vec3};
use mesh::WordHash;
use protocol::{layer, output};
use rustix::process::Signal;

use crate::{
    kit::{Scratch, Sim, eventually, kill, lives, small_map},
    record::seen,
};

fn the_town() -> town::Town {
    let text = std::fs::read_to_string(small_map()).unwrap();
    town::furnish(&road::Network::parse(&text).unwrap(), 1)
}

/// A camera high above the whole town.
fn bundle(client: &mut Client) -> SensorBundle {
    let down = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let outputs = output::COLOR | output::TAG | output::INSTANCE;
    let sensors = [camera("above", Pose::new(Vec3::Z * 180.0, down), 320, 240, 1.4, outputs)];
    client.create_bundle("above", ActorId::NONE, sensors, 2).unwrap()
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> (Frame, Measurement) {
    let (frame, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    (frame, measured.pop().flatten().expect("a measurement of this frame"))
}

fn pixels(measured: &Measurement, number: u32) -> usize {
    let number = mesh::ObjectId::new(number).instance();
    measured.instances(0).unwrap().iter().filter(|id| **id == number).count()
}

fn tagged(measured: &Measurement, tag: mesh::Tag) -> usize {
    measured.tags(0).unwrap().iter().filter(|code| **code == tag as u8).count()
}

fn digest(measured: &Measurement) -> WordHash {
    let mut digest = WordHash::new();
    digest.bytes(bytemuck::cast_slice(measured.color(0).unwrap()));
    digest.bytes(bytemuck::cast_slice(measured.instances(0).unwrap()));
    digest
}

/// A house in good view of the camera: its object number, and the position of its collision box.
fn house(measured: &Measurement, town: &town::Town) -> (u32, Vec3) {
    let houses =
        town.objects.iter().zip(1..).filter(|(one, _)| one.layer == town::Layer::Buildings);
    let (_, number) = houses.max_by_key(|(_, number)| pixels(measured, *number)).unwrap();
    assert!(pixels(measured, number) > 50, "no house is well in sight");
    let solid = town.colliders.iter().find(|one| one.object == number - 1).unwrap();
    (number, vec3(solid.center.x, solid.center.y, solid.center.z))
}

#[test]
fn a_hidden_house_is_neither_seen_nor_hit() {
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    // Glass mirrors clouds, which move.
    client.set_weather(Weather { cloudiness: 0.0, ..Weather::default() }).unwrap();
    let mut bundle = bundle(&mut client);
    let (_, before) = look(&mut client, &mut bundle);
    let (number, within) = house(&before, &the_town());
    let whole = digest(&before);
    drop(before);

    let car_within = Spawn::new("vehicle.micro.microlino", Pose::level(within, 0.0));
    let refused = client.spawn(car_within).unwrap_err().to_string();
    assert!(refused.contains("building"), "{refused}");

    client.hide_objects(&[number], true).unwrap();
    let (_, hidden) = look(&mut client, &mut bundle);
    assert_eq!(pixels(&hidden, number), 0);
    assert!(tagged(&hidden, mesh::Tag::Building) > 500, "the others are there");
    drop(hidden);
    let stranger = client.spawn(car_within).expect("nothing is in the way");
    client.destroy(stranger).unwrap();

    client.hide_objects(&[mesh::ObjectId::new(number).instance()], false).unwrap();
    let (_, after) = look(&mut client, &mut bundle);
    assert_eq!(digest(&after), whole, "shown again, it looks as it did");
    drop(after);
    assert!(client.spawn(car_within).is_err());

    let unknown = client.hide_objects(&[1_000_000], true).unwrap_err().to_string();
    assert!(unknown.contains("1000000"), "{unknown}");
    let ground =
        client.hide_objects(&[mesh::ObjectId::GROUND.instance()], true).unwrap_err().to_string();
    assert!(ground.contains("ground"), "{ground}");
    drop((bundle, client));
    sim.end();
}

#[test]
fn layers_are_hidden_and_shown_and_a_late_client_sees_the_same() {
    let sim = Sim::start(&["--hide", "foliage,walls"]);
    let mut client = sim.ticker();
    let mut bundle = bundle(&mut client);
    let (_, bare) = look(&mut client, &mut bundle);
    assert_eq!(tagged(&bare, mesh::Tag::Vegetation), 0);
    assert!(tagged(&bare, mesh::Tag::Building) > 500);
    drop(bare);
    client.hide_layers(client_lib::Layers::from_bits_retain(layer::FOLIAGE), false).unwrap();
    client.hide_layers(client_lib::Layers::from_bits_retain(layer::BUILDINGS), true).unwrap();
    let (_, green) = look(&mut client, &mut bundle);
    assert!(tagged(&green, mesh::Tag::Vegetation) > 50);
    assert_eq!(tagged(&green, mesh::Tag::Building), 0);
    let green = digest(&green);

    // The restarted renderer reads it from the standing state.
    let renderer = sim.pid(Role::Render).unwrap();
    kill(renderer, Signal::KILL);
    eventually("its end", || !lives(renderer));
    let (_, again) = look(&mut client, &mut bundle);
    assert_eq!(digest(&again), green);
    drop((again, bundle, client));
    sim.end();
}

#[test]
fn hidden_parts_are_part_of_the_state() {
    let scratch = Scratch::new();
    let path = scratch.path().join("state");
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let mut bundle = bundle(&mut client);
    client
        .hide_layers(client_lib::Layers::from_bits_retain(layer::BUILDINGS | layer::PROPS), true)
        .unwrap();
    client.hide_objects(&[1, 2, 3, 700], true).unwrap();
    let off = digest(&look(&mut client, &mut bundle).1);
    client.save_state_to(&path).unwrap();
    client.tick().unwrap();
    let future = seen(&client);
    client.hide_layers(client_lib::Layers::from_bits_retain(layer::ALL), false).unwrap();
    assert_ne!(digest(&look(&mut client, &mut bundle).1), off);
    client.load_state_from(&path).unwrap();
    client.tick().unwrap();
    assert!(seen(&client) == future, "the state hash holds what is off");
    assert_eq!(digest(&look(&mut client, &mut bundle).1), off);
    drop((bundle, client));
    sim.end();
}

#[test]
fn the_layers_of_the_bus_are_those_of_towns() {
    let bits = [
        layer::BUILDINGS,
        layer::FOLIAGE,
        layer::PARKED_VEHICLES,
        layer::PROPS,
        layer::STREET_LIGHTS,
        layer::WALLS,
    ];
    assert_eq!(town::Layer::ALL.map(town::Layer::bit), bits);
    assert_eq!(bits.iter().sum::<u32>(), layer::ALL);
}
