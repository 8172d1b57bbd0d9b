//! Courtesy at the end of a lane: of the vehicles beside, the first that can do so with comfortable
//! braking makes room for a vehicle that waits there for a gap, as in a zip merge.

use crate::{
    agents::Agents,
    constraint::JunctionConstraint,
    lane_change::clear_run,
    leader::Leader,
    occupancy::Occupancy,
    spread::Spread,
    tracks::{NONE, Tracks},
    vehicle_table::{Vehicle, VehicleTable},
};

/// Distance from the end of a lane within which a slow vehicle waits for a gap.
const NEAR_END_M: f32 = 30.0;
/// Speed below which it does.
const WAITING_MPS: f32 = 2.0;
/// Distance behind it over which vehicles are examined.
const BEHIND_M: f32 = 120.0;
/// Deceleration with which a vehicle makes room, and up to which one that brakes goes on with it.
const BRAKE_MPS2: f32 = 2.0;
const BRAKING_MPS2: f32 = 4.0;
/// Acceleration below which a vehicle brakes.
const BRAKES_BELOW_MPS2: f32 = -0.5;
/// Gap that it keeps.
const GAP_M: f32 = 4.0;
/// Least length of the lane beside that the waiting vehicle needs.
const ROOM_M: f32 = 15.0;

/// Makes the vehicles that wait leaders of those that make room for them, beside their own leaders.
pub(crate) fn make_room(
    vehicles: &VehicleTable,
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
    leaders: &[Leader],
    spread: Spread,
    constraints: &mut [JunctionConstraint],
) {
    let mut waiting = Vec::new();
    spread.list(vehicles.len(), &mut waiting, |row, waiting| {
        let vehicle = &vehicles[row];
        if tracks.endless[vehicle.route.last() as usize] || vehicle.located == 0 {
            return;
        }
        let agent = agents.driven[row] as usize;
        if let Some(side) = waits_beside(vehicle, agent, &leaders[row], tracks, agents) {
            waiting.push((row, side));
        }
    });
    for (row, side) in waiting {
        let (vehicle, agent) = (&vehicles[row], agents.driven[row] as usize);
        let place = agents.position[agent].truncate();
        let lane = vehicle.route.lane();
        let hint_m = vehicle.arc_m * tracks.length(side) / tracks.length(lane).max(0.1);
        let rear_m = tracks.project(side, place, hint_m).arc_m - agents.body[agent].rear_m;
        let (own, speed_mps) = (agent as u32, agents.speed(agent).max(0.0));
        let Some((gap_m, follower)) =
            follower(vehicles, own, (side, rear_m), tracks, agents, occupancy)
        else {
            continue;
        };
        let constraint = &mut constraints[follower];
        if gap_m < constraint.merge_leader_m {
            (constraint.merge_leader_m, constraint.merge_leader_mps) = (gap_m, speed_mps);
        }
    }
}

/// Returns the lane that a vehicle waits to change to, if it waits at the end of its own.
fn waits_beside(
    vehicle: &Vehicle,
    agent: usize,
    leader: &Leader,
    tracks: &Tracks,
    agents: &Agents,
) -> Option<u32> {
    let lane = vehicle.route.lane();
    let left_m = tracks.usable_m[lane as usize] - vehicle.arc_m - agents.body[agent].front_m;
    let waits = vehicle.shift_m == 0.0
        && tracks.next(lane).is_empty()
        && tracks.u_turn_lane[lane as usize] == NONE
        && left_m < NEAR_END_M
        && leader.gap_m > left_m
        && agents.speed(agent) < WAITING_MPS;
    let sides = [tracks.left[lane as usize], tracks.right[lane as usize]];
    let may_take = |side: &u32| {
        *side != NONE
            && tracks.endless[*side as usize]
            && clear_run(tracks, *side, vehicle.arc_m) > ROOM_M
    };
    sides.into_iter().find(|side| waits && may_take(side))
}

/// Returns the gap and the row of the nearest vehicle behind a place on a lane that can stop there.
fn follower(
    vehicles: &VehicleTable,
    own: u32,
    (side, rear_m): (u32, f32),
    tracks: &Tracks,
    agents: &Agents,
    occupancy: &Occupancy,
) -> Option<(f32, usize)> {
    let before = tracks.previous(side).iter().map(|&lane| (lane, tracks.length(lane)));
    let behind = [(side, 0.0)].into_iter().chain(before).flat_map(|(lane, offset_m)| {
        let occupants = occupancy.on(lane).iter();
        occupants.map(move |it| (rear_m + offset_m - it.front_m, it))
    });
    behind
        .filter(|(gap_m, it)| {
            let row = agents.row[it.agent as usize];
            let room_m = gap_m - GAP_M;
            let brakes = agents.acceleration[it.agent as usize] < BRAKES_BELOW_MPS2;
            let brake_mps2 = if brakes { BRAKING_MPS2 } else { BRAKE_MPS2 };
            (0.0..BEHIND_M).contains(&room_m)
                && it.speed_mps * it.speed_mps <= 2.0 * brake_mps2 * room_m
                && row != NONE
                && occupancy.reacts_to(it.agent, own)
                && !tracks.in_zone(vehicles[row as usize].route.lane())
        })
        .map(|(gap_m, it)| (gap_m, agents.row[it.agent as usize] as usize))
        .min_by(|a, b| a.0.total_cmp(&b.0))
}
