//! Lane changes by MOBIL (Kesting, Treiber and Helbing 2007), where the lane markings allow them.
//!
//! Vehicles decide in the order of their ids. A vehicle that changes lanes claims its place on the
//! new lane at once, so that two vehicles never take the same gap.

use crate::{
    agents::Agents,
    body::Class,
    car_following::{free_accel, idm, route_end},
    client_route::ClientRoutes,
    drivers::Driver,
    leader::{Leader, first_ahead},
    map::Map,
    occupancy::Occupancy,
    params::{GAP_M, Params},
    random::{Purpose, unit},
    route::{self, LaneLoad},
    spread::Spread,
    tracks::{NONE, Tracks},
    vehicle_table::{Route, Vehicle, VehicleTable},
};

/// Time between two decisions.
const DECISION_PERIOD_S: f32 = 0.6;
/// Time after a lane change before the next.
const COOLDOWN_S: f32 = 8.0;
/// Safe deceleration that a change may impose on the new follower (MOBIL's b_safe).
const SAFE_BRAKE_MPS2: f32 = 2.5;
/// Changing threshold (MOBIL's Δa_th).
const THRESHOLD_MPS2: f32 = 0.2;
/// Distance to the end of a lane from which on a vehicle leaves it.
const LANE_END_M: f32 = 250.0;
/// Incentive to leave a lane that ends.
const LANE_END_BONUS_MPS2: f32 = 4.0;
/// Duration of a lane change.
const CHANGE_S: f32 = 3.5;
/// Least length of a lane change, in metres and in lengths of the vehicle: in a shorter one the nose of a bus,
/// which is ahead of the line, swings into the lane beyond.
const CHANGE_M: f32 = 18.0;
const CHANGE_LENGTHS: f32 = 4.0;
/// Free distance required behind.
const BEHIND_M: f32 = 3.0;
/// Distance behind up to which vehicles on the new lane are examined: one at 110 km/h needs it to slow
/// down behind a slow one.
const FOLLOWER_M: f32 = 120.0;
/// Most lanes that are examined at once.
const LANES_MAX: usize = 8;
/// Distance of a prop that stands on the lane from which on a vehicle changes lanes.
const OBSTACLE_M: f32 = 60.0;
/// Gap to a prop from which a vehicle can still pull out at walking speed.
const PULL_OUT_M: f32 = 6.5;
/// Least free distance that the other lane must offer beyond the prop.
const BEYOND_M: f32 = 15.0;
/// Lowest speed at which a lane change begins, except from a lane that ends.
const SLOWEST_MPS: f32 = 3.0;

/// Inputs of this stage.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// By row: the leader on the route.
    pub(crate) leaders: &'a [Leader],
    pub(crate) desired_speeds: &'a [f32],
    /// By row: the driver.
    pub(crate) drivers: &'a [Driver],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
    pub(crate) spread: Spread,
}

/// A stretch of a lane that a vehicle has claimed in this frame.
struct Claim {
    lane: u32,
    rear_m: f32,
    front_m: f32,
}

/// Decides on lane changes for every vehicle.
pub(crate) fn plan(
    vehicles: &mut VehicleTable,
    params: &mut Params,
    client_routes: &mut ClientRoutes,
    view: &View,
) {
    let mut motives = Vec::new();
    view.spread.update_list(vehicles, &mut motives, |row, vehicle, motives| {
        let motive = motive(vehicle, row, params, client_routes, view);
        // A claim of another vehicle can only forbid a change.
        let possible = motive.filter(|motive| best(vehicle, row, *motive, view, &[]).is_some());
        motives.extend(possible.map(|motive| (row, motive)));
    });
    if motives.is_empty() {
        return;
    }
    let load = LaneLoad::count(vehicles, &view.map.tracks);
    let mut claims: Vec<Claim> = Vec::new();
    for (row, motive) in motives {
        let vehicle = &mut vehicles[row];
        if let Some((lane, arc_m, left_m)) = best(vehicle, row, motive, view, &claims) {
            if matches!(motive, Motive::Commanded(_)) {
                params.clear_change_now(vehicle.id);
            }
            let body = view.agents.body[view.agents.driven[row] as usize];
            claims.push(Claim { lane, rear_m: arc_m - body.rear_m, front_m: arc_m + body.front_m });
            begin(vehicle, row, client_routes, &load, view, (lane, arc_m, left_m));
        }
    }
}

/// Returns why a vehicle would change lanes in this frame, and counts the decision.
fn motive(
    vehicle: &mut Vehicle,
    row: usize,
    params: &Params,
    client_routes: &ClientRoutes,
    view: &View,
) -> Option<Motive> {
    if vehicle.located == 0 {
        return None;
    }
    vehicle.change_cooldown_s -= view.delta_s;
    let is_moving_aside = vehicle.shift_m != 0.0 || vehicle.passes_prop();
    if is_moving_aside || vehicle.reservation != 0 {
        return None;
    }
    let id = vehicle.id;
    let route_side = client_routes.lane_change_side(id, vehicle.route.lane(), &view.map.tracks);
    let motive = match (params.change_now(id), route_side) {
        (0.0, Some(side)) if side != 0.0 => Motive::Route(side),
        (0.0, _) if vehicle.change_cooldown_s > 0.0 => return None,
        (0.0, Some(_)) if passes_prop(vehicle, row, params, view) => Motive::Obstacle,
        (0.0, Some(_)) => Motive::LaneEnd,
        (0.0, None) => unguided_motive(vehicle, row, params, view),
        (side, _) => Motive::Commanded(side),
    };
    if !matches!(motive, Motive::Commanded(_) | Motive::Route(_)) {
        vehicle.change_cooldown_s = DECISION_PERIOD_S;
        vehicle.change_draws = vehicle.change_draws.wrapping_add(1);
    }
    Some(motive)
}

/// Why to change lanes; sides are 1 for the left and -1 for the right.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motive {
    /// To drive faster.
    Discretionary,
    /// Only to leave a lane that ends.
    LaneEnd,
    /// To pass a prop that stands on the lane.
    Obstacle,
    /// At random to this side, if it is safe.
    Random(f32),
    /// To this side because the client's route continues there, as soon as it is safe.
    Route(f32),
    /// To this side because a client commands it, whether it is safe or not.
    Commanded(f32),
}

impl Motive {
    fn takes(self, side: f32) -> bool {
        match self {
            Motive::Discretionary | Motive::LaneEnd | Motive::Obstacle => true,
            Motive::Random(chosen) | Motive::Route(chosen) | Motive::Commanded(chosen) => {
                chosen == side
            }
        }
    }
}

/// Returns whether a vehicle changes lanes to pass a prop that stands on its lane.
fn passes_prop(vehicle: &Vehicle, row: usize, params: &Params, view: &View) -> bool {
    let leader = &view.leaders[row];
    leader.gap_m < OBSTACLE_M
        && view.agents.is_standing_prop(leader.agent)
        && params.changes_lanes(vehicle.id)
}

/// Returns the motive of a vehicle without a route or a command of a client.
fn unguided_motive(vehicle: &Vehicle, row: usize, params: &Params, view: &View) -> Motive {
    let id = vehicle.id;
    if passes_prop(vehicle, row, params, view) {
        return Motive::Obstacle;
    }
    if view.agents.body[view.agents.driven[row] as usize].class == Class::Bicycle {
        let right = view.map.tracks.right[vehicle.route.lane() as usize];
        return if right == NONE { Motive::LaneEnd } else { Motive::Random(-1.0) };
    }
    for (probability, side) in params.random_changes(id).into_iter().zip([1.0, -1.0]) {
        let nth = 2 * u64::from(vehicle.change_draws) + u64::from(side > 0.0);
        if probability > 0.0 && unit(view.seed, id, Purpose::RandomLaneChange, nth) < probability {
            return Motive::Random(side);
        }
    }
    if params.changes_lanes(id) { Motive::Discretionary } else { Motive::LaneEnd }
}

/// Returns the lane to change to: its index, the arc length on it, and the lateral offset of the
/// vehicle from it.
fn best(
    vehicle: &Vehicle,
    row: usize,
    motive: Motive,
    view: &View,
    claims: &[Claim],
) -> Option<(u32, f32, f32)> {
    let (tracks, agents) = (&view.map.tracks, view.agents);
    let agent = agents.driven[row] as usize;
    let lane = vehicle.route.lane();
    let speed = agents.speed(agent);
    let index = lane as usize;
    let sides = [tracks.left[index], tracks.right[index]];
    if tracks.in_junction(lane) || sides == [NONE, NONE] || speed < -0.1 {
        return None;
    }
    // A vehicle that must leave a lane that ends ignores the markings.
    let lane_ends = distance_to_end(vehicle, view) < LANE_END_M;
    if motive == Motive::LaneEnd && !lane_ends {
        return None;
    }
    let commanded = matches!(motive, Motive::Commanded(_));
    let passes = motive == Motive::Obstacle;
    let urgent = lane_ends || commanded || passes || matches!(motive, Motive::Route(_));
    let allowed = [tracks.left_change[index] || urgent, tracks.right_change[index] || urgent];
    if !urgent && speed < SLOWEST_MPS {
        return None;
    }
    // Too near to its leader, the vehicle could not pull out behind it.
    let leader = &view.leaders[row];
    let closing_mps = (speed - leader.speed_mps).max(0.0);
    let least_m = if passes { PULL_OUT_M + closing_mps } else { 6.0 + 2.0 * closing_mps };
    if leader.gap_m < least_m && !commanded {
        return None;
    }
    let own = agents.body[agent];
    let driver = &view.drivers[row];
    let current = accel(speed, view.desired_speeds[row], &view.leaders[row], driver);
    let mut best: Option<(f32, (u32, f32, f32))> = None;
    for ((side, allowed), sign) in sides.into_iter().zip(allowed).zip([1.0, -1.0]) {
        if side == NONE || side == lane || !allowed || !motive.takes(sign) {
            continue;
        }
        let hint = vehicle.arc_m * tracks.length(side) / tracks.length(lane).max(0.1);
        let projection = tracks.project(side, agents.position[agent].truncate(), hint);
        // Enough of the lane must remain, and it must really run alongside.
        let room = clear_run(tracks, side, projection.arc_m);
        let needs = if urgent { 15.0 } else { 25.0 + 5.0 * speed };
        let beside = (1.2..6.5).contains(&projection.left_m.abs())
            && (-1.0..=tracks.length(side) + 1.0).contains(&projection.arc_m)
            && 2.0 * tracks.half_width_at(side, projection.arc_m) > 2.0 * own.half_width_m + 0.4;
        if !beside || room < needs || (!tracks.endless[side as usize] && !urgent) {
            continue;
        }
        let (rear, front) = (projection.arc_m - own.rear_m, projection.arc_m + own.front_m);
        if commanded {
            return Some((side, projection.arc_m, projection.left_m));
        }
        let claimed = claims
            .iter()
            .any(|c| c.lane == side && c.rear_m < front + 12.0 && c.front_m > rear - 12.0);
        if claimed {
            continue;
        }
        let Some(gap) = assess_gap(row, view, side, rear, front) else { continue };
        let safe = if urgent { 2.0 * SAFE_BRAKE_MPS2 } else { SAFE_BRAKE_MPS2 };
        if gap.follower < -safe || gap.own < -safe {
            continue;
        }
        if passes && gap.leader_m < leader.gap_m + BEYOND_M {
            continue;
        }
        if passes || matches!(motive, Motive::Random(_) | Motive::Route(_)) {
            return Some((side, projection.arc_m, projection.left_m));
        }
        let bonus = if urgent && tracks.endless[side as usize] { LANE_END_BONUS_MPS2 } else { 0.0 };
        let incentive = gap.own - current
            + bonus
            + driver.courtesy * (gap.follower - gap.follower_now).min(0.0);
        if incentive > THRESHOLD_MPS2 && best.is_none_or(|(most, _)| incentive > most) {
            best = Some((incentive, (side, projection.arc_m, projection.left_m)));
        }
    }
    best.map(|(_, choice)| choice)
}

/// Accelerations in metres per second squared: own and of the new follower after the change, and of
/// the new follower now.
struct Gap {
    own: f32,
    follower: f32,
    follower_now: f32,
    /// Distance to the leader on the new lane, metres.
    leader_m: f32,
}

/// Returns the effect of a change into the gap beside the vehicle; `None` if there is no gap.
fn assess_gap(row: usize, view: &View, side: u32, rear: f32, front: f32) -> Option<Gap> {
    let (tracks, agents) = (&view.map.tracks, view.agents);
    let own = agents.driven[row];
    let speed = agents.speed(own as usize);
    let beside = |lane: u32, offset: f32| {
        view.occupancy.on(lane).iter().any(|o| {
            view.occupancy.reacts_to(own, o.agent)
                && o.rear_m + offset < front + 1.0
                && o.front_m + offset > rear - BEHIND_M
        })
    };
    let length = tracks.length(side);
    let alongside = beside(side, 0.0)
        || tracks.previous(side).iter().any(|&lane| beside(lane, -tracks.length(lane)))
        || tracks.next(side).iter().any(|&lane| beside(lane, length));
    if alongside {
        return None;
    }
    let mut leader = first_ahead(view.occupancy, side, [own, NONE], -front, f32::NEG_INFINITY);
    if let [next] = tracks.next(side) {
        let begins = tracks.length(side) - front;
        let beyond = first_ahead(view.occupancy, *next, [own, NONE], begins, f32::NEG_INFINITY);
        if beyond.gap_m < leader.gap_m {
            leader = beyond;
        }
    }
    let follower = follower(own, tracks, view.occupancy, side, rear);
    let own_accel = accel(speed, view.desired_speeds[row], &leader, &view.drivers[row]);
    // Others are expected to drive like the median.
    let other = &Driver::MEDIAN;
    let (follower_accel, follower_now) = match follower {
        Some((gap, mps)) => {
            let now = idm(
                mps,
                leader.speed_mps,
                gap + (front - rear) + leader.gap_m.min(200.0),
                GAP_M,
                other,
            );
            (idm(mps, speed, gap, GAP_M, other), now)
        }
        None => (0.0, 0.0),
    };
    let leader_m = leader.gap_m;
    Some(Gap { own: own_accel, follower: follower_accel, follower_now, leader_m })
}

/// Returns the gap and the speed of the nearest agent behind `rear_m` on a lane and those before it.
fn follower(
    own: u32,
    tracks: &Tracks,
    occupancy: &Occupancy,
    side: u32,
    rear_m: f32,
) -> Option<(f32, f32)> {
    let nearest = |lane: u32, begins_m: f32| {
        let others = occupancy.on(lane).iter();
        let others = others.filter(|other| occupancy.reacts_to(own, other.agent));
        let gaps = others.map(|other| (rear_m - (begins_m + other.front_m), other.speed_mps));
        gaps.filter(|(gap_m, _)| *gap_m > 0.0).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut found = nearest(side, 0.0);
    let mut lanes = vec![(side, 0.0)];
    while let Some((lane, begins_m)) = lanes.pop() {
        for &before in tracks.previous(lane) {
            let begins_m = begins_m - tracks.length(before);
            let here = nearest(before, begins_m);
            if here.is_none() && rear_m - begins_m < FOLLOWER_M && lanes.len() < LANES_MAX {
                lanes.push((before, begins_m));
            }
            let is_nearer = |here: &(f32, f32)| found.is_none_or(|(least_m, _)| here.0 < least_m);
            found = here.filter(is_nearer).or(found);
        }
        if found.is_some() && lane == side {
            break;
        }
    }
    found
}

/// Returns the acceleration towards the desired speed behind a leader.
fn accel(speed: f32, desired: f32, leader: &Leader, driver: &Driver) -> f32 {
    let free_accel = free_accel(speed, desired, driver);
    if leader.gap_m.is_finite() {
        free_accel.min(idm(speed, leader.speed_mps, leader.gap_m, GAP_M, driver))
    } else {
        free_accel
    }
}

/// Returns the distance to the end of a route that leads to a dead end, else infinity.
fn distance_to_end(vehicle: &Vehicle, view: &View) -> f32 {
    let tracks = &view.map.tracks;
    let last = vehicle.route.last();
    if tracks.endless[last as usize] {
        return f32::INFINITY;
    }
    route_end(vehicle, tracks, 0.0, LANE_END_M)
}

/// Returns the distance from `arc_m` to the next fork, junction or end.
pub(crate) fn clear_run(tracks: &Tracks, lane: u32, arc_m: f32) -> f32 {
    let mut run = tracks.length(lane) - arc_m;
    let mut at = lane;
    while run < 250.0 {
        match tracks.next(at) {
            [next] if !tracks.in_junction(*next) => at = *next,
            _ => return run,
        }
        run += tracks.length(at);
    }
    run
}

/// Begins a lane change.
fn begin(
    vehicle: &mut Vehicle,
    row: usize,
    client_routes: &mut ClientRoutes,
    load: &LaneLoad,
    view: &View,
    (lane, arc_m, left_m): (u32, f32, f32),
) {
    let agent = view.agents.driven[row] as usize;
    let speed = view.agents.speed(agent).max(0.0);
    let lanes_passed = vehicle.route.lanes_passed.wrapping_add(1);
    vehicle.route = Route::from_lane(lane, lanes_passed);
    vehicle.arc_m = arc_m;
    vehicle.shift_m = left_m;
    vehicle.shift_done_m = 0.0;
    let least_m = (CHANGE_LENGTHS * view.agents.body[agent].length_m())
        .min(clear_run(&view.map.tracks, lane, arc_m))
        .max(CHANGE_M);
    let over_m = (CHANGE_S * speed).max(least_m);
    let old = &view.leaders[row];
    vehicle.shift_over_m = if view.agents.is_standing_prop(old.agent) {
        over_m.min(old.gap_m.max(PULL_OUT_M))
    } else {
        over_m
    };
    vehicle.change_cooldown_s = COOLDOWN_S;
    client_routes.update(vehicle, &view.map.tracks, &view.map.grid);
    route::extend(vehicle, client_routes, &view.map.tracks, load, view.seed);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{body::Bodies, grid::Grid, tests::maps};
    use protocol::{ActorId, ActorState, Pose, kind};

    #[test]
    fn a_follower_is_seen_across_several_short_lanes() {
        // Lanes of 20 m and quarter circles of 13 m.
        let tracks = Tracks::new(&maps::loop_road(8.0, 20.0));
        let [before] = *tracks.previous(0) else { panic!("one lane before the first") };
        let [far] = *tracks.previous(before) else { panic!("one lane before that") };
        let place = |id: u32, lane: u32, arc_m: f32| {
            let (point, tangent, _) = tracks.at(lane, arc_m);
            ActorState {
                actor_id: ActorId(id),
                kind: kind::VEHICLE,
                blueprint: u32::MAX,
                pose: Pose::level(point, tangent.to_angle()),
                velocity_mps: (tangent * 20.0).extend(0.0).to_array(),
                ..ActorState::default()
            }
        };
        let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
        agents.read(&[place(1, 0, 5.0), place(2, far, 10.0)], &Bodies::from_catalogue());
        occupancy.rebuild(&tracks, &Grid::new(&tracks), &agents, &[], Spread::Alone);
        let rear_m = 5.0 - agents.body[0].rear_m;
        let (gap_m, mps) = follower(0, &tracks, &occupancy, 0, rear_m).expect("one is behind");
        let fronts_m = tracks.length(far) - 10.0 + tracks.length(before) - agents.body[1].front_m;
        assert!((gap_m - (fronts_m + rear_m)).abs() < 0.1, "{gap_m} m");
        assert!((mps - 20.0).abs() < 0.1, "{mps} m/s");
    }
}
