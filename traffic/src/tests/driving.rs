//! Lane keeping, car following, and a town with many vehicles.

use glam::{Vec2, Vec3};
use protocol::param;

use super::course::{Car, Course};
use super::maps;
use super::params::turned_for;
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
fn a_fast_vehicle_keeps_its_line_in_a_curve() {
    let radius_m = 200.0;
    let mut course =
        Course::with_cars(maps::ring(f64::from(radius_m), 90, 1), 1, vec![car(0.0, 20.0)]);
    let mut astray_m = 0.0f32;
    for tick in 0..20 * 40 {
        course.tick();
        let place = course.cars[0].position.truncate();
        let from_line_m = place.distance(Vec2::new(0.0, radius_m)) - (radius_m + 1.75);
        if tick > 20 * 10 {
            astray_m = astray_m.max(from_line_m.abs());
        }
    }
    let lateral_mps2 = course.cars[0].speed.powi(2) / radius_m;
    assert!(lateral_mps2 > 2.0, "{lateral_mps2}");
    assert!(astray_m < 0.4, "{astray_m} m astray");
}

/// Without the curvature of the change in the steering, the van lags by half a metre.
#[test]
fn a_fast_lane_change_follows_its_line() {
    for id in ["vehicle.volkswagen.t2_2021", "vehicle.carlamotors.carlacola"] {
        let own = car(0.0, 25.0).built_as(id);
        let mut course = Course::with_cars(maps::ring(800.0, 100, 2), 1, vec![own]);
        let speed = turned_for(1, param::SPEED_MPS, 25.0);
        (0..20 * 10).for_each(|_| course.tick_with(std::slice::from_ref(&speed)));
        course.tick_with(&[turned_for(1, param::CHANGE_NOW, -1.0)]);
        let mut astray_m = 0.0f32;
        for _ in 0..20 * 6 {
            course.tick();
            let plan = course.planner.vehicle_plans().next().expect("it is on a road");
            astray_m = astray_m.max(plan.cross_track_error_m.abs());
        }
        let place = course.cars[0].position.truncate();
        let from_line_m = place.distance(Vec2::new(0.0, 800.0)) - (800.0 + 5.25);
        assert!(from_line_m.abs() < 0.2, "{id}: {from_line_m} m beside the other lane's centre");
        assert!(astray_m < 0.2, "{id}: {astray_m} m astray");
    }
}

/// In 18 m a bus turns so far that its nose is 0.6 m in the lane beyond before its middle has reached the line.
#[test]
fn a_slow_bus_that_changes_lanes_keeps_its_nose_off_the_lane_beyond() {
    let own = car(0.0, 4.0).built_as("vehicle.mitsubishi.fusorosa");
    let (front_m, half_m) = (own.body().front_m, own.body().half_width_m);
    let mut course = Course::with_cars(maps::ring(800.0, 50, 2), 1, vec![own]);
    let speed = turned_for(1, param::SPEED_MPS, 4.0);
    (0..20 * 10).for_each(|_| course.tick_with(std::slice::from_ref(&speed)));
    course.tick_with(&[turned_for(1, param::CHANGE_NOW, -1.0)]);
    let (center, line_m) = (Vec2::new(0.0, 800.0), 800.0 + 5.25);
    let mut beyond_m = f32::NEG_INFINITY;
    for _ in 0..20 * 15 {
        course.tick();
        let bus = &course.cars[0];
        let forward = Vec2::from_angle(bus.yaw);
        let nose = bus.position.truncate() + forward * front_m - forward.perp() * half_m;
        beyond_m = beyond_m.max(nose.distance(center) - (line_m + half_m));
    }
    let place = course.cars[0].position.truncate();
    assert!((place.distance(center) - line_m).abs() < 0.2, "it has changed lanes");
    assert!(beyond_m < 0.25, "its nose is {beyond_m} m beyond its place on the lane");
}

#[test]
fn a_fast_vehicle_off_its_line_brakes_gently() {
    let braking = |speed: f32| {
        let off = Car { position: Vec3::new(50.0, -3.6, 0.0), speed, ..Car::default() };
        let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![off]);
        course.planner.plan(50_000_000, &course.actors, &[]);
        course.planner.controls()[0].brake
    };
    assert!(braking(8.0) > 0.25, "{}", braking(8.0));
    assert!(braking(13.5) < 0.15, "{}", braking(13.5));
}

#[test]
fn a_motorcycle_in_a_curve_brakes_by_less_than_on_a_straight_road() {
    let (blueprint, _) = town::blueprint("vehicle.kawasaki.ninja").unwrap();
    let braking = |yaw_rate: f32| {
        let parked = Car { parked: true, ..car(40.0, 0.0) };
        let fast = Car { yaw_rate, ..car(20.0, 13.0) };
        let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![fast, parked]);
        course.actors[0].blueprint = blueprint;
        course.planner.plan(50_000_000, &course.actors, &[]);
        course.planner.controls()[0].brake
    };
    let (straight, curve) = (braking(0.0), braking(0.25));
    assert!(straight > 0.7, "{straight}");
    assert!((0.4..0.85 * straight).contains(&curve), "{curve} and {straight}");
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

#[test]
fn a_two_wheeler_that_slides_steers_against_it() {
    let (blueprint, _) = town::blueprint("vehicle.vespa.zx125").unwrap();
    // Its rear runs out to the right: it points to the left of where it goes, and turns further.
    let car = Car { yaw: 0.2, yaw_rate: 0.5, ..car(50.0, 15.0) };
    let mut course = Course::with_cars(maps::straight(1000.0), 1, vec![car]);
    course.actors[0].blueprint = blueprint;
    course.actors[0].velocity_mps = [15.0, 0.0, 0.0];
    course.planner.plan(50_000_000, &course.actors, &[]);
    // Without a slide, its lean limit allows 0.025 rad at this speed.
    let wheels_rad = course.planner.controls()[0].steer * 0.6 * 0.82;
    assert!(wheels_rad < -0.05, "{wheels_rad}");
}

#[test]
fn a_cyclist_rides_on_the_right_and_cars_pass() {
    // Two lanes in one direction; both start on the left one.
    let network = maps::two_lanes();
    let left = |x: f32| Car { position: Vec3::new(x, -1.75, 0.0), speed: 4.0, ..Car::default() };
    let mut course = Course::with_cars(network, 1, vec![left(40.0), left(5.0)]);
    let (blueprint, _) = town::blueprint("vehicle.bh.crossbike").unwrap();
    let mut beside_m = Vec::new();
    for tick in 0..20 * 60 {
        course.actors[0].blueprint = blueprint;
        course.tick();
        if tick > 20 * 20 && course.cars[0].position.x < 550.0 {
            beside_m.push(-course.cars[0].position.y);
        }
    }
    let mean_m = beside_m.iter().sum::<f32>() / beside_m.len() as f32;
    // The right lane is 3.5 m to 7 m from the reference line.
    assert!((5.9..6.8).contains(&mean_m), "{mean_m} m from the reference line");
    assert!(course.cars[1].driven_m > course.cars[0].driven_m + 100.0, "the car has passed");
    assert_eq!(course.collisions, []);
}

/// Returns when a vehicle that stands at the end of its lane has driven 60 m on, beside a lane with a
/// vehicle at 47 km/h every so many metres.
fn merges_after_s(spacing_m: f32) -> Option<f32> {
    let beside = |x: f32| Car { position: Vec3::new(x, -1.75, 0.0), speed: 13.0, ..Car::default() };
    let mut cars =
        vec![Car { position: Vec3::new(590.0, -5.25, 0.0), speed: 0.0, ..Car::default() }];
    cars.extend(
        (0..60).map(|at| beside(580.0 - spacing_m * at as f32)).filter(|car| car.position.x > 0.0),
    );
    let mut course = Course::with_cars(maps::ending_lane(), 1, cars);
    while course.time_s() < 120.0 {
        course.tick();
        assert_eq!(course.collisions, []);
        if course.cars[0].driven_m > 60.0 {
            return Some(course.time_s());
        }
    }
    None
}

#[test]
fn a_vehicle_at_the_end_of_its_lane_is_let_in() {
    let after_s = merges_after_s(26.0).expect("it is let in within two minutes");
    assert!(after_s < 30.0, "{after_s} s");
}

/// Returns before how many metres of its way the second of two buses stops that come towards each other
/// before a bend of this radius to the left; infinity if it does not.
fn stops_before_bend_m(radius_m: f64) -> f32 {
    let down = -std::f32::consts::FRAC_PI_2;
    let place = |x: f32, y: f32, yaw: f32| Car {
        position: Vec3::new(x, y, 0.0),
        yaw,
        speed: 3.0,
        ..Car::default()
    };
    // The first straight is 60 m along x.
    let cars = vec![
        place(60.0 + radius_m as f32 - 1.75, radius_m as f32 + 10.0, down),
        place(45.0, -1.75, 0.0),
    ];
    let mut course = Course::with_cars(maps::two_way_loop(radius_m, 60.0), 1, cars);
    let bus = town::blueprint("vehicle.mitsubishi.fusorosa").expect("it is in the catalogue").0;
    course.vehicle_blueprint = bus as u32;
    course.snapshot();
    course.tick();
    course.planner.vehicle_plans().nth(1).expect("it is on a road").leader_m
}

#[test]
fn a_bus_stops_before_the_way_of_an_oncoming_one_through_a_bend() {
    let tight_m = stops_before_bend_m(16.0);
    assert!((1.0..25.0).contains(&tight_m), "{tight_m} m");
    assert_eq!(stops_before_bend_m(80.0), f32::INFINITY, "both have room");
}

#[test]
fn a_bus_that_is_blocked_in_a_bend_evades_to_the_side_away_from_an_oncoming_truck() {
    // The bus turns right, so that the truck on the oncoming lane is to the right of its heading.
    let (straight_m, radius_m) = (60.0, 25.0);
    let angle = -0.7_f32;
    let out = Vec2::from_angle(angle);
    let across_the_line = Vec2::new(straight_m, radius_m) + out * (radius_m + 0.9);
    let truck = Car {
        position: across_the_line.extend(0.0),
        yaw: angle + std::f32::consts::FRAC_PI_2,
        parked: true,
        ..Car::default()
    };
    let bus = Car {
        position: Vec3::new(straight_m + radius_m - 1.75, radius_m + 10.0, 0.0),
        yaw: -std::f32::consts::FRAC_PI_2,
        ..Car::default()
    };
    let cars = vec![
        bus.built_as("vehicle.mitsubishi.fusorosa"),
        truck.built_as("vehicle.carlamotors.firetruck"),
    ];
    let network = maps::two_way_loop(f64::from(radius_m), f64::from(straight_m));
    let mut course = Course::with_cars(network, 1, cars);
    let has_reversed = |course: &Course| course.planner.state.vehicles[0].reverse_count > 0;
    for _ in 0..20 * 60 {
        course.tick();
        if has_reversed(&course) {
            break;
        }
    }
    assert!(has_reversed(&course), "it stands before the truck");
    assert_eq!(course.planner.state.vehicles[0].evasion_side, -1.0);
}

/// Drives two vehicles of these blueprints into the bend of a two-way road from both ends, the second one
/// `later_m` farther away, and returns whether both have passed it without touching.
fn pass_in_bend(radius_m: f32, blueprints: [&str; 2], later_m: f32, is_first: bool) -> bool {
    let (straight_m, speed) = (120.0, 10.0);
    let along = Car { position: Vec3::new(60.0, -1.75, 0.0), speed, ..Car::default() };
    let x = straight_m + radius_m - 1.75;
    let against = Car {
        position: Vec3::new(x, radius_m + 60.0 + later_m, 0.0),
        yaw: -std::f32::consts::FRAC_PI_2,
        speed,
        ..Car::default()
    };
    let mut cars = vec![along.built_as(blueprints[0]), against.built_as(blueprints[1])];
    if !is_first {
        cars.swap(0, 1);
    }
    let [forth, back] = if is_first { [0, 1] } else { [1, 0] };
    let network = maps::two_way_loop(f64::from(radius_m), f64::from(straight_m));
    let mut course = Course::with_cars(network, 1, cars);
    let mut passed = [false; 2];
    for _ in 0..20 * 60 {
        course.tick();
        passed[0] |= course.cars[forth].position.y > radius_m + 40.0;
        passed[1] |= course.cars[back].position.x < straight_m - 20.0;
    }
    course.collisions.is_empty() && passed == [true; 2]
}

#[test]
fn wide_vehicles_pass_a_bend_one_after_the_other() {
    let (bus, truck) = ("vehicle.mitsubishi.fusorosa", "vehicle.carlamotors.firetruck");
    let mut failed = Vec::new();
    for radius_m in [20.0, 32.0, 45.0] {
        for later_m in [-40.0, -20.0, 0.0, 15.0, 30.0] {
            for is_first in [true, false] {
                for others in [[bus, bus], [bus, truck]] {
                    if !pass_in_bend(radius_m, others, later_m, is_first) {
                        failed.push((radius_m, later_m, is_first, others[1]));
                    }
                }
            }
        }
    }
    assert_eq!(failed, []);
}

#[test]
fn a_car_leaves_a_tight_bend_to_a_bus() {
    let (bus, car) = ("vehicle.mitsubishi.fusorosa", "vehicle.nissan.patrol");
    let mut failed = Vec::new();
    // Bends of 47 m and more are no conflict areas.
    for later_m in [-40.0, -20.0, 0.0, 15.0, 30.0] {
        for is_first in [true, false] {
            for pair in [[bus, car], [car, bus]] {
                if !pass_in_bend(30.0, pair, later_m, is_first) {
                    failed.push((later_m, is_first, pair));
                }
            }
        }
    }
    assert_eq!(failed, []);
}
