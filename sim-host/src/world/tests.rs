use bus::{FeelWeather, Name, Pose, Settings, Spawn, VehicleControl, Weather, Wish, flag};
use glam::Vec3;

use super::World;
use crate::saved::SavedState;

/// A town of one floor, and nothing in it.
fn plain() -> World {
    let mut town = town::Town::default();
    let corner = |x: f32, y: f32| [x * 500.0, y * 500.0, 0.0];
    let face = road::Face::new(road::Tag::Roads, road::Material::Asphalt, 0);
    town.mesh
        .quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], face);
    World::new(&town, 1)
}

fn run(world: &mut World, frames: u32) {
    (0..frames).for_each(|_| world.step(&Settings::default()));
}

/// Metres from 20 m/s to rest.
fn stopping(world: &mut World) -> f32 {
    let name = Name::new("vehicle.tesla.model3");
    let spawn = Spawn { blueprint: name, pose: Pose::IDENTITY, ..Spawn::default() };
    let id = bus::ActorId(world.apply(&Wish::Spawn(spawn)).unwrap());
    run(world, 10);
    let velocity_mps = [20.0, 0.0, 0.0];
    world
        .apply(&Wish::SetVelocity(bus::SetVelocity {
            actor_id: id,
            velocity_mps,
            ..Default::default()
        }))
        .unwrap();
    let brake = VehicleControl { actor_id: id, brake: 1.0, ..VehicleControl::default() };
    world.apply(&Wish::Control(brake)).unwrap();
    let from = world.state(id).unwrap().pose.position();
    run(world, 200);
    let state = world.state(id).unwrap();
    assert!(state.velocity().length() < 0.01 && !state.has(flag::COLLIDING));
    let meters = (state.pose.position() - from).dot(Vec3::X);
    world.apply(&Wish::Destroy(id)).unwrap();
    meters
}

#[test]
fn wet_roads_are_slippery_only_where_the_weather_is_felt() {
    let mut world = plain();
    let dry = stopping(&mut world);
    let rain = Weather { wetness: 100.0, precipitation_deposits: 50.0, ..Weather::default() };
    world.apply(&Wish::SetWeather(rain)).unwrap();
    assert_eq!(stopping(&mut world), dry);
    world.apply(&Wish::FeelWeather(FeelWeather { on: 1, reserved: 0 })).unwrap();
    let wet = stopping(&mut world);
    println!("{dry} m dry, {wet} m wet");
    assert!((1.4..2.0).contains(&(wet / dry)), "{dry} m dry, {wet} m wet");

    let mut state = SavedState { weather: Some(rain), ..SavedState::default() };
    world.save_into(&mut state);
    let mut other = plain();
    other.restore(&state).unwrap();
    assert_eq!(stopping(&mut other), stopping(&mut world));

    world.apply(&Wish::SetWeather(Weather::default())).unwrap();
    assert!((stopping(&mut world) / dry - 1.0).abs() < 0.01);
}
