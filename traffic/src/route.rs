//! The position of each vehicle on its route, and the extension of routes.

use crate::{
    agents::Agents,
    client_route::ClientRoutes,
    grid::{Grid, Pass},
    occupancy::Occupancy,
    random::{Purpose, draw},
    spread::Spread,
    tracks::{NONE, Tracks, lookup::Memo},
    vehicle_table::{Route, Vehicle, VehicleTable},
};

/// Least length of a route ahead, as far as lanes continue.
const AHEAD_M: f32 = 320.0;
/// Cross-track distance beyond which a vehicle is located afresh.
const LOST_M: f32 = 4.5;

/// Distance beyond a fork over which vehicle density is compared.
const DENSITY_REACH_M: f32 = 80.0;

/// Number of planned vehicles on each lane.
pub(crate) struct LaneLoad(Vec<u32>);

impl LaneLoad {
    /// Counts the vehicles of the table.
    pub(crate) fn count(vehicles: &VehicleTable, tracks: &Tracks) -> LaneLoad {
        let mut load = LaneLoad(vec![0; tracks.count()]);
        for row in (0..vehicles.len()).filter(|&row| vehicles[row].located == 1) {
            load.0[vehicles[row].route.lane() as usize] += 1;
        }
        load
    }

    /// Returns the vehicles per metre on `way` and the lanes that follow it.
    fn density(&self, tracks: &Tracks, branch: u32) -> f32 {
        let (mut at, mut length_m, mut vehicles) = (branch, 0.0, 0);
        loop {
            length_m += tracks.length(at);
            vehicles += self.0[at as usize];
            let fork = !tracks.in_junction(at) && length_m > DENSITY_REACH_M;
            match tracks.next(at) {
                [next, ..] if !fork && length_m < 4.0 * DENSITY_REACH_M => at = *next,
                _ => return vehicles as f32 / length_m.max(1.0),
            }
            if at == branch {
                return vehicles as f32 / length_m.max(1.0);
            }
        }
    }
}

/// Locates every vehicle on its route and extends the route.
pub(crate) fn locate_all(
    vehicles: &mut VehicleTable,
    client_routes: &mut ClientRoutes,
    tracks: &Tracks,
    grid: &Grid,
    agents: &Agents,
    memos: &mut Vec<Memo>,
    (seed, spread): (u64, Spread),
) {
    memos.resize(vehicles.len(), Memo::default());
    let load = LaneLoad::count(vehicles, tracks);
    spread.update_pairs(vehicles, memos, |row, vehicle, memo| {
        let agent = agents.driven[row] as usize;
        if vehicle.located == 1 && agents.flags[agent] & protocol::flag::TELEPORTED != 0 {
            vehicle.reset();
        }
        if vehicle.located == 1 && !advance(vehicle, memo, tracks, agents, agent) {
            clear_location(vehicle);
        }
        if vehicle.located == 0 {
            locate(vehicle, tracks, grid, agents, agent);
        }
        if vehicle.located == 1 && !client_routes.has(vehicle.id) {
            extend(vehicle, client_routes, tracks, &load, seed);
        }
    });
    if client_routes.is_empty() {
        return;
    }
    for vehicle in vehicles.iter_mut().filter(|vehicle| vehicle.located == 1) {
        if client_routes.has(vehicle.id) {
            client_routes.update(vehicle, tracks, grid);
            extend(vehicle, client_routes, tracks, &load, seed);
        }
    }
}

/// Advances a row along its route; returns `false` if the vehicle is no longer on it.
fn advance(
    vehicle: &mut Vehicle,
    memo: &mut Memo,
    tracks: &Tracks,
    agents: &Agents,
    agent: usize,
) -> bool {
    let position = agents.position[agent].truncate();
    let before = (vehicle.route.lanes_passed, vehicle.arc_m);
    let mut projection = memo.project(tracks, vehicle.route.lane(), position, vehicle.arc_m + 0.5);
    let mut driven = projection.arc_m - before.1;
    while projection.arc_m > tracks.length(vehicle.route.lane()) && vehicle.route.lanes().len() > 1
    {
        let length = tracks.length(vehicle.route.lane());
        vehicle.route.pop();
        let next = vehicle.route.lane();
        let on = tracks.project(next, position, (projection.arc_m - length).max(0.0));
        driven += (length + on.arc_m) - projection.arc_m;
        projection = on;
    }
    vehicle.arc_m = projection.arc_m;
    if vehicle.shift_m != 0.0 {
        vehicle.shift_done_m += driven.max(0.0);
        if vehicle.shift_done_m >= vehicle.shift_over_m {
            vehicle.shift_m = 0.0;
            vehicle.shift_done_m = 0.0;
            vehicle.shift_over_m = 0.0;
        }
    }
    if vehicle.passes_prop() {
        vehicle.pass_done_m = (vehicle.pass_done_m + driven).max(0.0);
        if vehicle.pass_done_m >= vehicle.pass_hold_m + vehicle.pass_over_m {
            vehicle.end_pass();
        }
    }
    let cross_track_m = projection.left_m - shift_at(vehicle, 0.0).left_m;
    let aligned = projection.tangent.dot(agents.forward[agent]);
    if vehicle.u_turn == 1 {
        vehicle.u_turn = u32::from(aligned < 0.7);
        return projection.left_m.abs() < 4.0 * LOST_M;
    }
    let backwards = aligned < -0.2;
    let jumped = driven.abs() > 8.0;
    cross_track_m.abs() < LOST_M && !backwards && !jumped && projection.arc_m > -6.0
}

/// Clears the location and everything that depends on it.
fn clear_location(vehicle: &mut Vehicle) {
    vehicle.located = 0;
    (vehicle.shift_m, vehicle.shift_done_m, vehicle.shift_over_m) = (0.0, 0.0, 0.0);
    vehicle.end_pass();
    (vehicle.reservation, vehicle.reservation_end, vehicle.reservation_idle_s) = (0, 0, 0.0);
    vehicle.wait_s = 0.0;
    vehicle.u_turn = 0;
}

/// Distance before a dead end at which vehicles stop for a U-turn.
pub(crate) const U_TURN_ROOM_M: f32 = 9.0;

/// Radius in which a U-turn requires that no vehicle is ahead and none makes a U-turn.
const U_TURN_CLEARANCE_M: f32 = 16.0;

/// Starts U-turns of vehicles that stand at dead ends, when no vehicle is coming.
pub(crate) fn start_u_turns(
    vehicles: &mut VehicleTable,
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
    spread: Spread,
) {
    let mut at_ends = Vec::new();
    spread.list(vehicles.len(), &mut at_ends, |row, at_ends| {
        if let ([lane], 1) = (vehicles[row].route.lanes(), vehicles[row].located) {
            at_ends.push((row, *lane));
        }
    });
    for (row, lane) in at_ends {
        start_u_turn(vehicles, (row, lane), tracks, agents, occupancy);
    }
}

/// Starts a U-turn of a row if its route ends with its lane.
fn start_u_turn(
    vehicles: &mut VehicleTable,
    (row, lane): (usize, u32),
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
) {
    let u_turn_lane = tracks.u_turn_lane[lane as usize];
    let own = agents.driven[row];
    let agent = own as usize;
    let left_m = tracks.length(lane) - vehicles[row].arc_m - agents.body[agent].front_m;
    if u_turn_lane == NONE || agents.speed(agent).abs() > 0.5 || left_m > U_TURN_ROOM_M + 3.0 {
        return;
    }
    let position = agents.position[agent].truncate();
    let projection = tracks.project(
        u_turn_lane,
        position,
        (tracks.length(u_turn_lane) - vehicles[row].arc_m).max(0.0),
    );
    let coming = occupancy.on(u_turn_lane).iter().any(|o| {
        let reach = agents.body[agent].length_m() + 6.0 + 4.0 * o.speed_mps.max(0.0);
        o.agent != own && (o.front_m - projection.arc_m).abs() < reach
    });
    let around = agents.places.near(position, U_TURN_CLEARANCE_M);
    let rows = around.into_iter().map(|other| agents.row[other as usize]);
    let occupied = rows.filter(|&other| other != NONE).any(|other| {
        let other = other as usize;
        let place = agents.position[agents.driven[other] as usize].truncate();
        let ahead = (place - position).dot(agents.forward[agent]) > 0.0;
        let near = place.distance_squared(position) < U_TURN_CLEARANCE_M * U_TURN_CLEARANCE_M;
        other != row && near && (ahead || vehicles[other].u_turn == 1)
    });
    if coming || occupied {
        return;
    }
    vehicles[row].route =
        Route::from_lane(u_turn_lane, vehicles[row].route.lanes_passed.wrapping_add(1));
    vehicles[row].arc_m = projection.arc_m.clamp(0.0, tracks.length(u_turn_lane));
    vehicles[row].u_turn = 1;
}

/// Puts a row onto the track that best fits the vehicle's position and heading.
fn locate(vehicle: &mut Vehicle, tracks: &Tracks, grid: &Grid, agents: &Agents, agent: usize) {
    let position = agents.position[agent];
    let flat = position.truncate();
    let mut best: Option<(f32, u32, f32)> = None;
    let mut consider = |lane: u32, hint_m: f32| {
        let projection = tracks.project(lane, flat, hint_m);
        let (centre, ..) = tracks.at(lane, projection.arc_m);
        let beyond = (projection.arc_m - projection.arc_m.clamp(0.0, tracks.length(lane))).abs();
        let cost = projection.left_m.abs()
            + beyond
            + 4.0 * (1.0 - projection.tangent.dot(agents.forward[agent]))
            + 3.0 * ((centre.z - position.z).abs() - 1.0).max(0.0)
            + if tracks.endless[lane as usize] { 0.0 } else { 1.5 };
        if best.is_none_or(|(least, ..)| cost < least) {
            best = Some((cost, lane, projection.arc_m));
        }
    };
    for &Pass { lane, hint_m, .. } in grid.near(flat) {
        consider(lane, hint_m);
    }
    if best.is_none() {
        // Far from every road, which is rare: searches all tracks.
        if let Some((lane, hint_m)) = tracks.nearest(flat) {
            let projection = tracks.project(lane, flat, hint_m);
            best = Some((0.0, lane, projection.arc_m));
        }
    }
    if let Some((_, lane, arc_m)) = best {
        vehicle.route = Route::from_lane(lane, vehicle.route.lanes_passed.wrapping_add(1));
        vehicle.arc_m = arc_m.clamp(0.0, tracks.length(lane));
        vehicle.located = 1;
    }
}

/// Extends the route by the lanes of a client's route, else by random turns, until it is long
/// enough.
pub(crate) fn extend(
    vehicle: &mut Vehicle,
    client_routes: &ClientRoutes,
    tracks: &Tracks,
    load: &LaneLoad,
    seed: u64,
) {
    let mut reach = -vehicle.arc_m;
    for &lane in vehicle.route.lanes() {
        reach += tracks.length(lane);
        if reach >= AHEAD_M {
            return;
        }
    }
    while reach < AHEAD_M && !vehicle.route.is_full() {
        let (id, count) = (vehicle.id, vehicle.route.lanes().len());
        let last = vehicle.route.last();
        let commanded =
            client_routes.next(id, count, last).filter(|branch| tracks.next(last).contains(branch));
        let Some(next) =
            commanded.or_else(|| draw_turn(tracks, last, load, (seed, id, vehicle.turn_draws)))
        else {
            return;
        };
        if tracks.next(last).len() > 1 {
            vehicle.turn_draws = vehicle.turn_draws.wrapping_add(1);
        }
        vehicle.route.push(next);
        reach += tracks.length(next);
    }
}

/// Draws the successor of `lane`, away from dead ends if possible. Of two draws the one with the
/// lower vehicle density is taken, which keeps random routes from concentrating.
fn draw_turn(tracks: &Tracks, lane: u32, load: &LaneLoad, draws: (u64, u32, u32)) -> Option<u32> {
    let (seed, id, count) = draws;
    let branches = tracks.next(lane);
    let open = branches.iter().filter(|&&branch| tracks.endless[branch as usize]).count();
    let is_open = |branch: &&u32| open == 0 || tracks.endless[**branch as usize];
    let choices = if open == 0 { branches.len() } else { open };
    if choices == 0 {
        return None;
    }
    let pick = |purpose| {
        let nth = draw(seed, id, purpose, u64::from(count)) % choices as u64;
        branches.iter().filter(is_open).nth(nth as usize).copied()
    };
    let (first, second) = (pick(Purpose::Turn)?, pick(Purpose::TurnAlternative)?);
    let is_better = load.density(tracks, second) < load.density(tracks, first);
    Some(if is_better { second } else { first })
}

/// Lateral offset from a route's tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shift {
    /// Positive to the left, metres.
    pub(crate) left_m: f32,
    /// Its derivative by the arc length.
    pub(crate) slope: f32,
    /// Its second derivative.
    pub(crate) bend_per_m: f32,
}

impl Shift {
    /// Returns the sum of this and a multiple of another offset.
    fn plus(self, factor: f32, other: Shift) -> Shift {
        Shift {
            left_m: self.left_m + factor * other.left_m,
            slope: self.slope + factor * other.slope,
            bend_per_m: self.bend_per_m + factor * other.bend_per_m,
        }
    }
}

/// Returns the lateral offset from the route's tracks after `ahead_m` more metres: quintic blends from
/// where a lane change began, and to the side of a prop and back.
pub(crate) fn shift_at(vehicle: &Vehicle, ahead_m: f32) -> Shift {
    let mut sum = Shift::default();
    let begin_m = vehicle.shift_m;
    if begin_m != 0.0 {
        let over = blend(vehicle.shift_done_m + ahead_m, vehicle.shift_over_m);
        sum = Shift { left_m: begin_m, ..sum }.plus(-begin_m, over);
    }
    if vehicle.passes_prop() {
        let (side, over) = (vehicle.pass_left_m, vehicle.pass_over_m);
        let done = vehicle.pass_done_m + ahead_m;
        let back = blend(done - vehicle.pass_hold_m, over);
        sum = sum.plus(side, blend(done, over)).plus(-side, back);
    }
    sum
}

/// Returns a quintic blend from 0 to 1 over `over` metres, after `done` metres.
fn blend(done: f32, over: f32) -> Shift {
    let u = (done / over).clamp(0.0, 1.0);
    Shift {
        left_m: u * u * u * (10.0 - 15.0 * u + 6.0 * u * u),
        slope: 30.0 * u * u * (1.0 - u) * (1.0 - u) / over,
        bend_per_m: 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (over * over),
    }
}

/// Returns the point on the route `ahead_m` after the vehicle's position: its lane and arc length.
pub(crate) fn ahead(vehicle: &Vehicle, tracks: &Tracks, ahead_m: f32) -> (u32, f32) {
    let lanes = vehicle.route.lanes();
    let mut arc_m = vehicle.arc_m + ahead_m;
    for &lane in &lanes[..lanes.len() - 1] {
        let length = tracks.length(lane);
        if arc_m <= length {
            return (lane, arc_m);
        }
        arc_m -= length;
    }
    (lanes[lanes.len() - 1], arc_m)
}
