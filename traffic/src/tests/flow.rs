//! Traffic flow: capacity, waves, and the discharge of queues, beside those of the field.

use glam::Vec3;
use protocol::{ActorId, param};

use super::course::{Car, Course, DELTA_S};
use super::maps;
use super::params::turned;
use crate::{QueueHead, Standstill, WaitCause, body::CAR};

const LANE_Y: f32 = -1.75;

/// What `count` vehicles on a ring do after they have settled.
#[derive(Debug)]
struct Flow {
    per_hour: f32,
    per_km: f32,
    /// Standard deviation of the speeds of all vehicles at all times.
    deviation_mps: f32,
    /// Largest acceleration of a vehicle that drives.
    accel_max_mps2: f32,
}

/// Returns a ring of this radius with `count` vehicles.
fn ring(radius_m: f32, limit_kmh: u32, count: usize) -> Course {
    let network = maps::ring(radius_m.into(), limit_kmh, 1);
    let turn = |k: usize| k as f32 / count as f32 * std::f32::consts::TAU;
    let cars = (0..count).map(|k| on_ring(radius_m, turn(k)));
    Course::with_cars(network, 3, cars.collect())
}

/// Returns a vehicle on a ring, `turn` radians after its begin.
fn on_ring(radius_m: f32, turn: f32) -> Car {
    // The circle begins at the origin along x; its lane is on the right of the reference line.
    let lane_m = radius_m - LANE_Y;
    let position = Vec3::new(lane_m * turn.sin(), radius_m - lane_m * turn.cos(), 0.0);
    Car { position, yaw: turn, ..Car::default() }
}

/// Returns the flow after four minutes, over two minutes.
fn flow(radius_m: f32, limit_kmh: u32, count: usize, spread: f32) -> Flow {
    let mut course = ring(radius_m, limit_kmh, count);
    course.tick_with(&[turned(param::DRIVER_SPREAD, spread)]);
    let length_m = std::f32::consts::TAU * (radius_m - LANE_Y);
    for _ in 0..20 * 240 {
        course.tick();
    }
    let mut speeds = Vec::new();
    let mut accel_max_mps2 = 0.0f32;
    for _ in 0..20 * 120 {
        course.tick();
        for car in &course.cars {
            speeds.push(car.speed);
            accel_max_mps2 = accel_max_mps2.max(car.acceleration);
        }
    }
    assert_eq!(course.collisions, []);
    let mean_mps = speeds.iter().sum::<f32>() / speeds.len() as f32;
    let square = speeds.iter().map(|speed| (speed - mean_mps).powi(2)).sum::<f32>();
    Flow {
        per_hour: count as f32 / length_m * mean_mps * 3600.0,
        per_km: count as f32 / length_m * 1000.0,
        deviation_mps: (square / speeds.len() as f32).sqrt(),
        accel_max_mps2,
    }
}

/// Returns the times at which the fronts of a queue of standing vehicles pass its line, from when
/// the first may go, and the times at which they start.
fn discharge(seed: u64, count: usize) -> [Vec<f32>; 2] {
    let space_m = CAR.length_m() + 2.2;
    let line_m = 20.0 + count as f32 * space_m;
    let cars = (0..count).map(|k| {
        let x = line_m - CAR.front_m - k as f32 * space_m;
        Car { position: Vec3::new(x, LANE_Y, 0.0), ..Car::default() }
    });
    let mut course = Course::with_cars(maps::straight(1500.0), seed, cars.collect());
    let mut passed = vec![f32::NAN; count];
    let mut started = vec![f32::NAN; count];
    while passed.iter().any(|time_s| time_s.is_nan()) {
        course.tick();
        assert!(course.time_s() < 120.0, "{passed:?}");
        for (car, started) in course.cars.iter().zip(&mut started) {
            if started.is_nan() && car.speed > 0.5 {
                *started = course.time_s();
            }
        }
        for (car, passed) in course.cars.iter().zip(&mut passed) {
            // A queue stands with its first front at the line.
            if passed.is_nan() && car.position.x + CAR.front_m > line_m + 0.3 {
                *passed = course.time_s();
            }
        }
    }
    assert_eq!(course.collisions, []);
    [passed, started]
}

/// Returns the saturation flow in vehicles per hour and the start-up lost time in seconds, as the
/// Highway Capacity Manual defines them: by the headways after the fourth vehicle, and by those
/// before.
fn saturation(passed: &[f32]) -> (f32, f32) {
    let last = passed.len() - 1;
    let headway_s = (passed[last] - passed[3]) / (last - 3) as f32;
    (3600.0 / headway_s, passed[3] - 4.0 * headway_s)
}

#[test]
fn capacity_and_backward_waves_are_those_of_the_field() {
    let [most, dense, denser] = [45, 60, 80].map(|per_km| {
        let count = per_km as f32 * std::f32::consts::TAU * 0.2 * (1.0 - LANE_Y / 200.0);
        flow(200.0, 50, count as usize, 1.0)
    });
    assert!((1800.0..2400.0).contains(&most.per_hour), "{most:?}");
    // The slope of the congested branch is the speed of a wave.
    let wave_kmh = (dense.per_hour - denser.per_hour) / (denser.per_km - dense.per_km);
    println!("{most:?}, {dense:?}, wave {wave_kmh} km/h");
    assert!((12.0..20.0).contains(&wave_kmh), "{wave_kmh} km/h between {dense:?} and {denser:?}");
    assert!((1.0..2.0).contains(&dense.deviation_mps), "it slows and goes: {dense:?}");
    assert!((0.5..2.5).contains(&dense.accel_max_mps2), "{dense:?}");
}

#[test]
fn the_capacity_of_a_motorway_is_that_of_the_field() {
    let flow = flow(800.0, 110, 126, 1.0);
    println!("{flow:?}");
    assert!((1800.0..2400.0).contains(&flow.per_hour), "{flow:?}");
}

#[test]
fn vehicles_overtake_on_a_motorway_with_two_lanes() {
    let (radius_m, count) = (700.0, 40);
    let [one, two] = [1, 2].map(|lanes| {
        let network = maps::ring(radius_m.into(), 110, lanes);
        let turn = |k: usize| k as f32 / count as f32 * std::f32::consts::TAU;
        let cars = (0..count).map(|k| on_ring(radius_m, turn(k)));
        let mut course = Course::with_cars(network, 3, cars.collect());
        for _ in 0..20 * 240 {
            course.tick();
        }
        assert_eq!(course.collisions, []);
        course.cars.iter().map(|car| car.speed).sum::<f32>() / count as f32
    });
    assert!(two > 1.03 * one, "{one} and {two} m/s with one and two lanes");
}

#[test]
fn equal_drivers_make_no_waves() {
    let flow = flow(200.0, 50, 75, 0.0);
    println!("{flow:?}");
    assert!(flow.deviation_mps < 0.1, "{flow:?}");
}

#[test]
fn a_queue_discharges_as_in_the_field() {
    let seeds = 8;
    let (mut per_hour, mut lost_s, mut wave_kmh) = (0.0, 0.0, 0.0);
    for seed in 1..=seeds {
        let [passed, started] = discharge(seed, 20);
        let of_queue = saturation(&passed);
        let space_m = (CAR.length_m() + 2.2) * 19.0;
        wave_kmh += 3.6 * space_m / (started[19] - started[0]) / seeds as f32;
        per_hour += of_queue.0 / seeds as f32;
        lost_s += of_queue.1 / seeds as f32;
    }
    let figures = format!("{per_hour} vehicles/h, {lost_s} s lost, wave {wave_kmh} km/h");
    println!("{figures}");
    assert!((1700.0..2000.0).contains(&per_hour), "{figures}");
    assert!((1.5..2.5).contains(&lost_s), "{figures}");
    assert!((17.0..22.0).contains(&wave_kmh), "{figures}");
}

#[test]
fn no_driver_collides_when_the_first_of_a_platoon_stops_hard() {
    for (speed, limit_kmh) in [(13.0f32, 50), (28.0, 110)] {
        for seed in 1..=6 {
            let gap_m = 3.0 + 1.6 * speed;
            let cars = (0..10).map(|k| {
                let turn = -(k as f32) * (CAR.length_m() + gap_m) / 800.0;
                Car { speed, ..on_ring(800.0, turn) }
            });
            let network = maps::ring(800.0, limit_kmh, 1);
            let mut course = Course::with_cars(network, seed, cars.collect());
            for tick in 0..20 * 70 {
                course.tick();
                if tick > 20 * 20 {
                    course.cars[0].speed = (course.cars[0].speed - 8.0 * DELTA_S).max(0.0);
                }
            }
            assert_eq!(course.collisions, [], "seed {seed} at {limit_kmh} km/h");
            assert!(course.cars[9].speed < 0.3, "{:?}", course.cars[9]);
        }
    }
}

#[test]
fn each_standstill_is_listed_once_with_what_the_head_of_its_queue_waits_for() {
    let car = |x: f32| Car { position: Vec3::new(x, -1.75, 0.0), ..Car::default() };
    let cars = vec![Car { parked: true, ..car(200.0) }, car(150.0), car(130.0)];
    let mut course = Course::with_cars(maps::straight_with_solid_line(1000.0), 1, cars);
    let (mut found, mut from_s) = (Vec::new(), f32::INFINITY);
    while course.time_s() < 180.0 {
        course.tick();
        for standstill in course.planner.new_standstills() {
            from_s = from_s.min(course.time_s());
            found.push(*standstill);
        }
    }
    let head = QueueHead { vehicle: ActorId(2), cause: WaitCause::Actor, waits_for: ActorId(1) };
    let standstill = |vehicle: u32| Standstill { vehicle: ActorId(vehicle), head };
    assert_eq!(found, [standstill(2), standstill(3)]);
    assert!(from_s > 120.0, "{from_s}");
    assert_eq!(course.planner.queue_head(ActorId(3)), Some(head));
    assert_eq!(course.planner.queue_head(ActorId(1)), None, "no planner drives it");
}
