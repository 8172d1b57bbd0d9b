//! Detectors: which vehicles approach which traffic light, as an induction loop before the stop
//! line would report.

use protocol::light;

use crate::{
    agents::Agents,
    constraint::WaitReason,
    demand::Demand,
    grid::Pass,
    junction::{self, Junctions, PASSED_M, STARTING_MPS},
    map::Map,
    occupancy::Occupancy,
    spread::Spread,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Distance before the stop line from which a vehicle demands green.
const CALL_M: f32 = 70.0;
/// Distance to the stop line within which a vehicle extends green.
const NEAR_M: f32 = 20.0;
/// Time to the stop line within which a vehicle extends green.
const SOON_S: f32 = 3.5;
/// Time at the stop line after which a vehicle extends green though its exit is blocked.
const PATIENCE_S: f32 = 30.0;
/// Speed below which a vehicle counts as standing.
const STANDING_MPS: f32 = 0.5;

/// Registers the demand of all vehicles of this frame.
pub(crate) fn count(
    demand: &mut Demand,
    map: &Map,
    vehicles: &VehicleTable,
    agents: &Agents,
    occupancy: &Occupancy,
    junctions: &Junctions,
    spread: Spread,
) {
    demand.reset(map.signals.cycles());
    if map.signals.cycles() == 0 {
        return;
    }
    let mut calls = Vec::new();
    spread.list(vehicles.len(), &mut calls, |row, calls| {
        let vehicle = &vehicles[row];
        if vehicle.located == 0 {
            return;
        }
        let speed = agents.speed(agents.driven[row] as usize);
        let reserved = junction::reserved_lanes(vehicle);
        let mut is_next = true;
        // One that has just started would stop again beyond its line if its light turned yellow.
        let passed_m = if speed < STARTING_MPS { PASSED_M } else { 0.0 };
        for (k, (&lane, &start_m)) in
            vehicle.route.lanes().iter().zip(junctions.starts(row)).enumerate()
        {
            let line_m = start_m - map.approaches.line_m[lane as usize];
            if line_m > CALL_M {
                break;
            }
            if map.approaches.signal[lane as usize] == NONE || start_m <= -passed_m {
                continue;
            }
            if is_next {
                // Green does not help a vehicle whose exit is blocked, nor those queued behind it,
                // unless other phases would fill the exit again and again.
                let moves = k < reserved
                    || speed > STANDING_MPS
                    || matches!(junctions.waits[row], WaitReason::Conflict)
                    || vehicle.wait_s > PATIENCE_S;
                calls.push((lane, line_m, speed, moves));
            } else if k < reserved {
                // Its reservation requires that this light stays green too.
                calls.push((lane, 0.0, speed, true));
            }
            is_next = false;
            if k >= reserved {
                break;
            }
        }
    });
    for (lane, line_m, speed, moves) in calls {
        add(demand, map, lane, line_m, speed, moves);
    }
    // The routes of vehicles that clients drive are unknown: they demand every turn they may take.
    for agent in (0..agents.count()).filter(|&agent| agents.row[agent] == NONE) {
        for &Pass { lane, .. } in map.grid.near(agents.position[agent].truncate()) {
            let on = occupancy.on(lane).iter().find(|o| o.agent == agent as u32);
            let Some(on) = on.filter(|on| on.aligned > 0.7) else { continue };
            let left_m = map.tracks.length(lane) - on.front_m;
            for &exit in map.tracks.next(lane) {
                let line_m = left_m - map.approaches.line_m[exit as usize];
                if line_m < CALL_M && map.approaches.signal[exit as usize] != NONE {
                    add(demand, map, exit, line_m, on.speed_mps, true);
                }
            }
        }
    }
}

/// Gives priority to the lights of vehicles that have no room between two of them and need both, which may
/// never be green together by themselves: after a long time, while the first one is green.
pub(crate) fn prefer(
    demand: &mut Demand,
    map: &Map,
    vehicles: &VehicleTable,
    junctions: &Junctions,
    lights: &[u32],
) {
    for (row, lanes) in junctions.starving() {
        // The route may have become shorter in this frame.
        let way = vehicles[row].route.lanes().get(lanes).unwrap_or_default();
        let signals = way.iter().map(|lane| map.approaches.signal[*lane as usize]);
        let mut signals = signals.filter(|signal| *signal != NONE).peekable();
        let is_green = signals.peek().is_some_and(|first| lights[*first as usize] == light::GREEN);
        let slots: Vec<_> = signals.filter_map(|signal| map.signals.slot(signal)).collect();
        if is_green && slots.len() > 1 {
            slots.iter().for_each(|(cycle, phase)| demand.prefer(*cycle as usize, (*phase).into()));
        }
    }
}

fn add(demand: &mut Demand, map: &Map, lane: u32, line_m: f32, speed: f32, moves: bool) {
    let signal = map.approaches.signal[lane as usize];
    let Some((cycle, phase)) = map.signals.slot(signal) else { return };
    let comes = moves && line_m < NEAR_M.max(SOON_S * speed);
    demand.add(cycle as usize, phase.into(), comes);
}
