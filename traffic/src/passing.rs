//! Passing a prop that stands on the lane: within the lane and its shoulder, or else over the
//! oncoming lane. The vehicle moves to one side, keeps that offset beside the prop and returns.
//!
//! A pass begins only if the predicted course clears everything in its way, and over the oncoming
//! lane only if no vehicle comes that could arrive before the vehicle has returned.

use crate::{
    agents::Agents,
    body::Body,
    leader::Leader,
    map::Map,
    obstacles,
    occupancy::{Occupancy, Occupant},
    params::Params,
    prop_extent::{self, Extent},
    route::ahead,
    spread::Spread,
    steer::wide_offset_left,
    tracks::{NONE, Tracks},
    vehicle_table::{Vehicle, VehicleTable},
};

/// Highest speed of a vehicle that passes a prop.
pub(crate) const SPEED_MPS: f32 = 8.0;
/// Time at standstill behind a prop after which a vehicle passes it over the oncoming lane whatever
/// the markings.
pub(crate) const STANDSTILL_S: f32 = 5.0;

/// Distance of a prop from which on a vehicle prepares to pass it.
const REACH_M: f32 = 60.0;
/// Distance before the place where the vehicle must pull out at which it begins to.
const READY_M: f32 = 10.0;
/// Largest gap at which a standing vehicle waits for a prop.
const WAITING_GAP_M: f32 = 25.0;
/// Speed below which a vehicle stands.
const STANDING_MPS: f32 = 0.3;
/// Clearance between the side of the vehicle and a prop.
const CLEARANCE_M: f32 = 0.5;
/// Clearance that the predicted course must have at its begin, and what must remain of it: steering
/// is not exact.
const COURSE_M: [f32; 2] = [0.35, 0.15];
/// Least distance between the side of the vehicle and the edge of the carriageway.
const EDGE_M: f32 = 0.1;
/// Time over which a moving vehicle moves to the side.
const ASIDE_S: f32 = 2.5;
/// Fraction of the sharpest curve of a vehicle that it uses to pull out.
const STEERING_PART: f32 = 0.85;
/// Fraction of the length of a blend at which it has nearly reached its end.
const NEARLY: f32 = 0.85;
/// Gap from which a vehicle can pull out, in wheelbases, and its least value.
const PULL_OUT_WHEELBASES: f32 = 3.2;
const PULL_OUT_M: f32 = 9.0;
/// Acceleration that the time over the oncoming lane is based on.
const ACCEL_MPS2: f32 = 1.5;
/// Distance to an oncoming vehicle after the pass.
const ONCOMING_GAP_M: f32 = 15.0;
/// Largest number of lanes that are searched for oncoming vehicles.
const LANES_MAX: usize = 200;

/// Inputs of this stage.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// By row: the leader on the route.
    pub(crate) leaders: &'a [Leader],
    pub(crate) params: &'a Params,
    pub(crate) delta_s: f32,
    pub(crate) spread: Spread,
}

/// Returns whether a vehicle keeps enough distance to its leader to pull out: a prop that it may
/// pass.
pub(crate) fn may_pull_out(vehicle: &Vehicle, agents: &Agents, leader: &Leader) -> bool {
    let is_aside = vehicle.shift_m != 0.0 || vehicle.passes_prop();
    !is_aside && agents.is_standing_prop(leader.agent)
}

/// Returns the gap from which a vehicle can pull out.
pub(crate) fn pull_out_m(body: &Body) -> f32 {
    (PULL_OUT_WHEELBASES * body.wheelbase_m).max(PULL_OUT_M)
}

/// Lists pairs of a vehicle of these rows and a prop that it passes and clears, as indices into the
/// agents.
pub(crate) fn passed_props(
    vehicles: &VehicleTable,
    rows: impl Iterator<Item = usize>,
    tracks: &Tracks,
    agents: &Agents,
) -> Vec<(u32, u32)> {
    let mut passed = Vec::new();
    for row in rows.filter(|&row| vehicles[row].passes_prop()) {
        let rest_m =
            vehicles[row].pass_hold_m + vehicles[row].pass_over_m - vehicles[row].pass_done_m;
        let is_prop = |agent: usize| agents.is_standing_prop(agent as u32);
        let (clear, _) =
            obstacles::touched(vehicles, row, tracks, agents, rest_m, COURSE_M[1], is_prop);
        passed.extend(clear.into_iter().map(|prop| (agents.driven[row], prop)));
    }
    passed
}

/// Begins to pass props, and counts the time of vehicles that wait behind one. `facing` becomes the
/// rows of vehicles that a prop is ahead of.
pub(crate) fn plan(vehicles: &mut VehicleTable, view: &View, facing: &mut Vec<usize>) {
    view.spread.update_list(vehicles, facing, |row, vehicle, facing| {
        let leader = &view.leaders[row];
        let faces_prop = vehicle.located == 1
            && leader.gap_m < REACH_M
            && view.agents.is_standing_prop(leader.agent);
        let speed = || view.agents.speed(view.agents.driven[row] as usize);
        let waits = faces_prop && leader.gap_m < WAITING_GAP_M && speed().abs() < STANDING_MPS;
        vehicle.prop_wait_s = if waits { vehicle.prop_wait_s + view.delta_s } else { 0.0 };
        facing.extend(faces_prop.then_some(row));
    });
    for &row in &*facing {
        if vehicles[row].passes_prop() && vehicles[row].prop_wait_s >= STANDSTILL_S {
            // Another prop stands in the way since the pass began.
            vehicles[row].end_pass();
        }
        let is_busy = vehicles[row].passes_prop()
            || vehicles[row].shift_m != 0.0
            || vehicles[row].u_turn == 1
            || vehicles[row].reverse_s != 0.0;
        if !is_busy && begin(vehicles, row, view) {
            vehicles[row].prop_wait_s = 0.0;
        }
    }
}

/// Begins a pass, if there is room for one.
fn begin(vehicles: &mut VehicleTable, row: usize, view: &View) -> bool {
    let agent = view.agents.driven[row] as usize;
    let body = view.agents.body[agent];
    let prop = view.leaders[row].agent;
    let Some(props) = prop_extent::group(vehicles, row, &view.map.tracks, view.agents, prop) else {
        return false;
    };
    if let Some(left_m) = left_within_lane(vehicles, row, view, &body, &props)
        && aim(vehicles, row, view, &props, left_m)
    {
        let stays = |agent: usize| stays(view.agents, agent);
        let end_m = vehicles[row].pass_hold_m + vehicles[row].pass_over_m;
        let hold_m = vehicles[row].pass_hold_m;
        if runs(vehicles, row, view, hold_m, |_| true) && clears(vehicles, row, view, end_m, stays)
        {
            return true;
        }
    }
    vehicles[row].end_pass();
    if let Some(left_m) = left_over_oncoming(vehicles, row, view, &body, &props)
        && aim(vehicles, row, view, &props, left_m)
    {
        let end_m = vehicles[row].pass_hold_m + vehicles[row].pass_over_m + body.front_m;
        let has_oncoming = |lane: u32| view.map.beside.oncoming[lane as usize] != NONE;
        if runs(vehicles, row, view, end_m, has_oncoming)
            && clears(vehicles, row, view, end_m, |_| true)
            && no_vehicle_comes(vehicles, row, view, end_m)
        {
            return true;
        }
    }
    vehicles[row].end_pass();
    false
}

/// Returns the lateral offset at which the vehicle clears the props within its lane and the
/// shoulders.
fn left_within_lane(
    vehicles: &VehicleTable,
    row: usize,
    view: &View,
    body: &Body,
    props: &Extent,
) -> Option<f32> {
    let tracks = &view.map.tracks;
    let mut room_m = [f32::INFINITY; 2];
    for at_m in [props.from_m, props.to_m] {
        let (lane, arc_m) = ahead(&vehicles[row], tracks, at_m);
        let half_m = tracks.half_width_at(lane, arc_m);
        let shoulders_m = view.map.beside.shoulders_m[lane as usize];
        room_m = [0, 1].map(|side| room_m[side].min(half_m + shoulders_m[side]));
    }
    let needs_m = body.half_width_m + CLEARANCE_M;
    let left_m = (props.left_m + needs_m).max(0.0);
    let right_m = (props.right_m - needs_m).min(0.0);
    let reach_m = body.half_width_m + EDGE_M;
    let mut fits = [(left_m, room_m[0]), (right_m, room_m[1])]
        .into_iter()
        .filter(|(offset_m, room_m)| offset_m.abs() + reach_m <= *room_m)
        .map(|(offset_m, _)| offset_m);
    let first = fits.next()?;
    Some(fits.next().filter(|second| second.abs() < first.abs()).unwrap_or(first))
}

/// Returns the lateral offset at which the vehicle clears the props over the oncoming lane, if it
/// may use that lane.
fn left_over_oncoming(
    vehicles: &VehicleTable,
    row: usize,
    view: &View,
    body: &Body,
    props: &Extent,
) -> Option<f32> {
    let (tracks, beside) = (&view.map.tracks, &view.map.beside);
    let (lane, arc_m) = ahead(&vehicles[row], tracks, props.from_m);
    let index = lane as usize;
    let oncoming = beside.oncoming[index];
    let waited = vehicles[row].prop_wait_s >= STANDSTILL_S;
    let has_lane_beside = tracks.left[index] != NONE || tracks.right[index] != NONE;
    if oncoming == NONE
        || has_lane_beside
        || !(beside.may_cross[index] || waited)
        || !view.params.changes_lanes(vehicles[row].id)
    {
        return None;
    }
    let needs_m = body.half_width_m + CLEARANCE_M;
    let offset_m =
        if tracks.oncoming[index] > 0.0 { props.left_m + needs_m } else { props.right_m - needs_m };
    let place = tracks.at(lane, arc_m).0.truncate();
    let across = tracks.project(oncoming, place, tracks.length(oncoming) - arc_m);
    let room_m =
        tracks.half_width_at(lane, arc_m) + 2.0 * tracks.half_width_at(oncoming, across.arc_m);
    (offset_m.abs() + body.half_width_m + EDGE_M <= room_m).then_some(offset_m)
}

/// Sets the line of a pass at a lateral offset; returns `false` if the props are too near for it, or
/// still too far.
fn aim(vehicles: &mut VehicleTable, row: usize, view: &View, props: &Extent, left_m: f32) -> bool {
    let agent = view.agents.driven[row] as usize;
    let (body, speed) = (view.agents.body[agent], view.agents.speed(agent).max(0.0));
    let gap_m = props.from_m - body.front_m;
    let radius_m = body.wheelbase_m / (STEERING_PART * body.max_steer_rad).tan();
    let (lane, arc_m) = ahead(&vehicles[row], &view.map.tracks, props.from_m);
    let left_m = left_m - wide_offset_left(&view.map.tracks, lane, arc_m, &body);
    // The highest curvature of a quintic blend is 5.77 times its height over the square of its
    // length.
    let least_m = (5.77 * left_m.abs() * radius_m).sqrt().max(4.0);
    let over_m = least_m.max(ASIDE_S * speed).min(least_m.max(gap_m));
    // A vehicle that waits stands as far from the prop as it needs to pull out.
    let ready_m = over_m + READY_M.max(pull_out_m(&body));
    if gap_m < NEARLY * over_m || gap_m > ready_m {
        return false;
    }
    vehicles[row].pass_left_m = left_m;
    vehicles[row].pass_done_m = 0.0;
    vehicles[row].pass_over_m = over_m;
    vehicles[row].pass_hold_m =
        (props.to_m + body.rear_m + body.tracking_point_m() + 0.5).max(over_m);
    true
}

/// Returns whether the vehicle's route runs for `distance_m` outside conflict zones, on lanes that
/// `suit`.
fn runs(
    vehicles: &VehicleTable,
    row: usize,
    view: &View,
    distance_m: f32,
    suit: impl Fn(u32) -> bool,
) -> bool {
    let tracks = &view.map.tracks;
    let mut reach_m = -vehicles[row].arc_m;
    for &lane in vehicles[row].route.lanes() {
        if tracks.in_zone(lane) || !suit(lane) {
            return false;
        }
        reach_m += tracks.length(lane);
        if reach_m >= distance_m {
            return true;
        }
    }
    false
}

/// Returns whether the course clears all agents that `count`.
fn clears(
    vehicles: &VehicleTable,
    row: usize,
    view: &View,
    distance_m: f32,
    counts: impl Fn(usize) -> bool,
) -> bool {
    let own = view.agents.driven[row];
    let counts = |agent: usize| view.occupancy.reacts_to(own, agent as u32) && counts(agent);
    let tracks = &view.map.tracks;
    obstacles::touched(vehicles, row, tracks, view.agents, distance_m, COURSE_M[0], counts)
        .1
        .is_empty()
}

/// Returns whether no vehicle on the oncoming lane could arrive before this one has driven
/// `distance_m`.
fn no_vehicle_comes(vehicles: &VehicleTable, row: usize, view: &View, distance_m: f32) -> bool {
    let (tracks, agents) = (&view.map.tracks, view.agents);
    let own = agents.driven[row];
    let speed = agents.speed(own as usize).clamp(0.0, SPEED_MPS);
    let duration_s =
        distance_m / SPEED_MPS + (SPEED_MPS - speed).powi(2) / (2.0 * ACCEL_MPS2 * SPEED_MPS);
    let lane = vehicles[row].route.lane();
    let oncoming = view.map.beside.oncoming[lane as usize];
    let limit_mps = 1.1 * tracks.limit_mps[oncoming as usize];
    let place = agents.position[own as usize].truncate();
    let hint_m = tracks.length(oncoming) - vehicles[row].arc_m;
    let here_m = tracks.project(oncoming, place, hint_m).arc_m;
    let reach_m = distance_m + limit_mps * duration_s + ONCOMING_GAP_M;
    let mut open = vec![(oncoming, here_m, reach_m)];
    for _ in 0..LANES_MAX {
        let Some((lane, to_m, reach_m)) = open.pop() else { return true };
        let comes = |o: &&Occupant| {
            o.rear_m < to_m
                && o.front_m > to_m - reach_m
                && o.aligned.abs() > 0.5
                && !stays(agents, o.agent as usize)
                && view.occupancy.reacts_to(own, o.agent)
        };
        let nearest = view
            .occupancy
            .on(lane)
            .iter()
            .filter(comes)
            .max_by(|a, b| a.front_m.total_cmp(&b.front_m).then(a.agent.cmp(&b.agent)));
        match nearest {
            Some(o) if waits_longer(vehicles, row, agents.row[o.agent as usize]) => {}
            Some(_) => return false,
            None if reach_m > to_m => {
                let before = tracks.previous(lane).iter();
                open.extend(before.map(|&l| (l, tracks.length(l), reach_m - to_m)));
            }
            None => {}
        }
    }
    false
}

/// Returns whether an agent stands that this planner does not drive.
fn stays(agents: &Agents, agent: usize) -> bool {
    agents.row[agent] == NONE && agents.velocity[agent].length() < STANDING_MPS
}

/// Returns whether the other vehicle stands behind a prop too, but not as long as this one.
fn waits_longer(vehicles: &VehicleTable, row: usize, other: u32) -> bool {
    let Some(other_s) = vehicles.get(other as usize).map(|other| other.prop_wait_s) else {
        return false;
    };
    let own_s = vehicles[row].prop_wait_s;
    other_s > 0.0 && (own_s > other_s || (own_s == other_s && row < other as usize))
}
