//! Lights, signs, and right of way without either.

use glam::Vec3;
use protocol::{light, param};

use super::course::{Car, Course};
use super::maps;
use super::params::turned;

#[test]
fn no_vehicle_passes_a_red_light() {
    let mut course = Course::new(maps::town(), 2, 30);
    for _ in 0..20 * 180 {
        course.tick();
    }
    let on = |phase: u32| course.crossings.iter().filter(|c| c.1 == phase).count();
    assert!(on(light::GREEN) > 50, "only {} passed on green", on(light::GREEN));
    let on_red: Vec<_> = course.crossings.iter().filter(|c| c.1 == light::RED).collect();
    assert!(on_red.is_empty(), "{on_red:?}");
}

#[test]
fn a_vehicle_that_ignores_lights_passes_red_ones() {
    let mut course = Course::new(maps::town(), 2, 30);
    course.tick_with(&[turned(param::IGNORE_LIGHTS, 1.0)]);
    for _ in 0..20 * 60 {
        course.tick();
    }
    assert!(course.crossings.iter().any(|c| c.1 == light::RED));
}

/// Creates an eastbound and a northbound vehicle, equally far from the crossing, with ids in this
/// order.
fn meeting(eastbound_first: bool) -> Course {
    let east = Car { position: Vec3::new(-90.0, -1.75, 0.0), speed: 8.0, ..Car::default() };
    let north = Car {
        position: Vec3::new(1.75, -90.0, 0.0),
        yaw: std::f32::consts::FRAC_PI_2,
        speed: 8.0,
        ..Car::default()
    };
    let cars = if eastbound_first { vec![east, north] } else { vec![north, east] };
    Course::with_cars(maps::crossing(), 3, cars)
}

#[test]
fn the_vehicle_from_the_right_goes_first_whatever_the_ids() {
    for eastbound_first in [true, false] {
        let mut course = meeting(eastbound_first);
        // Equal drivers arrive at the same time.
        course.tick_with(&[turned(param::DRIVER_SPREAD, 0.0)]);
        let (east, north) = if eastbound_first { (0, 1) } else { (1, 0) };
        let mut passed_s = [f32::NAN; 2];
        for _ in 0..20 * 40 {
            course.tick();
            for (car, beyond) in [(east, "2"), (north, "4")] {
                if passed_s[car].is_nan() && course.road_of(car) == beyond {
                    passed_s[car] = course.time_s();
                }
            }
        }
        assert_eq!(course.collisions, []);
        assert!(passed_s[north] < passed_s[east], "{passed_s:?}");
    }
}

#[test]
fn a_crossing_with_queues_on_all_arms_has_no_deadlock_and_no_collision() {
    let mut cars = Vec::new();
    for (k, (x, y)) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0f32)].iter().enumerate() {
        let yaw = (-y).atan2(-x);
        for place in 0..6 {
            let along = 30.0 + 18.0 * place as f32 + 3.0 * k as f32;
            let right = Vec3::new(yaw.sin(), -yaw.cos(), 0.0) * 1.75;
            let position = Vec3::new(*x, *y, 0.0) * along + right;
            cars.push(Car { position, yaw, ..Car::default() });
        }
    }
    let starts: Vec<Vec3> = cars.iter().map(|car| car.position).collect();
    let mut course = Course::with_cars(maps::crossing(), 3, cars);
    let mut passed = vec![false; starts.len()];
    for _ in 0..20 * 120 {
        course.tick();
        for (car, start) in starts.iter().enumerate() {
            passed[car] |= course.cars[car].position.dot(*start) < -12.0 * start.length();
        }
    }
    assert_eq!(course.collisions, []);
    assert_eq!(passed, vec![true; starts.len()]);
}

/// Returns whether the northbound vehicle stops at a sign before the crossing after these commands.
fn stops_at_sign(commands: &[protocol::JournalEntry]) -> bool {
    let north = Car {
        position: Vec3::new(1.75, -90.0, 0.0),
        yaw: std::f32::consts::FRAC_PI_2,
        speed: 8.0,
        ..Car::default()
    };
    let mut course = Course::with_cars(maps::stop_before_crossing(), 3, vec![north]);
    course.tick_with(commands);
    (0..20 * 30).for_each(|_| course.tick());
    assert!(course.cars[0].position.y > 30.0, "{:?}", course.cars[0]);
    course.cars[0].longest_stand_s > 0.5
}

#[test]
fn a_vehicle_that_ignores_signs_does_not_stop_at_one() {
    assert!(stops_at_sign(&[]));
    assert!(!stops_at_sign(&[turned(param::IGNORE_SIGNS, 1.0)]));
}
