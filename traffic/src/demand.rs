//! Who wants which light to be green: what a detector loop before the line would report.

use crate::junction::Junctions;
use crate::map::Map;
use crate::outlook::Wait;
use crate::perceive::{Crowd, Occupancy};
use crate::rows::Rows;
use crate::tracks::NONE;

/// From so far before its line on, a vehicle calls for green.
const CALL_M: f32 = 70.0;
/// Whoever is nearer than this keeps green from ending,
const NEAR_M: f32 = 20.0;
/// or will be at the line so soon.
const SOON_S: f32 = 3.5;

/// Slower than this, one stands.
const STANDING_MPS: f32 = 0.5;

/// By cycle, a bit for each phase.
#[derive(Default)]
pub(crate) struct Demand {
    waits: Vec<u64>,
    comes: Vec<u64>,
}

impl Demand {
    /// Whether somebody stands before a light of this phase, or is on his way there.
    pub(crate) fn waits(&self, cycle: usize, phase: u64) -> bool {
        self.waits.get(cycle).is_some_and(|bits| bits >> phase.min(63) & 1 == 1)
    }

    /// Whether somebody is so near to such a light that he should still pass.
    pub(crate) fn comes(&self, cycle: usize, phase: u64) -> bool {
        self.comes.get(cycle).is_some_and(|bits| bits >> phase.min(63) & 1 == 1)
    }

    /// One cycle in which these phases are waited for and come to.
    #[cfg(test)]
    pub(crate) fn of(waits: &[u64], comes: &[u64]) -> Demand {
        let bits = |phases: &[u64]| vec![phases.iter().fold(0, |bits, phase| bits | 1 << phase)];
        Demand { waits: bits(waits), comes: bits(comes) }
    }

    /// Takes down who comes to which light.
    pub(crate) fn count(
        &mut self,
        map: &Map,
        rows: &Rows,
        crowd: &Crowd,
        occupancy: &Occupancy,
        junctions: &Junctions,
    ) {
        for bits in [&mut self.waits, &mut self.comes] {
            bits.clear();
            bits.resize(map.signals.cycles(), 0);
        }
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
                    // Green is of no use to who has no room beyond, nor to who stands behind him.
                    let moves =
                        speed > STANDING_MPS || matches!(junctions.waits[row], Wait::Others);
                    self.call(map, lane, line_m, speed, moves);
                    break;
                }
            }
        }
        // Of vehicles that others drive nobody knows where they will turn.
        for body in (0..crowd.count()).filter(|&body| crowd.row[body] == NONE) {
            for &(lane, _) in map.grid.near(crowd.position[body].truncate()) {
                let on = occupancy.on(lane).iter().find(|o| o.body == body as u32);
                let Some(on) = on.filter(|on| on.aligned > 0.7) else { continue };
                let left_m = map.tracks.length(lane) - on.front_m;
                for &way in map.tracks.next(lane) {
                    let line_m = left_m - map.approaches.line_m[way as usize];
                    if line_m < CALL_M && map.approaches.signal[way as usize] != NONE {
                        self.call(map, way, line_m, on.speed_mps, true);
                    }
                }
            }
        }
    }

    fn call(&mut self, map: &Map, lane: u32, line_m: f32, speed: f32, moves: bool) {
        let signal = map.approaches.signal[lane as usize];
        let Some((cycle, phase)) = map.signals.seat(signal) else { return };
        let bit = 1 << phase.min(63);
        self.waits[cycle as usize] |= bit;
        if moves && line_m < NEAR_M.max(SOON_S * speed) {
            self.comes[cycle as usize] |= bit;
        }
    }
}
