//! Detectors: which vehicles approach which traffic light, as an induction loop before the stop
//! line would report.

use crate::{
    agents::Crowd, constraint::Wait, demand::Demand, junction::Junctions, map::Map,
    occupancy::Occupancy, rows::Rows, tracks::NONE,
};

/// Distance before the stop line from which a vehicle demands green.
const CALL_M: f32 = 70.0;
/// Distance to the stop line within which a vehicle extends green.
const NEAR_M: f32 = 20.0;
/// Time to the stop line within which a vehicle extends green.
const SOON_S: f32 = 3.5;
/// Speed below which a vehicle counts as standing.
const STANDING_MPS: f32 = 0.5;

/// Registers the demand of all vehicles of this frame.
pub(crate) fn count(
    demand: &mut Demand,
    map: &Map,
    rows: &Rows,
    crowd: &Crowd,
    occupancy: &Occupancy,
    junctions: &Junctions,
) {
    demand.reset(map.signals.cycles());
    if map.signals.cycles() == 0 {
        return;
    }
    for row in (0..rows.id.len()).filter(|&row| rows.placed[row] == 1) {
        let speed = crowd.speed(crowd.driven[row] as usize);
        for (&lane, &start_m) in rows.route[row].lanes().iter().zip(junctions.starts(row)) {
            let line_m = start_m - map.approaches.line_m[lane as usize];
            if line_m > CALL_M {
                break;
            }
            if map.approaches.signal[lane as usize] != NONE && start_m > 0.0 {
                // Green does not help a vehicle whose exit is blocked, nor those queued behind it.
                let moves = speed > STANDING_MPS || matches!(junctions.waits[row], Wait::Others);
                add(demand, map, lane, line_m, speed, moves);
                break;
            }
        }
    }
    // The routes of vehicles that clients drive are unknown: they demand every turn they may take.
    for body in (0..crowd.count()).filter(|&body| crowd.row[body] == NONE) {
        for &(lane, _) in map.grid.near(crowd.position[body].truncate()) {
            let on = occupancy.on(lane).iter().find(|o| o.body == body as u32);
            let Some(on) = on.filter(|on| on.aligned > 0.7) else { continue };
            let left_m = map.tracks.length(lane) - on.front_m;
            for &way in map.tracks.next(lane) {
                let line_m = left_m - map.approaches.line_m[way as usize];
                if line_m < CALL_M && map.approaches.signal[way as usize] != NONE {
                    add(demand, map, way, line_m, on.speed_mps, true);
                }
            }
        }
    }
}

fn add(demand: &mut Demand, map: &Map, lane: u32, line_m: f32, speed: f32, moves: bool) {
    let signal = map.approaches.signal[lane as usize];
    let Some((cycle, phase)) = map.signals.seat(signal) else { return };
    let comes = moves && line_m < NEAR_M.max(SOON_S * speed);
    demand.add(cycle as usize, phase.into(), comes);
}
