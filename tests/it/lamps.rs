//! Street lights: switched on automatically at dusk, and by commands at any time.

use bus::Role;
use client_lib::{
    ActorId, Client, Measurement, Pose, SensorBundle, StreetLightCommand, wire::camera,
};
use glam::{Quat, Vec3};
use protocol::{Weather, output};
use rustix::process::Signal;

use crate::kit::{Scratch, Sim, eventually, kill, lives, small_map};

/// The object number of a lamp's pole, and the position of its light.
fn lamp() -> (u32, Vec3) {
    let text = std::fs::read_to_string(small_map()).unwrap();
    let town = town::furnish(&road::Network::parse(&text).unwrap(), 1);
    let lamp = town.lamps[0];
    (lamp.object + 1, lamp.position)
}

/// A camera 2 m below the lamp, looking up.
fn bundle(client: &mut Client, lamp: Vec3) -> SensorBundle {
    let up = Quat::from_rotation_y(-std::f32::consts::FRAC_PI_2);
    let pose = Pose::new(lamp - Vec3::Z * 2.0, up);
    let sensors = [camera("up", pose, 64, 48, 1.2, output::COLOR | output::INSTANCE)];
    client.create_bundle("up", ActorId::NONE, sensors, 2).unwrap()
}

fn look(client: &mut Client, bundle: &mut SensorBundle) -> Measurement {
    let (_, mut measured) = client.tick_and_collect(&mut [bundle]).unwrap();
    measured.pop().flatten().expect("a measurement of this frame")
}

/// Returns the brightest and the reddest pixel of the lamp.
fn shines(measured: &Measurement, number: u32) -> (u8, u8) {
    let ids = measured.instances(0).unwrap().iter();
    let own = ids
        .zip(measured.color(0).unwrap())
        .filter(|(id, _)| **id == mesh::ObjectId::new(number).instance());
    own.fold((0, 0), |(light, red), (_, [r, g, b, _])| {
        (light.max(*r.min(g).min(b)), red.max(r.saturating_sub(*g)))
    })
}

#[test]
fn a_street_light_is_switched_by_commands_and_at_dusk() {
    let scratch = Scratch::new();
    let path = scratch.path().join("state");
    let sim = Sim::start(&[]);
    let mut client = sim.ticker();
    let (number, at) = lamp();
    let mut bundle = bundle(&mut client, at);
    let night = Weather { sun_altitude_rad: -0.5, ..Weather::default() };
    let (by_day, _) = shines(&look(&mut client, &mut bundle), number);
    client.set_weather(night).unwrap();
    let (by_night, _) = shines(&look(&mut client, &mut bundle), number);
    assert!(by_night > 200 && by_day < 190, "{by_day} {by_night}");

    client.switch_street_lights(&[number], StreetLightCommand::off()).unwrap();
    assert!(shines(&look(&mut client, &mut bundle), number).0 < 60);
    client
        .switch_street_lights(
            &[mesh::ObjectId::new(number).instance()],
            StreetLightCommand::on().color([255, 0, 0]),
        )
        .unwrap();
    let (_, red) = shines(&look(&mut client, &mut bundle), number);
    assert!(red > 150, "{red}");
    client.save_state_to(&path).unwrap();

    let renderer = sim.pid(Role::Render).unwrap();
    kill(renderer, Signal::KILL);
    eventually("its end", || !lives(renderer));
    assert_eq!(shines(&look(&mut client, &mut bundle), number).1, red, "its successor knows");
    client.set_weather(Weather::default()).unwrap();
    assert!(shines(&look(&mut client, &mut bundle), number).1 > 60, "on by day too");
    client.switch_street_lights(&[number], StreetLightCommand::at_night()).unwrap();
    assert_eq!(shines(&look(&mut client, &mut bundle), number).0, by_day);

    client.load_state_from(&path).unwrap();
    assert_eq!(shines(&look(&mut client, &mut bundle), number).1, red, "part of a saved state");

    for (numbers, shining, words) in [
        (vec![number, 0], StreetLightCommand::off(), "object 0 is not one of the town's"),
        (vec![4_000_000], StreetLightCommand::on(), "object 4000000 is not one of the town's"),
        (vec![number], StreetLightCommand::on().intensity(f32::NAN), "brightness is NaN"),
    ] {
        let why = client.switch_street_lights(&numbers, shining).unwrap_err().to_string();
        assert!(why.contains(words), "{why}");
    }
    drop((bundle, client));
    sim.end();
}
