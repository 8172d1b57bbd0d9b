//! Vehicles pass props that stand on their lanes.

use glam::{Vec2, Vec3};
use protocol::{flag, kind, lamp, param};

use super::course::{Car, Course, DELTA_NANOS};
use super::maps;
use crate::{Planner, body::CAR};

/// Creates a car on the lane driven along x.
fn car(x: f32, speed: f32) -> Car {
    Car { position: Vec3::new(x, -1.75, 0.0), speed, ..Car::default() }
}

/// Creates a car on the lane driven against x.
fn oncoming(x: f32, speed: f32) -> Car {
    let yaw = std::f32::consts::PI;
    Car { position: Vec3::new(x, 1.75, 0.0), yaw, speed, ..Car::default() }
}

/// Creates what will be a prop.
fn prop(x: f32, y: f32) -> Car {
    Car { position: Vec3::new(x, y, 0.0), parked: true, ..Car::default() }
}

/// Returns the clearance between a car and a prop whose edges are parallel to x and y.
fn clearance_m(car: &Car, prop: &Car, half: Vec2) -> f32 {
    let forward = Vec2::from_angle(car.yaw);
    let along = (-24..=24).map(|k| k as f32 / 24.0);
    along
        .flat_map(|part| {
            [-1.0, 1.0].map(|side| {
                let length = if part < 0.0 { CAR.rear_m } else { CAR.front_m };
                let edge = forward * part * length + forward.perp() * side * CAR.half_width_m;
                let to = (car.position - prop.position).truncate() + edge;
                (to.abs() - half).max(Vec2::ZERO).length()
            })
        })
        .fold(f32::INFINITY, f32::min)
}

/// How car 1 drove along a road with prop 0.
struct Drive {
    waits: Vec<crate::PropWait>,
    /// Least clearance to the prop.
    clearance_m: f32,
    /// Range of the lateral position.
    low_y: f32,
    high_y: f32,
    /// By frame: the position.
    track: Vec<Vec3>,
}

/// Lets car 1 drive past prop 0.
fn drive(course: &mut Course, blueprint: &str, seconds: u32) -> Drive {
    let half = town::blueprint(blueprint).unwrap().1.half_extents_m.truncate();
    let mut drive = Drive {
        waits: Vec::new(),
        clearance_m: f32::INFINITY,
        low_y: f32::INFINITY,
        high_y: f32::NEG_INFINITY,
        track: Vec::new(),
    };
    for _ in 0..20 * seconds {
        make_prop(course, 0, blueprint);
        course.tick();
        drive.waits.extend_from_slice(course.planner.new_prop_waits());
        let [prop, car, ..] = &course.cars[..] else { unreachable!("a prop and a car") };
        drive.clearance_m = drive.clearance_m.min(clearance_m(car, prop, half));
        drive.low_y = drive.low_y.min(car.position.y);
        drive.high_y = drive.high_y.max(car.position.y);
        drive.track.push(car.position);
    }
    drive
}

/// Turns a vehicle of the snapshot into a prop.
fn make_prop(course: &mut Course, vehicle: usize, blueprint: &str) {
    let (blueprint, _) = town::blueprint(blueprint).unwrap();
    let prop = &mut course.actors[vehicle];
    (prop.kind, prop.blueprint, prop.flags) = (kind::PROP, blueprint, flag::KINEMATIC);
}

/// Lets a car drive for a while towards a prop, which is vehicle 0 of the course; returns the waits
/// that were reported.
pub(super) fn drive_at_prop(
    course: &mut Course,
    blueprint: &str,
    seconds: u32,
) -> Vec<crate::PropWait> {
    drive(course, blueprint, seconds).waits
}

#[test]
fn a_vehicle_changes_lanes_to_pass_a_prop() {
    let prop = Car { parked: true, ..car(300.0, 0.0) };
    // From a distance, and from a standstill close to it, where no vehicle changes lanes to drive
    // faster.
    for (x, speed) in [(100.0, 10.0), (284.0, 0.0)] {
        let cars = vec![prop.clone(), car(x, speed)];
        let mut course = Course::with_cars(maps::two_lanes(), 1, cars);
        let waits = drive_at_prop(&mut course, "static.prop.streetbarrier", 40);
        let passed = course.cars[1].position;
        assert!(passed.x > 330.0 || passed.y > 10.0, "from {x} m: it stands at {passed}");
        assert_eq!((waits, course.cars[1].longest_stand_s < 1.5), (vec![], true), "from {x} m");
    }
}

#[test]
fn a_vehicle_that_waited_behind_a_prop_passes_it_when_the_lane_beside_is_free() {
    let prop = Car { parked: true, ..car(300.0, 0.0) };
    let beside =
        |x: f32| Car { position: Vec3::new(x, -5.25, 0.0), parked: true, ..Car::default() };
    let cars = vec![prop, car(250.0, 5.0), beside(275.0), beside(285.0), beside(295.0)];
    let mut course = Course::with_cars(maps::two_lanes(), 1, cars);
    let waits = drive_at_prop(&mut course, "static.prop.streetbarrier", 40);
    assert!(course.cars[1].position.x < 300.0 && course.cars[1].speed < 0.1);
    let wait = crate::PropWait { vehicle: 2, prop: 1, has_lane_beside: true };
    assert_eq!(waits, [wait], "one report for one wait");
    for parked in &mut course.cars[2..] {
        parked.position.y = -500.0;
    }
    drive_at_prop(&mut course, "static.prop.streetbarrier", 30);
    let passed = course.cars[1].position;
    assert!(passed.x > 320.0, "it stands at {passed}");
}

const CONE: &str = "static.prop.trafficcone01";
const LORRY: &str = "static.prop.trafficwarning";

#[test]
fn a_cone_at_the_edge_of_the_lane_is_passed_within_the_lane() {
    // The lane reaches from -3.5 to 0.
    for (y, speed, x) in [(-3.2, 10.0, 100.0), (-3.2, 0.0, 190.0), (-0.3, 10.0, 100.0)] {
        let cars = vec![prop(200.0, y), car(x, speed), oncoming(260.0, 0.0)];
        let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
        course.cars[2].parked = true;
        let drive = drive(&mut course, CONE, 40);
        let at = format!("cone at {y}, from {x} m");
        assert_eq!(drive.waits, [], "{at}");
        assert!(course.cars[1].position.x > 300.0, "{at}: it stands at {:?}", course.cars[1]);
        assert!(course.cars[1].longest_stand_s < 2.0, "{at}");
        assert!((0.4..0.8).contains(&drive.clearance_m), "{at}: {} m", drive.clearance_m);
        let (right, left) = (drive.low_y - CAR.half_width_m, drive.high_y + CAR.half_width_m);
        assert!(right > -3.5 && left < 0.0, "{at}: from {right} to {left}");
        let end = drive.track.last().unwrap();
        assert!((end.y + 1.75).abs() < 0.1, "{at}: it returns to {end}");
    }
}

#[test]
fn a_large_prop_is_passed_over_the_free_oncoming_lane() {
    for (network, least_s, most_s) in
        [(maps::straight(1000.0), 0.0, 4.0), (maps::straight_with_solid_line(1000.0), 5.0, 10.0)]
    {
        let cars = vec![prop(200.0, -1.75), car(100.0, 10.0)];
        let mut course = Course::with_cars(network, 1, cars);
        let drive = drive(&mut course, LORRY, 60);
        assert_eq!(drive.waits, [], "it waits no longer than it must");
        let stood_s = course.cars[1].longest_stand_s;
        assert!((least_s..most_s).contains(&stood_s), "{stood_s} s, at least {least_s}");
        assert!(drive.clearance_m > 0.35, "{} m", drive.clearance_m);
        assert!(drive.high_y + CAR.half_width_m < 3.5, "on the carriageway: {}", drive.high_y);
        assert!(course.cars[1].position.x > 300.0, "{:?}", course.cars[1]);
        let back = drive.track.iter().find(|at| at.x > 250.0).unwrap();
        assert!((back.y + 1.75).abs() < 0.2, "it is back at {back}");
        let end = drive.track.last().unwrap();
        assert!((end.y + 1.75).abs() < 0.1, "it keeps its lane: {end}");
    }
}

#[test]
fn a_large_prop_is_not_passed_while_a_vehicle_comes() {
    let cars = vec![prop(200.0, -1.75), car(170.0, 0.0), oncoming(330.0, 13.0)];
    let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
    let mut met = None;
    for _ in 0..40 {
        let drive = drive(&mut course, LORRY, 1);
        let [_, own, other] = &course.cars[..] else { unreachable!("three") };
        if other.position.x > own.position.x {
            assert!(drive.high_y < -0.9, "it pulls out before {other:?}");
        } else if met.is_none() {
            met = Some((own.position.x, other.longest_stand_s));
        }
    }
    let (own_x, stood_s) = met.expect("the oncoming vehicle passes");
    assert!(own_x < 190.0 && stood_s == 0.0, "{own_x}, the oncoming vehicle stood {stood_s} s");
    let own = &course.cars[1];
    assert!(own.position.x > 220.0, "it passes the prop afterwards: {own:?}");
    // A vehicle that stands at a prop on the other lane does not come.
    let cars = vec![prop(200.0, -1.75), car(180.0, 0.0), oncoming(300.0, 0.0), prop(280.0, 1.75)];
    let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
    for _ in 0..20 * 60 {
        make_prop(&mut course, 0, LORRY);
        make_prop(&mut course, 3, LORRY);
        course.tick();
    }
    let [_, east, west, _] = &course.cars[..] else { unreachable!("four") };
    assert!(east.position.x > 300.0 && west.position.x < 180.0, "{east:?} {west:?}");
}

#[test]
fn a_vehicle_waits_behind_props_that_it_cannot_pass_and_drives_over_flat_ones() {
    let drive = |blueprint: &str| {
        let cars = vec![prop(200.0, -1.75), car(100.0, 10.0), prop(201.0, 1.75)];
        let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
        let mut waits = Vec::new();
        for _ in 0..20 * 40 {
            make_prop(&mut course, 0, blueprint);
            make_prop(&mut course, 2, blueprint);
            course.tick();
            waits.extend_from_slice(course.planner.new_prop_waits());
        }
        (waits, course.cars[1].position.x)
    };
    let (waits, x) = drive("static.prop.streetbarrier");
    assert_eq!(waits, [crate::PropWait { vehicle: 2, prop: 1, has_lane_beside: false }]);
    assert!((180.0..195.0).contains(&x), "{x}");
    let (waits, x) = drive("static.prop.dirtdebris01");
    assert_eq!(waits, []);
    assert!(x > 400.0, "{x}");
}

#[test]
fn a_vehicle_that_must_not_change_lanes_stays_on_its_side() {
    let cars = vec![prop(200.0, -1.75), car(100.0, 10.0)];
    let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
    make_prop(&mut course, 0, LORRY);
    course.tick_with(&[super::params::turned(param::CHANGES_LANES, 0.0)]);
    let drive = drive(&mut course, LORRY, 40);
    assert!(drive.high_y < -1.6 && course.cars[1].position.x < 195.0, "{:?}", course.cars[1]);
}

#[test]
fn a_planner_restored_beside_a_prop_continues_with_the_same_bits() {
    let cars = vec![prop(200.0, -1.75), car(150.0, 10.0)];
    let mut course = Course::with_cars(maps::straight(1000.0), 1, cars);
    make_prop(&mut course, 0, LORRY);
    course.tick_with(&[super::params::turned(param::LAMPS, 1.0)]);
    let mut shown = 0;
    while course.cars[1].position.x < 195.0 {
        drive(&mut course, LORRY, 1);
        shown |= course.planner.controls()[0].lamps;
        assert!(course.time_s() < 60.0, "it passes the prop: {:?}", course.cars[1]);
    }
    assert!(shown & lamp::LEFT_BLINKER != 0, "it indicates that it pulls out");
    let mut second = Planner::new(course.network.clone(), 9);
    second.restore(&course.planner.save()).unwrap();
    for _ in 0..400 {
        make_prop(&mut course, 0, LORRY);
        course.planner.plan(DELTA_NANOS, &course.actors, &[]);
        second.plan(DELTA_NANOS, &course.actors, &[]);
        assert!(course.planner.save() == second.save());
        course.advance();
    }
    assert!(course.cars[1].position.x > 220.0);
}
