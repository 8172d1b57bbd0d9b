//! Vehicles follow the routes that clients command.

use glam::{Vec2, Vec3};
use protocol::{
    ActorId, Command, JournalEntry, Name, Outcome, RawCommand, RouteCommand, RouteStep, lamp,
    param, route_step,
};
use road::{LaneIndex, LaneTypes};

use super::course::{Course, DELTA_NANOS};
use super::maps;
use crate::Planner;

/// Returns journal entries that command a route to the only car.
fn commands(steps: &[RouteStep]) -> Vec<JournalEntry> {
    commands_to(ActorId(1), steps)
}

/// Returns journal entries that command a route to a vehicle.
pub(super) fn commands_to(vehicle: ActorId, steps: &[RouteStep]) -> Vec<JournalEntry> {
    let line = |guide: RouteCommand| JournalEntry {
        client: Name::new("test"),
        sequence: 1,
        command: RawCommand::from(Command::RouteCommand(guide)),
        outcome: Outcome::done(0),
    };
    RouteCommand::route(vehicle, steps).into_iter().map(line).collect()
}

/// Creates a town with one car, on the `nth` of its spawn points.
fn alone(nth: usize, seed: u64) -> Course {
    let network = maps::town();
    let points = network.spawn_points();
    let at = network.place(points[nth % points.len()]);
    let car = super::course::Car {
        position: at.position.as_vec3(),
        yaw: at.heading_rad as f32,
        ..Default::default()
    };
    Course::with_cars(network, seed, vec![car])
}

/// Returns the change of heading of the only car in each junction that it passed, radians.
fn turned(course: &mut Course, first: &[JournalEntry], junctions: usize) -> Vec<f32> {
    let (mut all, mut into) = (Vec::new(), None);
    for tick in 0..20 * 600 {
        course.tick_with(if tick == 0 { first } else { &[] });
        let lane = course.planner.vehicle_plans().next().expect("the car is on a road").lane;
        let yaw = course.cars[0].yaw;
        match (into, course.network.lane(LaneIndex(lane.0)).junction) {
            (None, Some(_)) => into = Some(yaw),
            (Some(before), None) => {
                all.push(Vec2::from_angle(before).angle_to(Vec2::from_angle(yaw)));
                into = None;
            }
            _ => {}
        }
        if all.len() == junctions {
            break;
        }
    }
    all
}

#[test]
fn a_turn_is_taken_wherever_the_junction_offers_it() {
    let (mut left, mut right) = (0, 0);
    for nth in 0..24 {
        for (kind, side) in [(route_step::LEFT, 1.0), (route_step::RIGHT, -1.0)] {
            let mut course = alone(7 * nth, 5);
            let lane =
                course.network.nearest(course.cars[0].position.as_dvec3(), LaneTypes::DRIVABLE);
            let from = lane.expect("a spawn point").lane.0;
            let offered = crate::client_route::offers(kind, from, &course.planner.map.tracks);
            let turn = turned(&mut course, &commands(&[RouteStep::turn(kind)]), 1);
            assert_eq!(turn.len(), 1, "spawn point {}: no junction in ten minutes", 7 * nth);
            if offered {
                assert!(turn[0] * side > 0.5, "spawn point {}: {} rad", 7 * nth, turn[0]);
                *(if side > 0.0 { &mut left } else { &mut right }) += 1;
            }
        }
    }
    assert!(left > 8 && right > 8, "{left} and {right} junctions offer the turn");
}

#[test]
fn a_vehicle_indicates_before_it_turns() {
    let (mut left, mut right) = (0, 0);
    for nth in 0..12 {
        let mut course = alone(7 * nth, 5);
        let lamps = super::params::turned(param::LAMPS, 1.0);
        let steps = [route_step::LEFT, route_step::RIGHT, route_step::LEFT].map(RouteStep::turn);
        let mut lines = [vec![lamps], commands(&steps)].concat();
        let (mut shown, mut into) = (0, None);
        for _ in 0..20 * 240 {
            course.tick_with(&std::mem::take(&mut lines));
            let lane = course.planner.vehicle_plans().next().expect("the car is on a road").lane;
            let yaw = course.cars[0].yaw;
            match (into, course.network.lane(LaneIndex(lane.0)).junction) {
                (None, Some(_)) => into = Some((yaw, shown)),
                (Some((before, lamps)), None) => {
                    let turn = Vec2::from_angle(before).angle_to(Vec2::from_angle(yaw));
                    if turn.abs() > 0.8 {
                        let side =
                            if turn > 0.0 { lamp::LEFT_BLINKER } else { lamp::RIGHT_BLINKER };
                        let both = lamp::LEFT_BLINKER | lamp::RIGHT_BLINKER;
                        assert_eq!(lamps & both, side, "spawn point {}: {turn} rad", 7 * nth);
                        *(if turn > 0.0 { &mut left } else { &mut right }) += 1;
                    }
                    into = None;
                }
                _ => {}
            }
            shown = course.planner.controls()[0].lamps;
        }
    }
    assert!(left > 10 && right > 10, "{left} and {right} turns");
}

#[test]
fn turns_are_taken_one_after_the_other() {
    // Around a block, with four right turns.
    let mut rounds = 0;
    for nth in 0..12 {
        let mut course = alone(11 * nth, 3);
        let turns = turned(&mut course, &commands(&[RouteStep::turn(route_step::RIGHT); 4]), 4);
        rounds += u32::from(turns.len() == 4 && turns.iter().all(|&turn| turn < -0.5));
    }
    assert!(rounds >= 3, "{rounds} of 12 drove around the block");
}

/// Returns the least distance of the only car to each position, in order.
fn passed(course: &mut Course, places: &[Vec3], lines: &[JournalEntry]) -> Vec<f32> {
    let mut nearest = vec![f32::INFINITY; places.len()];
    let mut at = 0;
    for tick in 0..20 * 1500 {
        course.tick_with(if tick == 0 { lines } else { &[] });
        let distance = course.cars[0].position.distance(places[at]);
        nearest[at] = nearest[at].min(distance);
        // The car has passed the position.
        let has_passed = distance > nearest[at] + 3.0;
        if nearest[at] < 4.0 && has_passed {
            at += 1;
        }
        if at == places.len() {
            break;
        }
    }
    nearest
}

#[test]
fn positions_are_passed_in_their_order() {
    for nth in 0..6 {
        let mut course = alone(13 * nth, 9);
        let points = course.network.spawn_points();
        let places: Vec<Vec3> = (1..=15)
            .map(|k| points[(13 * nth + 29 * k) % points.len()])
            .map(|point| course.network.place(point).position.as_vec3())
            .collect();
        let steps: Vec<RouteStep> = places.iter().map(|&at| RouteStep::place(at)).collect();
        let nearest = passed(&mut course, &places, &commands(&steps));
        // At most from the neighbouring lane, where there was no room for a lane change.
        assert!(nearest.iter().all(|&m| m < 4.0), "spawn point {}: {nearest:?}", 13 * nth);
        let exact = nearest.iter().filter(|&&m| m < 1.0).count();
        assert!(exact >= 12, "spawn point {}: {nearest:?}", 13 * nth);
    }
}

#[test]
fn a_planner_restored_during_a_route_continues_it() {
    let mut course = alone(0, 9);
    let steps = [route_step::LEFT, route_step::RIGHT, route_step::STRAIGHT, route_step::LEFT]
        .map(RouteStep::turn);
    course.tick_with(&commands(&steps));
    (0..300).for_each(|_| course.tick());
    let mut second = Planner::new(course.network.clone(), 1);
    second.restore(&course.planner.save()).expect("the planner restores its own state");
    let truncated = {
        let mut bytes = course.planner.save();
        let end = bytes.len() - 4;
        bytes.truncate(end);
        Planner::new(course.network.clone(), 1).restore(&bytes)
    };
    assert!(truncated.is_err(), "a truncated client route is refused");
    for _ in 0..1200 {
        course.planner.plan(DELTA_NANOS, &course.actors, &[]);
        second.plan(DELTA_NANOS, &course.actors, &[]);
        assert!(course.planner.save() == second.save());
        course.advance();
    }
}

#[test]
fn a_vehicle_whose_route_is_cleared_turns_at_random() {
    let mut uncommanded = alone(5, 2);
    let mut course = alone(5, 2);
    let turn = commands(&[RouteStep::turn(route_step::LEFT); 20]);
    course.tick_with(&[turn, commands(&[])].concat());
    uncommanded.tick();
    for _ in 0..400 {
        course.tick();
        uncommanded.tick();
    }
    assert!(
        course.planner.save() == uncommanded.planner.save(),
        "the same state as without commands"
    );
}

#[test]
fn a_vehicle_on_a_route_changes_lanes_to_pass_a_prop_and_continues_its_route() {
    let on_lane = |x: f32| Vec3::new(x, -1.75, 0.0);
    let prop = super::course::Car { position: on_lane(300.0), parked: true, ..Default::default() };
    let car = super::course::Car { position: on_lane(100.0), speed: 10.0, ..Default::default() };
    let mut course = Course::with_cars(maps::two_lanes(), 1, vec![prop, car]);
    let target = RouteStep::place(on_lane(480.0));
    course.tick_with(&commands_to(ActorId(2), &[target]));
    let waits = super::passing::drive_at_prop(&mut course, "static.prop.streetbarrier", 25);
    let passed = course.cars[1].position;
    assert!(passed.x > 330.0 && waits.is_empty(), "it stands at {passed}, {waits:?}");
    for _ in 0..20 * 60 {
        if course.cars[1].position.x > 479.0 {
            break;
        }
        super::passing::drive_at_prop(&mut course, "static.prop.streetbarrier", 1);
    }
    assert!((course.cars[1].position.y + 1.75).abs() < 1.0, "{}", course.cars[1].position);
}
