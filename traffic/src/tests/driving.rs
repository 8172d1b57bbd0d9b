//! Lane keeping, car following, and a town with many vehicles.

use glam::Vec3;

use super::course::{Car, Course};
use super::maps;
use crate::body::CAR;

/// Creates a car on the lane driven along x.
fn car(x: f32, speed: f32) -> Car {
    Car { position: Vec3::new(x, -1.75, 0.0), speed, ..Car::default() }
}

fn gap_m(course: &Course) -> f32 {
    course.cars[0].position.x - course.cars[1].position.x - CAR.length_m()
}

#[test]
fn a_free_vehicle_keeps_its_lane_and_comes_near_the_limit() {
    let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![car(10.0, 0.0)]);
    for _ in 0..400 {
        course.tick();
        assert!((course.cars[0].position.y + 1.75).abs() < 0.1, "{:?}", course.cars[0]);
        assert!(course.cars[0].speed < 50.0 / 3.6 + 0.5);
    }
    assert!(course.cars[0].speed > 0.9 * 50.0 / 3.6, "{}", course.cars[0].speed);
}

#[test]
fn a_vehicle_above_another_stretch_of_its_lane_follows_its_own() {
    for y in [-6.0, -4.0, -2.0, 0.0, 2.0] {
        let yaw = -std::f32::consts::FRAC_PI_2;
        let car = Car { position: Vec3::new(158.25, y, 7.0), yaw, ..Car::default() };
        let mut course = Course::with_cars(maps::overpass(), 1, vec![car]);
        for _ in 0..200 {
            course.tick();
            let car = &course.cars[0];
            assert!((car.position.x - 158.25).abs() < 0.1, "from y {y}: {car:?}");
        }
        assert!(course.cars[0].position.y < y - 40.0, "from y {y}: {:?}", course.cars[0]);
    }
}

#[test]
fn a_vehicle_stops_behind_one_that_stands() {
    let parked = Car { parked: true, ..car(300.0, 0.0) };
    let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![parked, car(10.0, 13.0)]);
    for _ in 0..1200 {
        course.tick();
    }
    assert_eq!(course.collisions, []);
    assert!(course.cars[1].speed.abs() < 0.1);
    let gap = gap_m(&course);
    assert!((1.0..4.0).contains(&gap), "{gap} m behind");
}

#[test]
fn a_vehicle_stops_for_one_that_stops_hard() {
    let cars = vec![car(60.0, 13.0), car(35.0, 13.0)];
    let mut course = Course::with_cars(maps::straight(2000.0), 1, cars);
    for tick in 0..1200 {
        course.tick();
        // At 6 m/s², a hard stop of a car; then it drives on.
        if (200..400).contains(&tick) {
            course.cars[0].speed = (course.cars[0].speed - 0.3).max(0.0);
        }
        assert!(gap_m(&course) > 0.5, "{} m at tick {tick}", gap_m(&course));
    }
    assert!(course.cars[1].speed > 10.0, "it drives on behind the leader");
}

#[test]
fn a_follower_keeps_more_distance_the_faster_it_is() {
    let gap_at = |limit_share: f32| {
        let cars = vec![car(60.0, 5.0), car(30.0, 5.0)];
        let mut course = Course::with_cars(maps::straight(2000.0), 1, cars);
        for _ in 0..1000 {
            course.tick();
            course.cars[0].speed = course.cars[0].speed.min(limit_share * 50.0 / 3.6);
        }
        assert!((course.cars[1].speed - course.cars[0].speed).abs() < 0.5);
        gap_m(&course)
    };
    let (slow, fast) = (gap_at(0.3), gap_at(0.8));
    assert!(fast > slow + 4.0, "{slow} m and {fast} m");
}

#[test]
fn a_town_full_of_vehicles_keeps_moving_without_a_collision() {
    let mut course = Course::new(maps::town(), 5, 40);
    for _ in 0..20 * 240 {
        course.tick();
    }
    assert_eq!(course.collisions, []);
    for (index, car) in course.cars.iter().enumerate() {
        assert!(car.longest_stand_s < 100.0, "car {index} stood {} s", car.longest_stand_s);
        assert!(car.driven_m > 240.0, "car {index} drove {} m", car.driven_m);
    }
}

#[test]
fn a_two_wheeler_is_not_steered_beyond_its_lean_limit() {
    let (blueprint, scooter) = town::blueprint("vehicle.vespa.zx125").unwrap();
    // Three metres off its line, at 15 m/s.
    let off = Car { position: Vec3::new(50.0, -4.75, 0.0), speed: 15.0, ..Car::default() };
    let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![off]);
    course.actors[0].blueprint = blueprint;
    course.planner.plan(50_000_000, &course.actors, &[]);
    let steer = course.planner.controls()[0].steer;
    // At that speed the available steering angle is a sixth less than at standstill.
    let wheels_rad = steer * 0.6 * 0.84;
    let sideways_mps2 = 15.0f32.powi(2) * wheels_rad.tan() / scooter.wheelbase_m;
    assert!((2.0..5.5).contains(&sideways_mps2), "{sideways_mps2} at a steer of {steer}");
}
