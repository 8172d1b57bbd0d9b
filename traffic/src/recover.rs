//! Recovery of vehicles that are off their track or blocked: reverse, wait, and return to the lane.

use glam::Vec2;

use crate::{
    agents::Agents,
    car_following::SLOW_DOWN_PER_S,
    leader::Leader,
    obstacles::{self, Footprint},
    route,
    steer::{Deviation, EVASION_COUNT},
    tracks::Tracks,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Cross-track error beyond which a vehicle is off its track.
const CROSS_TRACK_MAX_M: f32 = 1.3;
/// Heading error beyond which a vehicle is off its track.
const HEADING_ERROR_MAX_RAD: f32 = 0.6;
/// Speed limit of a vehicle off its track.
const OFF_TRACK_MPS: f32 = 3.0;
/// Free distance ahead that a standing vehicle off its track needs.
pub(crate) const OFF_TRACK_FREE_M: f32 = 0.4;
/// Speed from which a vehicle off its track brakes by less: it is in a curve, or changes lanes, and
/// would spin.
pub(crate) const FAST_MPS: f32 = 12.0;
/// By how much it brakes then.
pub(crate) const FAST_BRAKE_MPS2: f32 = 1.0;
/// Speed in reverse.
const REVERSE_MPS: f32 = 1.5;
/// Time at standstill after which a vehicle counts as stuck.
const PATIENCE_S: f32 = 3.0;
/// Speed below which a vehicle counts as standing that another one passes.
const STANDING_MPS: f32 = 0.1;
/// Duration of one attempt in reverse.
const REVERSE_S: f32 = 3.0;
/// Least time to wait after reversing.
const HOLD_S: f32 = 4.0;
/// Gap below which a vehicle counts as touching its leader.
const TOUCH_M: f32 = 0.1;
/// Free distance behind that reversing requires.
const BEHIND_M: f32 = 1.5;
/// Clearance of the whole vehicle on its way back, whose corners swing out, and of what is that near already.
const SWING_M: f32 = 0.2;
const TOUCHING_M: f32 = 0.02;
/// Speed of others up to which they are seen in time.
const PASSING_MPS: f32 = 14.0;
/// Time over which the way back is predicted, in steps: for [`BEHIND_M`].
const BACK_STEP_S: f32 = 0.25;
const BACK_STEPS: u32 = 4;
/// The steps of them within which the vehicle can stop: its corners must not meet a walker.
const WALKER_STEPS: u32 = 2;
/// Cosine of the angle to a leader that comes towards a vehicle, at most.
const ONCOMING: f32 = -0.7;
/// Waiting time after which a vehicle drives back even if there is room for half of that way only: less than the gap
/// that queues leave.
const SHORT_BACK_AFTER_S: f32 = 20.0;

/// Returns whether a vehicle is off its track.
pub(crate) fn is_off_track(deviation: &Deviation) -> bool {
    deviation.left_m.abs() > CROSS_TRACK_MAX_M
        || deviation.heading_rad.abs() > HEADING_ERROR_MAX_RAD
}

/// Returns the desired speed of a vehicle off its track.
pub(crate) fn off_track_mps(speed: f32) -> f32 {
    if speed < FAST_MPS { OFF_TRACK_MPS } else { speed - FAST_BRAKE_MPS2 / SLOW_DOWN_PER_S }
}

/// What a vehicle does in this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Maneuver {
    /// Drive normally.
    Forward,
    /// Reverse away from an obstacle.
    Reverse,
    /// Wait after reversing, so that the other vehicle goes first.
    Hold,
}

/// Decides the manoeuvre of a row in this frame.
///
/// `accel` is the acceleration that car following returned, and `back_rad` the angle of the front wheels
/// in reverse. The patience of stuck vehicles depends
/// on their ids, so that of two that block each other one goes first.
pub(crate) fn decide(
    vehicle: &mut Vehicle,
    row: usize,
    (tracks, agents): (&Tracks, &Agents),
    deviation: &Deviation,
    leader: &Leader,
    (accel, back_rad): (f32, f32),
    delta_s: f32,
) -> Maneuver {
    let agent = agents.driven[row] as usize;
    let speed = agents.speed(agent);
    if leader.aligned < ONCOMING {
        // It does not try the side of the vehicle that comes.
        vehicle.reverse_count = vehicle.reverse_count.min(EVASION_COUNT);
    }
    if vehicle.reverse_s < 0.0 {
        vehicle.reverse_s = (vehicle.reverse_s + delta_s).min(0.0);
        return Maneuver::Hold;
    }
    if vehicle.reverse_s > 0.0 {
        vehicle.reverse_s -= delta_s;
        if vehicle.reverse_s > 0.0 && may_back(agents, agent, back_rad, back_steps(vehicle)) {
            return Maneuver::Reverse;
        }
        vehicle.reverse_s = -(HOLD_S + 2.0 * (vehicle.id % 4) as f32);
        return Maneuver::Hold;
    }
    if speed > 2.0 {
        vehicle.reverse_count = 0;
    }
    let accelerates = accel > 0.4;
    let blocked_askew = leader.gap_m < 2.5
        && (is_off_track(deviation) || leader.aligned < 0.7 || leader.gap_m < TOUCH_M)
        && agents.velocity[leader.agent as usize].length_squared() < 0.1;
    let stuck = speed.abs() < 0.25 && (accelerates || blocked_askew);
    vehicle.stuck_s = if stuck { vehicle.stuck_s + delta_s } else { 0.0 };
    let patience_s =
        PATIENCE_S + (vehicle.id % 5) as f32 + 2.0 * vehicle.reverse_count.min(5) as f32;
    if vehicle.stuck_s > patience_s {
        vehicle.stuck_s = 0.0;
        if may_back(agents, agent, back_rad, back_steps(vehicle)) {
            vehicle.reverse_s = REVERSE_S;
            vehicle.reverse_count = vehicle.reverse_count.saturating_add(1);
            vehicle.evasion_side = side_away_from(vehicle, tracks, agents, agent, leader);
            return Maneuver::Reverse;
        }
    }
    Maneuver::Forward
}

/// Returns whether a vehicle that has driven back from a wide vehicle which stands on the oncoming lane, and evades to
/// the other side, passes it now, though a corner of the wide one reaches into its lane.
pub(crate) fn has_evaded(
    vehicles: &VehicleTable,
    row: usize,
    (tracks, agents): (&Tracks, &Agents),
    leader: &Leader,
) -> bool {
    if vehicles[row].reverse_count == 0 || leader.aligned > ONCOMING {
        return false;
    }
    let [own, other] = [agents.driven[row], leader.agent].map(|agent| agents.body[agent as usize]);
    let stands = agents.velocity[leader.agent as usize].length() < STANDING_MPS;
    let way_m = leader.gap_m + other.length_m() + own.length_m();
    other.is_wide()
        && stands
        && obstacles::clears(vehicles, row, tracks, agents, leader.agent, way_m)
}

/// Ends the recovery of a vehicle that is to stand.
pub(crate) fn end(vehicle: &mut Vehicle) {
    (vehicle.stuck_s, vehicle.reverse_s) = (0.0, 0.0);
}

/// Returns the side on which the leader leaves more room: 1 left, −1 right. It is that of the route: in
/// a bend, an oncoming vehicle on the left lane may be to the right of the heading.
fn side_away_from(
    vehicle: &Vehicle,
    tracks: &Tracks,
    agents: &Agents,
    agent: usize,
    leader: &Leader,
) -> f32 {
    let Some(obstacle) = agents.position.get(leader.agent as usize) else { return 1.0 };
    let body = agents.body[leader.agent as usize];
    let middle = obstacle.truncate()
        + agents.forward[leader.agent as usize] * 0.5 * (body.front_m - body.rear_m);
    let at = agents.position[agent].truncate();
    let apart_m = at.distance(middle);
    let (lane, hint_m) = route::ahead(vehicle, tracks, apart_m);
    let here = tracks.project(vehicle.route.lane(), at, vehicle.arc_m);
    let there = tracks.project(lane, middle, hint_m);
    // As if the route were straight.
    let to = Vec2::new(apart_m + there.arc_m - hint_m, there.left_m - here.left_m);
    let heading = Vec2::from_angle(here.tangent.angle_to(agents.forward[agent]));
    if heading.perp_dot(to) > 0.0 { -1.0 } else { 1.0 }
}

/// Returns the backward acceleration in reverse.
pub(crate) fn reverse_accel(backward_mps: f32) -> f32 {
    (1.5 * (REVERSE_MPS - backward_mps)).clamp(-3.0, 1.5)
}

/// Returns for how many steps the way back has to be free.
fn back_steps(vehicle: &Vehicle) -> u32 {
    let waited_s = vehicle.wait_s.max(vehicle.reservation_idle_s);
    if waited_s > SHORT_BACK_AFTER_S { BACK_STEPS / 2 } else { BACK_STEPS }
}

/// Returns whether a vehicle can drive back for some steps with its front wheels at this angle: nothing is
/// behind it, and nothing comes near one of its sides meanwhile.
fn may_back(agents: &Agents, agent: usize, wheels_rad: f32, steps: u32) -> bool {
    if !is_free(agents, agent, -1.0, BEHIND_M * steps as f32 / BACK_STEPS as f32) {
        return false;
    }
    let (body, mut forward) = (&agents.body[agent], agents.forward[agent]);
    let at = agents.position[agent].truncate();
    let now = Footprint::of(body, at, forward);
    let mut rear = at - forward * 0.5 * body.wheelbase_m;
    let step_m = REVERSE_MPS * BACK_STEP_S;
    let turn = Vec2::from_angle(-step_m * wheels_rad.tan() / body.wheelbase_m);
    let way: Vec<(f32, Footprint)> = (1..=steps)
        .map(|step| {
            rear -= forward * step_m;
            forward = turn.rotate(forward);
            let middle = rear + forward * 0.5 * body.wheelbase_m;
            (step as f32 * BACK_STEP_S, Footprint::of(body, middle, forward))
        })
        .collect();
    let time_s = BACK_STEP_S * steps as f32;
    let reach_m = 2.0 * agents.reach_max_m + (REVERSE_MPS + PASSING_MPS) * time_s;
    agents.places.near(at, reach_m).into_iter().map(|other| other as usize).all(|other| {
        let is_far = (agents.position[other].z - agents.position[agent].z).abs() > 3.0;
        if other == agent || is_far {
            return true;
        }
        // Walkers step aside in time, if there is any.
        let steps = if agents.walks[other] { WALKER_STEPS } else { steps };
        let velocity = agents.velocity[other];
        let place = |after_s: f32| {
            let at = agents.position[other].truncate() + velocity * after_s;
            Footprint::of(&agents.body[other], at, agents.forward[other])
        };
        let shift = agents.roof_shift(agent, other);
        let touches = |own: &Footprint, margin_m: f32, place: &Footprint| {
            let ground = own.grown(margin_m);
            ground.touches(place) || ground.shifted(shift).touches(place)
        };
        let is_near = touches(&now, SWING_M, &place(0.0));
        let margin_m = if is_near { TOUCHING_M } else { SWING_M };
        let way = &way[..steps.min(way.len() as u32) as usize];
        way.iter().all(|(after_s, back)| !touches(back, margin_m, &place(*after_s)))
    })
}

/// Returns whether no agent is within `distance_m` in front (`direction` 1) or behind (−1) of an
/// agent.
fn is_free(agents: &Agents, agent: usize, direction: f32, distance_m: f32) -> bool {
    blocker(agents, agent, direction, distance_m).is_none()
}

/// Returns an agent within `distance_m` in front (`direction` 1) or behind (−1) of an agent.
pub(crate) fn blocker(
    agents: &Agents,
    agent: usize,
    direction: f32,
    distance_m: f32,
) -> Option<u32> {
    let size = agents.body[agent];
    let forward = agents.forward[agent];
    let edge = if direction > 0.0 { size.front_m } else { size.rear_m };
    let centre =
        agents.position[agent].truncate() + forward * direction * (edge + 0.5 * distance_m);
    // A diagonal of the rectangle, and that of the other agent.
    let reach_m = distance_m + size.half_width_m + 0.2 + agents.reach_max_m;
    agents.places.near(centre, reach_m).into_iter().find(|&other| {
        let other = other as usize;
        other != agent
            && (agents.position[other].z - agents.position[agent].z).abs() <= 3.0
            && touches(agents, other, centre, forward, 0.5 * distance_m, size.half_width_m + 0.2)
    })
}

/// Returns whether an agent touches a rectangle around `centre`, by separating axes.
fn touches(
    agents: &Agents,
    agent: usize,
    centre: Vec2,
    forward: Vec2,
    length: f32,
    width: f32,
) -> bool {
    let size = agents.body[agent];
    let other_forward = agents.forward[agent];
    let half = 0.5 * size.length_m();
    let middle =
        agents.position[agent].truncate() + other_forward * 0.5 * (size.front_m - size.rear_m);
    let to = middle - centre;
    let axes = [forward, forward.perp(), other_forward, other_forward.perp()];
    axes.iter().all(|axis| {
        let own_reach = length * axis.dot(forward).abs() + width * axis.dot(forward.perp()).abs();
        let other_reach = half * axis.dot(other_forward).abs()
            + size.half_width_m * axis.dot(other_forward.perp()).abs();
        to.dot(*axis).abs() <= own_reach + other_reach
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        body::Bodies,
        steer::evasion_left,
        tests::{
            course::{Car, Course},
            maps,
        },
    };
    use glam::{Quat, Vec3};
    use protocol::{ActorId, ActorState, Pose, kind};

    /// Returns whether a bus at the origin that heads along x may drive back with its wheels turned to the
    /// left, while a car at this place drives along x.
    fn may_back_beside(car: Option<(Vec3, f32)>) -> bool {
        may_back_leaning(car, 0.0)
    }

    /// As [`may_back_beside`], while the car leans to its left by this angle.
    fn may_back_leaning(car: Option<(Vec3, f32)>, lean_rad: f32) -> bool {
        may_back_for(car, lean_rad, BACK_STEPS)
    }

    /// As [`may_back_leaning`], for this number of steps.
    fn may_back_for(car: Option<(Vec3, f32)>, lean_rad: f32, steps: u32) -> bool {
        let rotation = Quat::from_rotation_x(-lean_rad);
        let car = car.map(|car| ActorState {
            pose: Pose::new(car.0, rotation),
            ..along_x(kind::VEHICLE, u32::MAX, car)
        });
        may_back_past(car, steps)
    }

    fn along_x(kind: u32, blueprint: u32, (at, mps): (Vec3, f32)) -> ActorState {
        ActorState {
            kind,
            blueprint,
            pose: Pose::level(at, 0.0),
            velocity_mps: [mps, 0.0, 0.0],
            ..ActorState::default()
        }
    }

    /// Returns whether the bus may drive back for this number of steps past another actor.
    fn may_back_past(other: Option<ActorState>, steps: u32) -> bool {
        let (bus, _) = town::blueprint("vehicle.mitsubishi.fusorosa").expect("a blueprint");
        let own = along_x(kind::VEHICLE, bus, (Vec3::ZERO, 0.0));
        let mut actors = vec![ActorState { actor_id: ActorId(1), ..own }];
        actors.extend(other.map(|other| ActorState { actor_id: ActorId(2), ..other }));
        let mut agents = Agents::default();
        agents.read(&actors, &Bodies::from_catalogue());
        may_back(&agents, 0, 0.48, steps)
    }

    #[test]
    fn a_vehicle_does_not_evade_to_the_side_of_one_that_comes_however_often_it_has_driven_back() {
        let car = Car { position: Vec3::new(30.0, -1.75, 0.0), ..Car::default() };
        let mut course = Course::with_cars(maps::two_way_loop(20.0, 60.0), 1, vec![car]);
        let actors = course.actors.clone();
        course.tick();
        let mut agents = Agents::default();
        agents.read(&actors, &course.planner.map.bodies);
        let evades_left_m = |aligned: f32| {
            let mut vehicle = course.planner.state.vehicles[0];
            (vehicle.reverse_count, vehicle.evasion_side) = (EVASION_COUNT + 1, -1.0);
            let leader = Leader { gap_m: 1.0, speed_mps: 0.0, agent: 0, aligned };
            let on = (&course.planner.map.tracks, &agents);
            decide(&mut vehicle, 0, on, &Deviation::default(), &leader, (0.0, 0.0), 0.05);
            evasion_left(&vehicle)
        };
        assert!(evades_left_m(-0.9) < 0.0, "away from it");
        assert!(evades_left_m(0.3) > 0.0, "to the other side");
    }

    #[test]
    fn a_vehicle_that_evades_passes_a_bus_of_which_a_corner_is_on_its_lane() {
        let car = Car { position: Vec3::new(14.0, -1.75, 0.0), ..Car::default() };
        let bus = Car {
            position: Vec3::new(30.0, 0.9, 0.0),
            yaw: std::f32::consts::PI,
            parked: true,
            ..Car::default()
        };
        let bus = bus.built_as("vehicle.mitsubishi.fusorosa");
        let mut course = Course::with_cars(maps::two_way_loop(20.0, 60.0), 1, vec![car, bus]);
        let mut leader = |reverse_count: u32, evasion_side: f32| {
            course.tick();
            let vehicle = &mut course.planner.state.vehicles[0];
            (vehicle.reverse_count, vehicle.evasion_side) = (reverse_count, evasion_side);
            course.tick();
            let plan = course.planner.vehicle_plans().next().expect("it is planned");
            plan.leader.0
        };
        assert_eq!(leader(0, -1.0), 2, "it has not driven back");
        assert_eq!(leader(2, -1.0), 0, "it passes");
        assert_eq!(leader(2, 1.0), 2, "it evades towards the bus");
    }

    #[test]
    fn a_walker_at_the_corner_that_swings_out_is_waited_for() {
        let (blueprint, _) = town::blueprint("walker.pedestrian.0001").expect("a blueprint");
        let walker = |x: f32, y: f32, mps: f32| {
            along_x(kind::WALKER, blueprint, (Vec3::new(x, y, 0.0), mps))
        };
        let may_back = |walker: ActorState| may_back_past(Some(walker), BACK_STEPS);
        assert!(!may_back(walker(4.5, -1.8, 0.0)), "the front swings to its place");
        assert!(may_back(walker(4.5, 1.8, 0.0)), "the front swings away from it");
        assert!(may_back(walker(4.5, -2.3, 0.0)), "it has time to step aside");
        assert!(may_back(walker(5.2, -1.8, 1.5)), "it walks on");
    }

    #[test]
    fn a_bus_that_drives_back_minds_the_corner_that_swings_out() {
        assert!(may_back_beside(None));
        assert!(!may_back_beside(Some((Vec3::new(-9.0, 0.0, 0.0), 0.0))), "one is behind");
        // The front swings to the right in reverse.
        assert!(!may_back_beside(Some((Vec3::new(3.5, -2.75, 0.0), 0.0))), "one is on the right");
        assert!(may_back_beside(Some((Vec3::new(3.5, 2.75, 0.0), 0.0))), "one is on the left");
        let beside = Some((Vec3::new(3.5, -3.69, 0.0), 0.0));
        assert!(may_back_beside(beside), "there is room");
        assert!(!may_back_leaning(beside, 0.05), "its roof is 8 cm nearer");
        assert!(
            !may_back_beside(Some((Vec3::new(-9.0, -2.75, 0.0), 12.0))),
            "one comes from behind"
        );
        assert!(may_back_beside(Some((Vec3::new(9.0, -2.75, 0.0), 7.0))), "one has passed");
    }

    #[test]
    fn after_a_long_wait_the_gap_that_a_queue_leaves_is_room_enough() {
        let behind = |gap_m: f32, steps: u32| {
            may_back_for(Some((Vec3::new(-7.5 - gap_m, 0.0, 0.0), 0.0)), 0.0, steps)
        };
        assert!(!behind(1.8, BACK_STEPS) && behind(1.8, BACK_STEPS / 2));
        assert!(!behind(0.6, BACK_STEPS / 2), "too near");
        let waited = |wait_s: f32| back_steps(&Vehicle { wait_s, ..Vehicle::new(1) });
        assert_eq!([waited(10.0), waited(30.0)], [BACK_STEPS, BACK_STEPS / 2]);
    }
}
