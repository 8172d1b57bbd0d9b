//! Lights, signs, and right of way without either.

use glam::{Vec2, Vec3};
use protocol::{ActorId, RouteStep, light, param};

use super::client_route::commands_to;
use super::course::{Car, Course};
use super::maps;
use super::params::turned;
use crate::{body::CAR, signals::PHASE_NANOS};

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

/// Returns a vehicle on the southern arm of the second of two crossings, which has light 2, with its front
/// this far beyond the end of the arm.
fn before_second_crossing(beyond_m: f32, speed: f32) -> Car {
    let position = Vec3::new(26.0 + 1.75, -10.0 + beyond_m - CAR.front_m, 0.0);
    Car { position, yaw: std::f32::consts::FRAC_PI_2, speed, ..Car::default() }
}

#[test]
fn a_bus_without_room_between_two_lights_passes_both() {
    let (_, body) = town::blueprint("vehicle.mitsubishi.fusorosa").expect("a blueprint");
    let before_m = body.center_m.x + body.half_extents_m.x + 11.0;
    let bus = Car { position: Vec3::new(-before_m, -1.75, 0.0), ..Car::default() }
        .built_as("vehicle.mitsubishi.fusorosa");
    // Others wait at the southern lights all the time.
    let wait = |car: Car| Car { parked: true, ..car };
    let at_second = before_second_crossing(-1.0, 0.0);
    let at_first = Car { position: at_second.position - Vec3::X * 26.0, ..at_second.clone() };
    let cars = vec![bus, wait(at_first), wait(at_second)];
    let mut course = Course::with_cars(maps::two_lit_crossings(26.0), 3, cars);
    // The lights of the second crossing are green for those.
    course.planner.state.clocks[1] = PHASE_NANOS;
    course.tick_with(&commands_to(ActorId(1), &[RouteStep::place(Vec3::new(80.0, -1.75, 0.0))]));
    let mut longest_s = 0.0f32;
    while course.cars[0].position.x < 40.0 {
        assert!(course.time_s() < 300.0, "it is at {}", course.cars[0].position);
        course.tick();
        longest_s = longest_s.max(course.planner.state.vehicles[0].wait_s);
    }
    assert!(longest_s > 20.0, "it waited for {longest_s} s");
    assert!(course.crossings.iter().all(|crossing| crossing.1 != light::RED));
}

#[test]
fn no_vehicle_enters_while_another_stands_before_the_next_crossing() {
    let (_, body) = town::blueprint("vehicle.mitsubishi.fusorosa").expect("a blueprint");
    let before_m = body.center_m.x + body.half_extents_m.x + 11.0;
    let bus = Car { position: Vec3::new(-before_m, -1.75, 0.0), ..Car::default() }
        .built_as("vehicle.mitsubishi.fusorosa");
    let parked = Car { position: Vec3::new(13.0, -1.75, 0.0), parked: true, ..Car::default() };
    let mut course = Course::with_cars(maps::two_lit_crossings(26.0), 3, vec![bus, parked]);
    course.tick_with(&commands_to(ActorId(1), &[RouteStep::place(Vec3::new(80.0, -1.75, 0.0))]));
    let end_m = |course: &Course| course.cars[0].position.x + before_m - 11.0;
    while course.time_s() < 60.0 {
        course.tick();
        assert!(end_m(&course) < -9.0, "it is in the first crossing");
    }
    course.cars[1].position.y = -60.0;
    while end_m(&course) < 40.0 {
        course.tick();
        assert!(course.time_s() < 200.0, "it is at {}", course.cars[0].position);
    }
}

#[test]
fn a_vehicle_with_its_front_over_the_line_waits_at_red() {
    let on_red = [0.2, 0.8, 1.3].map(|beyond_m| {
        let cars = vec![before_second_crossing(beyond_m, 0.0)];
        let mut course = Course::with_cars(maps::two_crossings(26.0), 3, cars);
        let (mut red_s, mut passed) = (0.0, false);
        for _ in 0..20 * 60 {
            course.tick();
            let is_red = course.light(1) == light::RED;
            passed |= is_red && course.cars[0].position.y < -8.0 && course.cars[0].speed > 0.5;
            red_s += if is_red { 0.05 } else { 0.0 };
        }
        assert!(course.cars[0].position.y > 0.0, "it drives at green");
        (red_s > 0.0, passed)
    });
    assert_eq!(on_red, [(true, false); 3]);
}

#[test]
fn a_vehicle_that_has_just_started_stops_when_its_light_turns_yellow() {
    let start = before_second_crossing(-0.4, 1.2);
    // Another one waits at the light of the crossing road.
    let other = Car { position: Vec3::new(12.0, -1.75, 0.0), parked: true, ..Car::default() };
    let mut course = Course::with_cars(maps::two_crossings(26.0), 3, vec![start.clone(), other]);
    for _ in 0..20 * 120 {
        course.tick();
        if course.light(1) == light::YELLOW {
            break;
        }
        course.cars[0] = start.clone();
        course.snapshot();
    }
    assert_eq!(course.light(1), light::YELLOW);
    let mut farthest_m = f32::NEG_INFINITY;
    for _ in 0..20 * 5 {
        course.tick();
        farthest_m = course.cars[0].position.y + CAR.front_m + 10.0;
    }
    assert!(farthest_m < 1.0, "{farthest_m} m beyond its arm");
}

/// Returns a world with a vehicle that could not start at green, with its front this far beyond the end of its
/// arm. The light, which has a line this far before the end, has just turned red.
fn held_up_until_red(beyond_m: f32, line_m: f64) -> Course {
    let before = before_second_crossing(beyond_m.min(-0.4), 0.0);
    let start = before_second_crossing(beyond_m, 0.0);
    // Another one waits at the light of the crossing road.
    let other = Car { position: Vec3::new(12.0, -1.75, 0.0), parked: true, ..Car::default() };
    let map = maps::two_crossings_with_line(26.0, line_m);
    let mut course = Course::with_cars(map, 3, vec![before.clone(), other]);
    let mut was_green = false;
    for _ in 0..20 * 120 {
        course.tick();
        was_green |= course.light(1) == light::GREEN;
        if was_green && course.light(1) == light::RED {
            break;
        }
        course.cars[0] = if was_green { start.clone() } else { before.clone() };
        course.snapshot();
    }
    assert!(was_green && course.light(1) == light::RED);
    course
}

#[test]
fn a_vehicle_that_was_held_up_beyond_its_line_leaves_at_red() {
    let mut course = held_up_until_red(-2.0, 6.0);
    for _ in 0..20 * 10 {
        course.tick();
        assert_ne!(course.light(1), light::GREEN);
    }
    assert!(course.cars[0].position.y > 10.0, "it stands at {}", course.cars[0].position);
}

#[test]
fn a_vehicle_that_was_held_up_with_its_front_over_the_line_waits_at_red() {
    let mut course = held_up_until_red(1.3, 0.5);
    let before = course.cars[0].position;
    for _ in 0..20 * 10 {
        course.tick();
        assert_ne!(course.light(1), light::GREEN);
        assert!(course.cars[0].position.distance(before) < 0.5, "{}", course.cars[0].position);
    }
}

#[test]
fn a_vehicle_whose_light_turns_red_before_it_has_started_has_waited_all_that_time() {
    let start = before_second_crossing(-0.6, 0.0);
    // Another one waits at the light of the crossing road.
    let other = Car { position: Vec3::new(12.0, -1.75, 0.0), parked: true, ..Car::default() };
    let mut course = Course::with_cars(maps::two_crossings(26.0), 3, vec![start.clone(), other]);
    let (mut greens, mut before, mut held, mut longest_s) = (0, light::RED, false, 0.0f32);
    while greens < 2 {
        course.tick();
        let now = course.light(1);
        greens += u32::from(now == light::RED && before != light::RED);
        before = now;
        let vehicle = &course.planner.state.vehicles[0];
        held |= vehicle.reservation != 0;
        assert!(vehicle.wait_s + 0.1 > longest_s, "{} of {longest_s} s", vehicle.wait_s);
        longest_s = longest_s.max(vehicle.wait_s);
        course.cars[0] = start.clone();
        course.snapshot();
        assert!(course.time_s() < 240.0);
    }
    assert!(held && longest_s > 10.0, "{longest_s} s");
    for _ in 0..20 * 120 {
        course.tick();
    }
    assert_eq!(course.planner.state.vehicles[0].wait_s, 0.0, "it has passed");
}

/// Moves each vehicle that has left the junctions to where its arm begins, when there is room.
fn begin_again(cars: &mut [Car]) {
    for index in 0..cars.len() {
        let Car { position, yaw, .. } = cars[index];
        let along = Vec2::from_angle(yaw);
        let begin = position.truncate() * along.perp().abs() - 150.0 * along;
        let is_free = cars.iter().all(|car| car.position.truncate().distance(begin) > 20.0);
        if position.truncate().dot(along) > 80.0 && is_free {
            cars[index] = Car { position: begin.extend(0.0), yaw, speed: 8.0, ..Car::default() };
        }
    }
}

#[test]
fn a_light_a_few_metres_after_another_junction_is_obeyed_and_that_junction_kept_free() {
    let mut cars = Vec::new();
    for place in 0..6 {
        let along = 25.0 + 20.0 * place as f32;
        let north = |x: f32| Car {
            position: Vec3::new(x + 1.75, -along, 0.0),
            yaw: std::f32::consts::FRAC_PI_2,
            speed: 8.0,
            ..Car::default()
        };
        let east = Car { position: Vec3::new(-along, -1.75, 0.0), speed: 8.0, ..Car::default() };
        cars.extend([east, north(0.0), north(26.0)]);
    }
    let count = cars.len();
    let mut course = Course::with_cars(maps::two_crossings(26.0), 3, cars);
    // How long each vehicle stands where others cross the first junction.
    let (mut stood_s, mut longest_s) = (vec![0.0f32; count], 0.0f32);
    for _ in 0..20 * 600 {
        course.tick();
        begin_again(&mut course.cars);
        for (car, stood_s) in course.cars.iter().zip(&mut stood_s) {
            let front = car.position.truncate() + Vec2::from_angle(car.yaw) * CAR.front_m;
            let rear = car.position.truncate() - Vec2::from_angle(car.yaw) * CAR.rear_m;
            let is_inside = |at: Vec2| at.abs().max_element() < 2.5;
            let stands = car.speed.abs() < 0.1 && (is_inside(front) || is_inside(rear));
            *stood_s = if stands { *stood_s + 0.05 } else { 0.0 };
            longest_s = longest_s.max(*stood_s);
        }
    }
    let on = |phase: u32| course.crossings.iter().filter(|c| c.1 == phase).count();
    assert!(on(light::GREEN) > 50, "only {} passed on green", on(light::GREEN));
    assert_eq!(on(light::RED), 0, "{:?}", course.crossings);
    assert!(longest_s < 5.0, "one stood in the first junction for {longest_s} s");
    assert_eq!(course.collisions, []);
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
