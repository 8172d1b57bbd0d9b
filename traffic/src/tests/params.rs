//! Vehicles drive by the parameters that clients set.

use glam::Vec3;
use protocol::{
    ActorId, Command, JournalEntry, Name, Outcome, RawCommand, TrafficParam, Weather, lamp, param,
};

use super::course::{Car, Course};
use super::maps;

/// Returns a journal entry that sets a parameter of all vehicles.
pub(super) fn turned(param: u32, value: f32) -> JournalEntry {
    turned_for(0, param, value)
}

pub(super) fn turned_for(actor: u32, param: u32, value: f32) -> JournalEntry {
    let param = TrafficParam { actor_id: ActorId(actor), param, value };
    JournalEntry {
        client: Name::new("test"),
        sequence: 1,
        command: RawCommand::from(Command::TrafficParam(param)),
        outcome: Outcome::done(0),
    }
}

fn car(x: f32, y: f32, speed: f32) -> Car {
    Car { position: Vec3::new(x, y, 0.0), speed, ..Car::default() }
}

/// Runs one vehicle on lane -1 for some seconds after these commands.
fn alone(lines: &[JournalEntry], seconds: usize) -> Course {
    let mut course = Course::with_cars(maps::two_lanes(), 1, vec![car(10.0, -1.75, 10.0)]);
    course.tick_with(lines);
    (0..20 * seconds).for_each(|_| course.tick());
    course
}

#[test]
fn a_fixed_speed_holds_until_a_speed_reduction_is_set() {
    let commands = [turned_for(1, param::SPEED_MPS, 20.0)];
    let mut course = alone(&commands, 20);
    assert!((course.cars[0].speed - 20.0).abs() < 1.0, "{}", course.cars[0].speed);
    course.tick_with(&[turned_for(1, param::SPEED_REDUCTION, 0.5)]);
    (0..20 * 12).for_each(|_| course.tick());
    assert!((course.cars[0].speed - 25.0 / 3.6).abs() < 0.7, "{}", course.cars[0].speed);
}

#[test]
fn a_vehicle_with_a_fixed_speed_of_zero_stands_even_askew_before_an_obstacle() {
    let obstacle = Car { parked: true, ..car(20.0, -1.75, 0.0) };
    for yaw in [0.0, 0.8] {
        for gap_m in [0.3, 20.0] {
            let own = Car { yaw, ..car(15.0 - gap_m, -1.75, 0.0) };
            let cars = vec![own, obstacle.clone()];
            let mut course = Course::with_cars(maps::two_lanes(), 1, cars);
            course.tick_with(&[turned_for(1, param::SPEED_MPS, 0.0)]);
            (0..20 * 30).for_each(|_| course.tick());
            let own = &course.cars[0];
            assert!(own.driven_m < 0.01, "{yaw} rad, {gap_m} m: drove {} m", own.driven_m);
            assert_eq!((own.throttle, own.speed), (0.0, 0.0), "{yaw} rad, {gap_m} m");
        }
    }
}

#[test]
fn a_lateral_offset_is_driven() {
    for offset in [0.6, -0.4] {
        let course = alone(&[turned(param::OFFSET_LEFT_M, offset)], 12);
        let y = course.cars[0].position.y;
        assert!((y + 1.75 - offset).abs() < 0.1, "{offset}: {y}");
    }
}

#[test]
fn a_commanded_lane_change_is_made_once_and_at_once() {
    let mut course = alone(&[turned_for(1, param::CHANGE_NOW, -1.0)], 8);
    assert!((course.cars[0].position.y + 5.25).abs() < 0.2, "{:?}", course.cars[0].position);
    // There is no lane on its right: the command waits until the opposite command replaces it.
    course.tick_with(&[turned_for(1, param::CHANGE_NOW, -1.0)]);
    (0..20).for_each(|_| course.tick());
    assert!((course.cars[0].position.y + 5.25).abs() < 0.2);
    course.tick_with(&[turned_for(1, param::CHANGE_NOW, 1.0)]);
    (0..20 * 8).for_each(|_| course.tick());
    assert!((course.cars[0].position.y + 1.75).abs() < 0.2, "{:?}", course.cars[0].position);
}

#[test]
fn a_vehicle_behind_on_the_lane_that_is_left_is_not_ahead_after_a_curve() {
    // Beyond the curve, the outer lane is 8 m longer than its share of the whole length.
    let car = |x: f32, speed: f32| {
        let position = Vec3::new(x, 65.25, 0.0);
        Car { position, yaw: std::f32::consts::PI, speed, ..Car::default() }
    };
    let cars = vec![car(-10.0, 3.0), Car { parked: true, ..car(-3.5, 0.0) }];
    let mut course = Course::with_cars(maps::curve_before_straight(), 1, cars);
    course.tick_with(&[turned_for(1, param::CHANGE_NOW, 1.0)]);
    (0..20 * 15).for_each(|_| course.tick());
    let at = course.cars[0].position;
    assert!(at.x < -60.0 && (at.y - 61.75).abs() < 0.2, "{at}");
}

#[test]
fn a_commanded_lane_change_is_not_repeated() {
    let mut course = alone(&[turned_for(1, param::CHANGE_NOW, -1.0)], 8);
    // A random change brings it back to the left, where it stays.
    course.tick_with(&[turned_for(1, param::CHANGE_LEFT, 1.0)]);
    (0..20 * 14).for_each(|_| course.tick());
    for _ in 0..20 * 6 {
        course.tick();
        assert!((course.cars[0].position.y + 1.75).abs() < 0.2, "{:?}", course.cars[0].position);
    }
}

#[test]
fn a_probability_causes_random_lane_changes() {
    let right = alone(&[turned(param::KEEP_RIGHT, 1.0)], 8);
    assert!((right.cars[0].position.y + 5.25).abs() < 0.2, "{:?}", right.cars[0].position);
    let never = alone(&[turned(param::KEEP_RIGHT, 0.0)], 8);
    assert!((never.cars[0].position.y + 1.75).abs() < 0.2, "{:?}", never.cars[0].position);
}

/// Runs a slow vehicle on lane -1 and a fast one behind it.
fn behind_a_slow_vehicle(lines: &[JournalEntry], seconds: usize) -> Course {
    let cars = vec![car(70.0, -1.75, 2.0), car(20.0, -1.75, 12.0)];
    let mut course = Course::with_cars(maps::two_lanes(), 1, cars);
    let mut all =
        vec![turned_for(1, param::SPEED_MPS, 2.0), turned_for(1, param::CHANGES_LANES, 0.0)];
    all.extend_from_slice(lines);
    course.tick_with(&all);
    (0..20 * seconds).for_each(|_| course.tick());
    course
}

#[test]
fn a_vehicle_that_may_not_change_lanes_stays_behind() {
    let free = behind_a_slow_vehicle(&[], 25);
    assert!(free.cars[1].position.x > free.cars[0].position.x, "it overtakes");
    let confined = behind_a_slow_vehicle(&[turned_for(2, param::CHANGES_LANES, 0.0)], 25);
    assert!(confined.cars[1].position.x < confined.cars[0].position.x, "it follows");
    assert_eq!(confined.collisions, []);
}

#[test]
fn a_vehicle_collides_with_what_it_ignores() {
    let stays = turned_for(2, param::CHANGES_LANES, 0.0);
    let all = turned_for(2, param::IGNORE_VEHICLES, 1.0);
    assert_ne!(behind_a_slow_vehicle(&[stays, all], 15).collisions, []);
    let one = turned_for(2, param::IGNORE_ACTOR + 1, 1.0);
    assert_ne!(behind_a_slow_vehicle(&[stays, one], 15).collisions, []);
    // The parameter for one agent has precedence over the fraction.
    let but = turned_for(2, param::IGNORE_ACTOR + 1, 0.0);
    assert_eq!(behind_a_slow_vehicle(&[stays, all, but], 15).collisions, []);
    let walkers = turned_for(2, param::IGNORE_WALKERS, 1.0);
    assert_eq!(behind_a_slow_vehicle(&[stays, walkers], 15).collisions, []);
}

/// Returns a journal entry that sets the weather.
fn weather_entry(weather: Weather) -> JournalEntry {
    JournalEntry { command: RawCommand::from(Command::SetWeather(weather)), ..turned(0, 0.0) }
}

/// Returns the lights that the first vehicle switches.
fn lamps(course: &Course) -> u32 {
    course.planner.controls()[0].lamps
}

#[test]
fn lights_follow_the_weather_and_the_pedals() {
    let mut course = alone(&[], 1);
    assert_eq!(lamps(&course), 0, "lights are off by default");
    course.tick_with(&[turned_for(1, param::LAMPS, 1.0)]);
    assert_eq!(lamps(&course), lamp::SWITCHED, "a clear afternoon");
    course.tick_with(&[weather_entry(Weather { sun_altitude_rad: -0.3, ..Weather::default() })]);
    let night = lamp::SWITCHED | lamp::POSITION | lamp::LOW_BEAM;
    assert_eq!(lamps(&course), night);
    let mut second = crate::Planner::new(course.network.clone(), 1);
    second.restore(&course.planner.save()).expect("the planner restores its own state");
    second.plan(super::course::DELTA_NANOS, &course.actors, &[]);
    assert_eq!(second.controls()[0].lamps, night, "a restored planner has the weather");
    course.tick_with(&[weather_entry(Weather { fog_density: 60.0, ..Weather::default() })]);
    assert_eq!(lamps(&course), night | lamp::FOG);
    course.tick_with(&[weather_entry(Weather::default()), turned_for(1, param::SPEED_MPS, 0.0)]);
    course.tick();
    assert_eq!(lamps(&course), lamp::SWITCHED | lamp::BRAKE);
    course.tick_with(&[turned_for(1, param::LAMPS, 0.0)]);
    assert_eq!(lamps(&course), 0);
}

#[test]
fn a_vehicle_indicates_its_lane_change() {
    let lines = [turned_for(1, param::LAMPS, 1.0), turned_for(1, param::CHANGE_NOW, -1.0)];
    let mut course = Course::with_cars(maps::two_lanes(), 1, vec![car(10.0, -1.75, 10.0)]);
    course.tick_with(&lines);
    (0..20).for_each(|_| course.tick());
    assert_eq!(lamps(&course), lamp::SWITCHED | lamp::RIGHT_BLINKER);
    (0..20 * 7).for_each(|_| course.tick());
    assert_eq!(lamps(&course) & lamp::RIGHT_BLINKER, 0, "the change has ended");
    course.tick_with(&[turned_for(1, param::CHANGE_NOW, 1.0)]);
    (0..20).for_each(|_| course.tick());
    assert_eq!(lamps(&course), lamp::SWITCHED | lamp::LEFT_BLINKER);
}

#[test]
fn a_seed_that_is_set_decides_the_turns() {
    let positions = |lines: &[JournalEntry]| {
        let mut course = Course::new(maps::town(), 7, 20);
        course.tick_with(lines);
        (0..600).for_each(|_| course.tick());
        course.cars.iter().map(|car| car.position.to_array()).collect::<Vec<_>>()
    };
    let set = |seed: f32| positions(&[turned(param::SEED, seed)]);
    assert!(set(42.0) == set(42.0), "the same seed");
    assert!(set(42.0) != set(43.0), "another seed");
    assert!(set(42.0) != positions(&[]), "the default seed");
}
