//! Detectors: which vehicles approach which traffic light, as an induction loop before the stop
//! line would report.

use crate::{
    agents::Agents, constraint::WaitReason, demand::Demand, grid::Pass, junction::Junctions,
    map::Map, occupancy::Occupancy, spread::Spread, tracks::NONE, vehicle_table::VehicleTable,
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
        for (&lane, &start_m) in vehicle.route.lanes().iter().zip(junctions.starts(row)) {
            let line_m = start_m - map.approaches.line_m[lane as usize];
            if line_m > CALL_M {
                break;
            }
            if map.approaches.signal[lane as usize] != NONE && start_m > 0.0 {
                // Green does not help a vehicle whose exit is blocked, nor those queued behind it,
                // unless other phases would fill the exit again and again.
                let moves = speed > STANDING_MPS
                    || matches!(junctions.waits[row], WaitReason::Conflict)
                    || vehicle.wait_s > PATIENCE_S;
                calls.push((lane, line_m, speed, moves));
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

fn add(demand: &mut Demand, map: &Map, lane: u32, line_m: f32, speed: f32, moves: bool) {
    let signal = map.approaches.signal[lane as usize];
    let Some((cycle, phase)) = map.signals.slot(signal) else { return };
    let comes = moves && line_m < NEAR_M.max(SOON_S * speed);
    demand.add(cycle as usize, phase.into(), comes);
}
