//! Controls of one vehicle: car following, steering and recovery, turned into pedals.

use protocol::{VehicleControl, flag, light};

use crate::{
    agents::Agents,
    car_following,
    constraint::JunctionConstraint,
    drivers::Driver,
    emergency::{self, Emergencies},
    leader::{self, Leader},
    map::Map,
    occupancy::Occupancy,
    passing, pedals, reaction, recover, route, steer,
    tracks::NONE,
    vehicle_table::Vehicle,
};

/// Delay between a decision and the middle of its effect: it acts in the next frame, for one frame.
const DELAY_FRAMES: f32 = 1.0;
/// Distance of the end of the route from which on a vehicle brakes for it.
const END_M: f32 = 100.0;
/// Cosine of the angle between the headings of vehicles that come towards each other, at most.
const ONCOMING: f32 = -0.5;
/// Delay of the steering system.
const DELAY_STEERING_S: f32 = 0.05;

/// Inputs of this stage.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) agents: &'a Agents,
    pub(crate) occupancy: &'a Occupancy,
    /// By signal: the state that it shows.
    pub(crate) light_states: &'a [u32],
    /// By row: the leader on the route.
    pub(crate) leaders: &'a [Leader],
    pub(crate) emergencies: &'a Emergencies,
    /// By row: the constraint of the next junction.
    pub(crate) constraints: &'a [JunctionConstraint],
    /// By row: the speed that curves and speed limits allow.
    pub(crate) desired_speeds: &'a [f32],
    /// By row: the lateral offset that a client has set.
    pub(crate) offsets_left_m: &'a [f32],
    /// By row: the driver.
    pub(crate) drivers: &'a [Driver],
    pub(crate) seed: u64,
    /// By row: the gap to keep at standstill.
    pub(crate) gaps: &'a [f32],
}

/// Returns the controls of the vehicle of a located row, without its lights.
pub(crate) fn control(
    vehicle: &mut Vehicle,
    row: usize,
    view: &View,
    delta_s: f32,
) -> VehicleControl {
    let (agents, tracks) = (view.agents, &view.map.tracks);
    let agent = agents.driven[row] as usize;
    let speed = agents.speed(agent);
    let (front_m, max_steer_rad) = (agents.body[agent].front_m, agents.body[agent].max_steer_rad);

    let delay_s = DELAY_FRAMES * delta_s + DELAY_STEERING_S;
    let (wheels, deviation) =
        steer::steer(vehicle, row, tracks, agents, delay_s, view.offsets_left_m[row]);
    let off_track = recover::is_off_track(&deviation);

    let mut leader = view.leaders[row];
    if vehicle.shift_m != 0.0 {
        leader = leader_during_change(vehicle, row, view, leader);
    }
    let mut constraint = view.constraints[row];
    let end_m = car_following::route_end(vehicle, tracks, front_m, END_M);
    if end_m < END_M {
        let last = vehicle.route.last();
        let back = tracks.u_turn_lane[last as usize] != NONE;
        let half_width_m = agents.body[agent].half_width_m;
        let room_m = if back {
            route::U_TURN_ROOM_M
        } else {
            1.0 + car_following::taper_m(tracks, last, half_width_m)
        };
        constraint.stop_m = constraint.stop_m.min((end_m - room_m).max(0.0));
    }
    stop_at_midblock_signals(view.map, vehicle, view.light_states, front_m, speed, &mut constraint);
    let mut desired = view.desired_speeds[row];
    if off_track {
        desired = desired.min(recover::off_track_mps(speed));
    }
    let gap_m = if passing::may_pull_out(vehicle, agents, &leader) {
        view.gaps[row].max(passing::pull_out_m(&agents.body[agent]))
    } else {
        view.gaps[row]
    };
    let driver = &view.drivers[row];
    let leader_id = agents.id.get(leader.agent as usize).copied().unwrap_or(0);
    let noise = (view.seed, delta_s);
    let leaders = [leader, leader_of(&leader, view)];
    let seen = reaction::perceive(vehicle, leaders, leader_id, speed, driver, noise);
    let mut accel =
        car_following::accelerate(speed.max(0.0), desired, &seen, &constraint, gap_m, driver);
    let ahead_m = recover::OFF_TRACK_FREE_M + speed.max(0.0);
    let off_track_blocker =
        if off_track { recover::blocker(agents, agent, 1.0, ahead_m) } else { None };
    if off_track_blocker.is_some() {
        accel = accel.min(if speed < recover::FAST_MPS { -3.0 } else { -recover::FAST_BRAKE_MPS2 });
    }
    let emergency = view.emergencies.of_row(row);
    if emergency.is_some() {
        accel = accel.min(-emergency::FULL_BRAKE_MPS2);
    }
    if let Some(other) = emergency.or(off_track_blocker) {
        // It does not go on until the other one has gone; else it drives back.
        leader = Leader { gap_m: 0.0, speed_mps: 0.0, agent: other, aligned: 0.0 };
    }
    let lateral_mps2 = speed * agents.yaw_rate[agent];
    accel = accel.max(-agents.body[agent].brake_max_mps2(lateral_mps2));

    // A vehicle whose driver is about to start is not stuck.
    accel = reaction::start(vehicle, speed, accel, &leader, gap_m, driver, delta_s);
    let is_for_oncoming = comes_towards(agents, leader.agent as usize, agent);
    let steered = (wheels, &deviation);
    let back_rad = steer::back_rad(vehicle, tracks, &agents.body[agent], steered, is_for_oncoming);
    let maneuver = if desired <= car_following::STANDSTILL_MPS {
        recover::end(vehicle);
        recover::Maneuver::Forward
    } else {
        let inputs = (accel, back_rad);
        recover::decide(vehicle, row, (tracks, agents), &deviation, &leader, inputs, delta_s)
    };
    if maneuver == recover::Maneuver::Hold {
        accel = accel.min(-1.0);
    }
    if maneuver == recover::Maneuver::Reverse {
        let backward = -speed;
        let mut accel_integral = vehicle.accel_integral;
        let pressed = pedals::press(
            recover::reverse_accel(backward),
            -agents.acceleration[agent],
            backward,
            -agents.pitch_sin[agent],
            delta_s,
            &mut accel_integral,
        );
        vehicle.accel_integral = accel_integral;
        return pedals_and_steering(
            pressed,
            pedals::steer_input(back_rad, max_steer_rad, speed),
            flag::REVERSE,
        );
    }
    let mut accel_integral = vehicle.accel_integral;
    let pressed = pedals::press(
        accel,
        agents.acceleration[agent],
        speed,
        agents.pitch_sin[agent],
        delta_s,
        &mut accel_integral,
    );
    vehicle.accel_integral = accel_integral;
    pedals_and_steering(pressed, pedals::steer_input(wheels, max_steer_rad, speed), 0)
}

/// Returns whether another vehicle of this planner heads towards an agent.
fn comes_towards(agents: &Agents, other: usize, agent: usize) -> bool {
    let is_driven = agents.row.get(other).is_some_and(|&row| row != NONE);
    is_driven && agents.forward[other].dot(agents.forward[agent]) < ONCOMING
}

/// Returns the leader of a leader: that of the row if this planner drives it.
fn leader_of(leader: &Leader, view: &View) -> Leader {
    let row = view.agents.row.get(leader.agent as usize);
    row.and_then(|&row| view.leaders.get(row as usize)).copied().unwrap_or(Leader::NONE)
}

/// During a lane change, the leader on the lane that is left counts too, unless the vehicle
/// will be clear of it.
fn leader_during_change(vehicle: &Vehicle, row: usize, view: &View, leader: Leader) -> Leader {
    let (tracks, full) = (&view.map.tracks, vehicle.shift_m);
    let own = view.agents.driven[row];
    let body = view.agents.body[own as usize];
    let mut begins = -vehicle.arc_m - body.front_m;
    for (nth, &lane) in vehicle.route.lanes().iter().enumerate() {
        if begins > vehicle.shift_over_m {
            break;
        }
        let index = lane as usize;
        let beside = if full > 0.0 { tracks.left[index] } else { tracks.right[index] };
        if beside == NONE {
            break;
        }
        let (mut start, mut from) = (begins, f32::NEG_INFINITY);
        if nth == 0 {
            // Neighbouring lanes run side by side, but are longer by a part of each curve.
            let hint_m = vehicle.arc_m * tracks.length(beside) / tracks.length(lane).max(0.1);
            let place = view.agents.position[own as usize].truncate();
            from = tracks.project(beside, place, hint_m).arc_m;
            start = -from - body.front_m;
        }
        let old = leader::first_ahead(view.occupancy, beside, [own, NONE], start, from);
        if old.gap_m.is_finite() {
            let there = route::shift_at(vehicle, old.gap_m.max(0.0)).left_m;
            let apart = full.abs() - there.abs();
            let clear = body.half_width_m + view.agents.body[old.agent as usize].half_width_m;
            return if apart < clear + 0.3 && old.gap_m < leader.gap_m { old } else { leader };
        }
        begins += tracks.length(lane);
    }
    leader
}

/// Adds stops before mid-block traffic lights.
fn stop_at_midblock_signals(
    map: &Map,
    vehicle: &Vehicle,
    light_states: &[u32],
    front_m: f32,
    speed: f32,
    constraint: &mut JunctionConstraint,
) {
    let midblock = &map.approaches.midblock;
    if midblock.is_empty() {
        return;
    }
    let mut begins = -vehicle.arc_m - front_m;
    for &lane in vehicle.route.lanes() {
        if begins > 200.0 {
            return;
        }
        let from = midblock.partition_point(|stop| stop.0 < lane);
        for &(_, arc_m, signal) in midblock[from..].iter().take_while(|stop| stop.0 == lane) {
            let line_m = begins + arc_m - 0.5;
            let shown = light_states[signal as usize];
            let stops = shown == light::RED || shown == light::YELLOW;
            if stops && line_m > -0.5 && speed * speed < 6.0 * line_m.max(0.1) {
                constraint.stop_m = constraint.stop_m.min(line_m.max(0.0));
            }
        }
        begins += map.tracks.length(lane);
    }
}

/// Returns controls with these pedals, steering and flags.
fn pedals_and_steering(pressed: pedals::Pedals, steer: f32, flags: u32) -> VehicleControl {
    VehicleControl {
        flags,
        throttle: pressed.throttle,
        brake: pressed.brake,
        steer,
        ..VehicleControl::default()
    }
}
