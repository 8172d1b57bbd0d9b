//! Vehicles that meet in a bend of a two-way road, at least one of them wide: where the swept paths of
//! both overlap, they pass one after the other.
//!
//! A vehicle that is in the overlap goes first; else one that could not stop before it, if the other
//! one can; else one that stands and waits for oncoming vehicles, so that no queue passes as a whole while
//! it waits; else the one with the lower actor id. Of two that are in each other's way already, one that
//! waits at a line, or in the queue there, yields: it cannot go yet. The other one stops before the whole way of the
//! first, so that it stands in no place that the first still has to sweep over. All is decided for
//! both at once, so that they never disagree.

use glam::Vec2;

use crate::{
    agents::Agents,
    leader::Leader,
    map::Map,
    obstacles::{Course, Footprint, Obstacle, across},
    occupancy::Occupancy,
    route,
    spread::Spread,
    tracks::NONE,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Clearance between the two: somewhat more than conflict areas leave, because neither is exactly on its line.
const MARGIN_M: f32 = 0.2;
/// Step of the prediction along both routes.
const STEP_M: f32 = 2.0;
/// Most that the middle of a vehicle moves in a step: its rear swings less than its tracking point.
const STRIDE_M: f32 = 1.3 * STEP_M;
/// Radii of bends above which two wide vehicles, and a wide one and a car, stay apart on lanes of 3.5 m:
/// a bus of 10 m sweeps over 31 m² / radius beyond its width, 27 m² / radius beside a car.
const RADIUS_MAX_M: f32 = 100.0;
const CAR_RADIUS_MAX_M: f32 = 35.0;
/// Step in which bends are looked for.
const BEND_STEP_M: f32 = 5.0;
/// Distance between the two from which on they are examined, and the time to meet added to it.
const NEAR_M: f32 = 25.0;
const NEAR_S: f32 = 5.0;
/// Farthest distance along a route at which others are looked for.
const REACH_M: f32 = 110.0;
/// Way along a bend by its chord: that of a quarter circle is 1.11.
const WAY_BY_CHORD: f32 = 1.3;
/// Length of the ways beyond the place where both meet.
const BEYOND_M: f32 = 12.0;
/// Deceleration with which a vehicle stops before the overlap.
const BRAKE_MPS2: f32 = 3.0;
/// Longest queue that is followed to its line.
const QUEUE_LEN_MAX: usize = 8;
/// A vehicle slower than this stands.
const MOVING_MPS: f32 = 0.2;

/// Adds to `found`, which is sorted by row, the ways of vehicles that come towards others which yield.
pub(crate) fn find(
    vehicles: &VehicleTable,
    map: &Map,
    agents: &Agents,
    occupancy: &Occupancy,
    spread: Spread,
    found: &mut Vec<Obstacle>,
) {
    let mut ways = Vec::new();
    spread.list(vehicles.len(), &mut ways, |row, ways| {
        if agents.body[agents.driven[row] as usize].is_wide() && follows_lane(&vehicles[row]) {
            let others = oncoming(vehicles, row, map, agents, occupancy);
            ways.extend(others.filter_map(|other| yielding(vehicles, [row, other], map, agents)));
        }
    });
    if !ways.is_empty() {
        found.append(&mut ways);
        found.sort_by_key(|obstacle| obstacle.row);
    }
}

/// Returns whether the course of a vehicle is that of its lane.
fn follows_lane(vehicle: &Vehicle) -> bool {
    vehicle.located == 1 && vehicle.u_turn == 0 && !vehicle.passes_prop()
}

/// Returns the rows that come towards a wide vehicle on the lanes beside its route; of two wide
/// vehicles only from the first row to the second.
fn oncoming<'a>(
    vehicles: &'a VehicleTable,
    row: usize,
    map: &'a Map,
    agents: &'a Agents,
    occupancy: &'a Occupancy,
) -> impl Iterator<Item = usize> + 'a {
    let (own, lanes) = (agents.driven[row], vehicles[row].route.lanes());
    let mut begins_m = -vehicles[row].arc_m;
    let near = lanes.iter().take_while(move |&&lane| {
        let is_near = begins_m < REACH_M;
        begins_m += map.tracks.length(lane);
        is_near
    });
    let beside = near.map(|&lane| map.beside.oncoming[lane as usize]).filter(|&lane| lane != NONE);
    beside.flat_map(move |lane| {
        let comes = move |other: usize| {
            let vehicle = &vehicles[other];
            let passes = |&ahead: &u32| {
                let here = map.beside.oncoming[ahead as usize];
                here != NONE && lanes.iter().take(2).any(|&own| own == here)
            };
            vehicle.route.lane() == lane
                && follows_lane(vehicle)
                && vehicle.route.lanes().iter().any(passes)
        };
        let rows = occupancy.on(lane).iter().filter(move |occupant| {
            let other = occupant.agent;
            let is_first = row < agents.row[other as usize] as usize;
            agents.row[other as usize] != NONE
                && (is_first || !agents.body[other as usize].is_wide())
                && occupancy.reacts_to(own, other)
                && occupancy.reacts_to(other, own)
        });
        rows.map(|occupant| agents.row[occupant.agent as usize] as usize)
            .filter(move |&other| comes(other))
    })
}

/// Returns the way of one of two rows as an obstacle of the other, which yields; `None` if neither does.
fn yielding(
    vehicles: &VehicleTable,
    rows: [usize; 2],
    map: &Map,
    agents: &Agents,
) -> Option<Obstacle> {
    let both = rows.map(|row| agents.driven[row] as usize);
    let [place, other_place] = both.map(|agent| agents.position[agent]);
    let speeds_mps = both.map(|agent| agents.velocity[agent].length());
    let to = other_place - place;
    let apart_m = to.truncate().length();
    let have_passed = to.truncate().dot(agents.forward[both[0]]) < 0.0
        && to.truncate().dot(agents.forward[both[1]]) > 0.0;
    if apart_m > NEAR_M + NEAR_S * (speeds_mps[0] + speeds_mps[1])
        || to.z.abs() > 3.0
        || have_passed
    {
        return None;
    }
    let way_m = WAY_BY_CHORD * apart_m + BEYOND_M;
    let are_wide = both.iter().all(|&agent| agents.body[agent].is_wide());
    let radius_m = if are_wide { RADIUS_MAX_M } else { CAR_RADIUS_MAX_M };
    let is_bend = |step: usize| {
        let (lane, arc_m) =
            route::ahead(&vehicles[rows[0]], &map.tracks, step as f32 * BEND_STEP_M);
        map.tracks.curvature_at(lane, arc_m).abs() * radius_m > 1.0
    };
    if !(0..=(way_m / BEND_STEP_M) as usize).any(is_bend) {
        return None;
    }
    let ways = rows.map(|row| way_of(vehicles, row, map, agents, way_m));
    let first = [first_touch(&ways[0], &ways[1])?, first_touch(&ways[1], &ways[0])?];
    let enters_m = first.map(|step| step as f32 * STEP_M);
    // Where reservations give the right of way, nothing is added to them.
    let is_reserved = [0, 1].into_iter().any(|side| {
        let (lane, _) = route::ahead(&vehicles[rows[side]], &map.tracks, enters_m[side]);
        map.tracks.in_zone(lane)
    });
    if is_reserved {
        return None;
    }
    let yields = match first.map(|step| step == 0) {
        [true, false] => 1,
        [false, true] => 0,
        [true, true] => in_overlap(vehicles, rows, agents),
        [false, false] => {
            let wait = rows.map(|row| waits_for_oncoming(vehicles, row, map));
            before_overlap(vehicles, rows, speeds_mps, enters_m, wait)?
        }
    };
    let other = both[1 - yields];
    let stop_m = (enters_m[yields] - STEP_M).max(0.0);
    let own = agents.driven[rows[yields]] as usize;
    let towards = (agents.position[other] - agents.position[own]).truncate();
    // It waits in its lane, which is no reason to drive back, unless the other one cannot pass.
    let is_in_way = first[yields] == 0 && !waits_at_line(vehicles, rows[yields], agents);
    let aligned = if is_in_way { -1.0 } else { 1.0 };
    Some(Obstacle {
        row: rows[yields],
        leader: Leader { gap_m: stop_m, speed_mps: 0.0, agent: other as u32, aligned },
        away: across(agents.forward[own], towards),
    })
}

/// Returns which of two rows yields before the overlap of their ways, by which of them wait for an oncoming
/// vehicle; `None` if both stand, since either may find its way free first.
fn before_overlap(
    vehicles: &VehicleTable,
    rows: [usize; 2],
    speeds_mps: [f32; 2],
    enters_m: [f32; 2],
    wait: [bool; 2],
) -> Option<usize> {
    let can_stop = [0, 1].map(|side| {
        let room_m = (enters_m[side] - STEP_M).max(0.0);
        speeds_mps[side] * speeds_mps[side] <= 2.0 * BRAKE_MPS2 * room_m
    });
    match speeds_mps.map(|mps| mps < MOVING_MPS) {
        [true, true] => return None,
        // One that stands waits for something else, and the other one may pass it meanwhile; or it waits for
        // those that come towards it, of which the next one lets it go.
        [true, false] => return Some(usize::from(wait[0] && can_stop[1])),
        [false, true] => return Some(usize::from(!(wait[1] && can_stop[0]))),
        [false, false] => {}
    }
    Some(match can_stop {
        [true, false] => 0,
        [false, true] => 1,
        _ => later_id(vehicles, rows),
    })
}

/// Returns whether the leader of a row is a vehicle on the oncoming lane beside its route.
fn waits_for_oncoming(vehicles: &VehicleTable, row: usize, map: &Map) -> bool {
    let leader = vehicles[row].seen_leader;
    let Ok(leader) = vehicles.binary_search_by_key(&leader, |vehicle| vehicle.id) else {
        return false;
    };
    let beside = |lane: &u32| map.beside.oncoming[*lane as usize] == vehicles[leader].route.lane();
    vehicles[row].route.lanes().iter().any(beside)
}

/// Returns which of two rows yields that are in each other's way already: one that waits at a line, until it
/// is granted a reservation, or in the queue there; else the one with the higher actor id.
fn in_overlap(vehicles: &VehicleTable, rows: [usize; 2], agents: &Agents) -> usize {
    match rows.map(|row| waits_at_line(vehicles, row, agents)) {
        [true, false] => 0,
        [false, true] => 1,
        _ => later_id(vehicles, rows),
    }
}

/// Returns whether a vehicle waits for a reservation, or stands in a queue behind one that does.
fn waits_at_line(vehicles: &VehicleTable, row: usize, agents: &Agents) -> bool {
    let mut at = row;
    for _ in 0..QUEUE_LEN_MAX {
        let vehicle = &vehicles[at];
        if vehicle.reservation == 0 && vehicle.wait_s > 0.0 {
            return true;
        }
        let stands = agents.velocity[agents.driven[at] as usize].length() < MOVING_MPS;
        let forward = |row: usize| agents.forward[agents.driven[row] as usize];
        match vehicles.binary_search_by_key(&vehicle.seen_leader, |vehicle| vehicle.id) {
            Ok(leader) if stands && forward(at).dot(forward(leader)) > 0.0 => at = leader,
            _ => return false,
        }
    }
    false
}

/// Returns which of two rows has the higher actor id.
fn later_id(vehicles: &VehicleTable, rows: [usize; 2]) -> usize {
    usize::from(vehicles[rows[1]].id > vehicles[rows[0]].id)
}

/// Returns the footprints of a row from here on, one for each step.
fn way_of(
    vehicles: &VehicleTable,
    row: usize,
    map: &Map,
    agents: &Agents,
    way_m: f32,
) -> Vec<Footprint> {
    let agent = agents.driven[row] as usize;
    let (at, forward) = (agents.position[agent].truncate(), agents.forward[agent]);
    let mut way = vec![Footprint::of(&agents.body[agent], at, forward)];
    let mut course = Course::new(vehicles, row, &map.tracks, agents);
    way.extend((0..(way_m / STEP_M) as usize).map(|_| course.step(STEP_M)));
    way
}

/// Returns the first step of a way at which the vehicle would touch another way.
fn first_touch(way: &[Footprint], other: &[Footprint]) -> Option<usize> {
    way.iter().position(|place| touches(&place.grown(MARGIN_M), other))
}

/// Returns whether a footprint touches a way.
fn touches(place: &Footprint, way: &[Footprint]) -> bool {
    let mut step = 0;
    while let Some(other) = way.get(step) {
        // Footprints of the way that are too far away are skipped.
        let reach_m = place.half.length() + other.half.length();
        let apart_m = Vec2::distance(place.middle, other.middle) - reach_m;
        if apart_m <= 0.0 && place.touches(other) {
            return true;
        }
        step += 1 + (apart_m.max(0.0) / STRIDE_M) as usize;
    }
    false
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use glam::Vec3;

    use super::*;
    use crate::tests::{
        course::{Car, Course},
        maps,
    };

    /// Returns which of two buses yields that stand and face each other: one before a bend, with its
    /// middle this far from it, and one in the bend, at this angle from where it begins. One of them may
    /// wait at a line, or a third one far away.
    fn yields(before_m: f32, angle: f32, at_line: Option<usize>) -> Vec<usize> {
        yields_behind(before_m, angle, at_line, 0)
    }

    /// As [`yields`]; the leader of the first is the vehicle of this id.
    fn yields_behind(before_m: f32, angle: f32, at_line: Option<usize>, leader: u32) -> Vec<usize> {
        let bus = |position: Vec3, yaw: f32| {
            Car { position, yaw, ..Car::default() }.built_as("vehicle.mitsubishi.fusorosa")
        };
        // The bend has a radius of 20 m about (60, 20).
        let on_bend = Vec3::new(60.0 + 18.25 * angle.sin(), 20.0 - 18.25 * angle.cos(), 0.0);
        let before = Vec3::new(60.0 - before_m, -1.75, 0.0);
        let far = bus(Vec3::new(5.0, -1.75, 0.0), 0.0);
        let cars = vec![bus(before, 0.0), bus(on_bend, angle + PI), far];
        let mut course = Course::with_cars(maps::two_way_loop(20.0, 60.0), 1, cars);
        let actors = course.actors.clone();
        course.tick();
        if let Some(row) = at_line {
            course.planner.state.vehicles[row].wait_s = 1.0;
        }
        course.planner.state.vehicles[0].seen_leader = leader;
        let map = course.planner.map.clone();
        let vehicles = &course.planner.state.vehicles;
        let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
        agents.read(&actors, &map.bodies);
        occupancy.rebuild(&map.tracks, &map.grid, &agents, &[], Spread::Alone);
        let mut found = Vec::new();
        find(vehicles, &map, &agents, &occupancy, Spread::Alone, &mut found);
        found.iter().map(|obstacle| obstacle.row).collect()
    }

    #[test]
    fn one_that_waits_for_oncoming_vehicles_lets_no_others_enter_that_can_stop() {
        let mut vehicles = VehicleTable::default();
        vehicles.retain(&[1, 2]);
        let yields = |speed_mps: f32, enters_m: f32, waits: bool| {
            let ways_m = [10.0, enters_m];
            before_overlap(&vehicles, [0, 1], [0.0, speed_mps], ways_m, [waits, false])
        };
        assert_eq!(yields(5.0, 20.0, false), Some(0), "it stands for another reason");
        assert_eq!(yields(5.0, 20.0, true), Some(1));
        assert_eq!(yields(5.0, 5.0, true), Some(0), "the other cannot stop");
        assert_eq!(yields(0.0, 20.0, true), None);
    }

    #[test]
    fn a_vehicle_waits_for_the_oncoming_one_that_it_sees_as_its_leader() {
        let bus = |x: f32, y: f32, yaw: f32| {
            Car { position: Vec3::new(x, y, 0.0), yaw, ..Car::default() }
                .built_as("vehicle.mitsubishi.fusorosa")
        };
        let waits = |cars: Vec<Car>| {
            let mut course = Course::with_cars(maps::two_way_loop(20.0, 60.0), 1, cars);
            course.tick();
            course.tick();
            let planner = &course.planner;
            waits_for_oncoming(&planner.state.vehicles, 0, &planner.map)
        };
        let (sin, cos) = 0.3f32.sin_cos();
        let in_bend = bus(60.0 + 18.25 * sin, 20.0 - 18.25 * cos, 0.3 + PI);
        assert!(waits(vec![bus(46.0, -1.75, 0.0), in_bend]));
        assert!(!waits(vec![bus(30.0, -1.75, 0.0), bus(42.0, -1.75, 0.0)]), "its leader");
    }

    #[test]
    fn a_bus_sees_another_in_the_bend_before_it_while_it_can_stop() {
        let bus = |position: Vec3, yaw: f32, speed: f32| {
            Car { position, yaw, speed, ..Car::default() }.built_as("vehicle.mitsubishi.fusorosa")
        };
        let (sin, cos) = 0.9f32.sin_cos();
        let in_bend = bus(Vec3::new(60.0 + 18.25 * sin, 20.0 - 18.25 * cos, 0.0), 0.9 + PI, 0.0);
        let drives = bus(Vec3::new(12.0, -1.75, 0.0), 0.0, 8.5);
        let mut course =
            Course::with_cars(maps::two_way_loop(20.0, 60.0), 1, vec![in_bend, drives]);
        course.tick();
        let plans: Vec<_> = course.planner.vehicle_plans().collect();
        // It takes 12 m to stop at 3 m/s².
        assert!((12.0..60.0).contains(&plans[1].leader_m), "{} m", plans[1].leader_m);
    }

    #[test]
    fn one_that_stands_yields_to_one_that_stands_in_its_way() {
        assert_eq!(yields(14.0, 0.3, None), [0], "the one in the bend is in the way");
        assert_eq!(yields(5.0, 0.9, None), [1], "the one before it has its front in the bend");
    }

    #[test]
    fn of_two_in_each_others_way_one_that_waits_at_a_line_yields() {
        assert_eq!(yields(5.0, 0.4, None), [1], "the later id yields");
        assert_eq!(yields(5.0, 0.4, Some(0)), [0], "the first cannot go");
        assert_eq!(yields(5.0, 0.4, Some(1)), [1]);
        assert_eq!(yields_behind(5.0, 0.4, Some(2), 3), [0], "the first stands in a queue there");
        assert_eq!(yields_behind(5.0, 0.4, None, 3), [1], "its leader waits at no line");
    }
}
