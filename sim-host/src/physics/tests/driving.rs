use std::sync::Arc;

use glam::Vec3;
use protocol::{ActorId, flag};

use super::{Ground, Lone, incline};
use crate::physics::{Class, VehicleModel, WheelPlace};

/// Returns seconds and metres from rest to `mps` at full throttle.
fn accelerate(lone: &mut Lone, mps: f32) -> f32 {
    lone.control.throttle = 1.0;
    let from = lone.seconds;
    while lone.speed() < mps {
        lone.frame();
        assert!(lone.seconds - from < 120.0, "only {} m/s after 120 s", lone.speed());
    }
    lone.control.throttle = 0.0;
    lone.seconds - from
}

#[test]
fn a_sedan_reaches_100_kmh_in_6_to_12_s() {
    let mut lone = Lone::sedan();
    lone.run(1.0);
    let seconds = accelerate(&mut lone, 100.0 / 3.6);
    println!("0-100 km/h: {seconds:.2} s, in gear {}", lone.state().gear);
    assert!((6.0..12.0).contains(&seconds), "{seconds} s");
}

#[test]
fn a_sedan_stops_from_100_kmh_in_36_to_45_m() {
    let mut lone = Lone::sedan();
    lone.run(0.5);
    lone.physics.set_velocity(ActorId(1), Vec3::X * (100.0 / 3.6), Vec3::ZERO).unwrap();
    lone.run(0.5);
    let speed = lone.speed();
    let from = lone.position();
    lone.control.brake = 1.0;
    while lone.speed() > 0.05 {
        lone.frame();
        assert!(lone.seconds < 20.0);
    }
    // Scaled to exactly 100 km/h: the distance grows with the square of the speed.
    let meters = (lone.position() - from).length() * (27.78 / speed).powi(2);
    println!("100-0 km/h: {meters:.1} m, at rest {:?}", lone.position());
    assert!((36.0..45.0).contains(&meters), "{meters} m");
}

#[test]
fn a_light_brake_stops_every_class_of_vehicle_and_without_pedals_it_coasts_to_a_stop() {
    use Class::{Bus, Car, Motorcycle, Truck, Van};
    for class in [Car, Van, Truck, Bus, Motorcycle] {
        for brake in [0.0, 0.1, 0.2, 0.3, 0.4] {
            let mut lone = Lone::new(Ground::flat(0.0).into(), of_class(class));
            lone.run(0.5);
            lone.physics.set_velocity(ActorId(1), Vec3::X * 8.3, Vec3::ZERO).unwrap();
            lone.control.brake = brake;
            let from = lone.seconds;
            let most = if brake == 0.0 { 180.0 } else { 30.0 };
            while lone.speed() > 0.05 && lone.seconds - from < most {
                lone.frame();
            }
            println!("{class:?}, brake {brake}: {:.1} s", lone.seconds - from);
            assert!(lone.speed() <= 0.05, "{class:?}, brake {brake}: {} m/s", lone.speed());
        }
    }
}

/// Returns the mean drift over half a minute of a parked vehicle, and the largest speed once
/// settled. Metres per second.
fn drift(lone: &mut Lone) -> (f32, f32) {
    lone.run(5.0);
    let from = lone.position();
    let mut fastest = 0.0f32;
    for _ in 0..600 {
        lone.frame();
        fastest = fastest.max(lone.speed());
    }
    ((lone.position() - from).length() / 30.0, fastest)
}

#[test]
fn a_parked_car_neither_creeps_nor_jitters_on_a_ten_percent_slope() {
    for handbrake in [true, false] {
        let mut lone = Lone::new(incline(0.1), VehicleModel::sedan());
        lone.control.flags = if handbrake { flag::HANDBRAKE } else { 0 };
        lone.control.brake = if handbrake { 0.0 } else { 1.0 };
        let (drift, fastest) = drift(&mut lone);
        println!("handbrake {handbrake}: drift {drift:.2e} m/s, fastest {fastest:.2e} m/s");
        assert!(drift < 1e-3, "{drift} m/s");
        assert!(fastest < 1e-3, "{fastest} m/s");
    }
}

#[test]
fn vehicles_parked_on_a_slope_neither_drift_nor_jitter() {
    use Class::{Bicycle, Bus, Car, Motorcycle, Truck, Van};
    for class in [Car, Van, Truck, Bus, Motorcycle, Bicycle] {
        for (slope, pedal) in [(0.1, 0.0), (-0.1, 0.0), (0.1, 0.7), (-0.1, 0.7)] {
            let mut lone = Lone::new(incline(slope), of_class(class));
            lone.control.flags = if pedal > 0.0 { 0 } else { flag::HANDBRAKE };
            lone.control.brake = pedal;
            let (drift, fastest) = drift(&mut lone);
            println!(
                "{class:?} on {slope}, pedal {pedal}: drift {drift:.1e} m/s, fastest {fastest:.1e} m/s"
            );
            assert!(drift < 1e-3 && fastest < 5e-3, "{class:?}: {drift} m/s, {fastest} m/s");
        }
    }
}

#[test]
fn vehicles_that_brake_to_a_stop_on_a_slope_stand() {
    let ids =
        ["gazelle.omafiets", "diamondback.century", "bh.crossbike", "tesla.model3", "vespa.zx125"];
    for id in ids {
        let (_, blueprint) = town::blueprint(&format!("vehicle.{id}")).unwrap();
        for slope in [-0.1, -0.08, 0.0, 0.1] {
            let mut lone = Lone::new(incline(slope), VehicleModel::of(blueprint));
            lone.control.brake = 0.7;
            lone.run(1.0);
            let downhill = Vec3::new(1.0, 0.0, slope);
            lone.physics.set_velocity(ActorId(1), 3.0 * downhill, Vec3::ZERO).unwrap();
            let (drift, fastest) = drift(&mut lone);
            println!("{id} on {slope}: drift {drift:.1e} m/s, fastest {fastest:.1e} m/s");
            assert!(drift < 1e-3 && fastest < 5e-3, "{id}: {drift} m/s, {fastest} m/s");
        }
    }
}

#[test]
fn without_brakes_an_electric_car_rolls_back_down_the_slope() {
    let (_, blueprint) = town::blueprint("vehicle.tesla.model3").unwrap();
    let mut lone = Lone::new(incline(0.1), VehicleModel::of(blueprint));
    lone.run(3.0);
    assert!(lone.position().x < -2.0, "{}", lone.position());
}

#[test]
fn without_brakes_a_car_rolls_down_the_slope() {
    let mut lone = Lone::new(incline(0.1), VehicleModel::sedan());
    lone.control.manual_gear = 1;
    lone.run(3.0);
    assert!(lone.position().x < -2.0, "{}", lone.position());
}

#[test]
fn lateral_acceleration_on_a_circle_stays_within_tyre_friction() {
    let mut lone = Lone::sedan();
    lone.run(0.5);
    lone.control.steer = 0.35;
    let mut most = 0.0f32;
    for _ in 0..800 {
        lone.control.throttle = if lone.speed() < 16.0 { 0.5 } else { 0.1 };
        lone.frame();
        let left = lone.rotation() * Vec3::Y;
        most = most.max(Vec3::from_array(lone.state().acceleration_mps2).dot(left));
    }
    let state = lone.state();
    let up = lone.rotation() * Vec3::Z;
    println!("circle: {} m/s, lateral {most} m/s^2, up {up}", lone.speed());
    assert!(state.angular_velocity_radps[2] > 0.1, "turns left");
    assert!(most > 5.0 && most < 1.1 * 9.81, "{most} m/s^2");
    assert!(up.z > 0.95);
}

#[test]
fn a_slow_circle_has_the_radius_of_the_steering_angle() {
    let mut lone = Lone::sedan();
    lone.run(0.5);
    lone.control.steer = 0.5;
    for _ in 0..400 {
        lone.control.throttle = if lone.speed() < 3.0 { 0.2 } else { 0.0 };
        lone.frame();
    }
    let state = lone.state();
    // The middle of the rear axle moves on the circle of Ackermann geometry.
    let expected = 2.88 / state.wheel_steer_rad.tan();
    let radius = state.velocity().length() / state.angular_velocity_radps[2];
    println!("radius {radius} m, expected {expected} m");
    assert!((radius / expected - 1.0).abs() < 0.06, "{radius} m, not {expected} m");
}

#[test]
fn a_car_at_rest_has_the_ride_height_of_its_blueprint() {
    let mut lone = Lone::sedan();
    lone.run(3.0);
    assert!(lone.position().length() < 0.01, "{}", lone.position());
    assert!((lone.rotation() * Vec3::Z).z > 0.99999);
    assert!(lone.speed() < 1e-4, "{}", lone.speed());
}

#[test]
fn reverse_is_engaged_only_at_a_standstill() {
    let mut lone = Lone::sedan();
    lone.run(0.5);
    accelerate(&mut lone, 10.0);
    lone.control.flags = flag::REVERSE;
    lone.control.throttle = 0.5;
    lone.run(1.0);
    assert!(lone.state().gear > 0);
    lone.control.brake = 1.0;
    lone.run(3.0);
    lone.control.brake = 0.0;
    lone.run(3.0);
    assert_eq!(lone.state().gear, -1);
    assert!(lone.state().velocity().x < -2.0, "{}", lone.state().velocity());
}

fn places(half_wheelbase: f32, half_track: f32, radius: f32) -> Vec<WheelPlace> {
    let mut places = Vec::new();
    for x in [half_wheelbase, -half_wheelbase] {
        for y in if half_track > 0.0 { vec![half_track, -half_track] } else { vec![0.0] } {
            places.push(WheelPlace {
                hub_m: Vec3::new(x, y, radius),
                radius_m: radius,
                steered: x > 0.0,
                driven: x < 0.0,
            });
        }
    }
    places
}

fn of_class(class: Class) -> VehicleModel {
    let (half, mass, places) = match class {
        Class::Car => return VehicleModel::sedan(),
        Class::Van => (Vec3::new(2.7, 1.0, 1.25), 2600.0, places(1.8, 0.85, 0.36)),
        Class::Truck => (Vec3::new(4.2, 1.25, 1.7), 9000.0, places(2.4, 1.0, 0.5)),
        Class::Bus => (Vec3::new(5.9, 1.27, 1.6), 12_500.0, places(3.0, 1.05, 0.5)),
        Class::Motorcycle => (Vec3::new(1.1, 0.38, 0.75), 280.0, places(0.74, 0.0, 0.31)),
        Class::Bicycle => (Vec3::new(0.87, 0.3, 0.87), 90.0, places(0.53, 0.0, 0.34)),
    };
    VehicleModel::new(class, half, Vec3::new(0.0, 0.0, half.z), mass, &places)
}

#[test]
fn every_class_starts_turns_and_stops_on_its_wheels() {
    use Class::{Bicycle, Bus, Car, Motorcycle, Truck, Van};
    for (class, pace) in
        [(Car, 20.0), (Van, 20.0), (Truck, 15.0), (Bus, 15.0), (Motorcycle, 20.0), (Bicycle, 6.0)]
    {
        let mut lone = Lone::new(Arc::new(Ground::flat(0.0)), of_class(class));
        lone.run(1.0);
        assert!(lone.position().length() < 0.03, "{class:?} stands at {}", lone.position());
        let seconds = accelerate(&mut lone, pace);
        println!("{class:?}: 0-{pace} m/s in {seconds:.1} s");
        lone.control.steer = 0.1;
        let mut leaned = 0.0f32;
        for _ in 0..60 {
            lone.frame();
            leaned = leaned.max(-(lone.rotation() * Vec3::Y).z);
            let up = (lone.rotation() * Vec3::Z).z;
            assert!(up > 0.6, "{class:?} fell, up {up}");
        }
        let state = lone.state();
        assert!(state.angular_velocity_radps[2] > 0.02, "{class:?} does not turn left");
        if class.leans() {
            assert!(leaned > 0.1, "{class:?} leans only {leaned}");
        }
        lone.control.steer = 0.0;
        lone.control.brake = 1.0;
        lone.run(9.0);
        assert!(lone.speed() < 0.01, "{class:?} still moves at {}", lone.speed());
        assert!((lone.rotation() * Vec3::Z).z > 0.99, "{class:?} is tilted");
    }
}

#[test]
fn no_vehicle_is_level_at_rest_or_at_constant_speed() {
    use Class::{Bus, Car, Motorcycle, Truck, Van};
    for class in [Car, Van, Truck, Bus, Motorcycle] {
        for mps in [0.0, 8.3] {
            let mut lone = Lone::new(Ground::flat(0.0).into(), of_class(class));
            lone.run(2.0);
            lone.physics.set_velocity(ActorId(1), Vec3::X * mps, Vec3::ZERO).unwrap();
            for _ in 0..80 {
                lone.control.throttle = if lone.speed() < mps { 0.3 } else { 0.0 };
                lone.frame();
            }
            // The horizontal length of the direction, as CARLA's agents compute it.
            let ahead = lone.state().pose.rotation() * Vec3::X;
            println!("{class:?} at {:.2} m/s: {:.3}°", lone.speed(), ahead.z.asin().to_degrees());
            assert!(ahead.truncate().length() < 1.0 - 5e-7, "{class:?} at {mps} m/s: {ahead}");
        }
    }
}
