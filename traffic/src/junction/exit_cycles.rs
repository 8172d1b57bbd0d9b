//! Cycles of queues that wait for each other's exit room.
//!
//! A vehicle that enters a junction needs room beyond it. If the queue that takes that room waits
//! at a junction itself, for room that a third takes, and so on back to the first, no vehicle could
//! ever go. If the first vehicles of all these queues go at once, each frees the room that another
//! needs.

use super::state::{Junctions, Request, View};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Waiting time for exit room after which a cycle is searched.
const PATIENCE_S: f32 = 12.0;

impl Junctions {
    /// Grants reservations to all vehicles that wait for each other's exit room in a cycle.
    pub(super) fn grant_exit_cycles(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        // First vehicles of queues that lack exit room only, and the vehicles that take it.
        let heads: Vec<(Request, u32)> = self
            .requests
            .iter()
            .filter(|request| vehicles[request.row].wait_s > PATIENCE_S && request.from > 0)
            // A vehicle that has just dropped its way through the junction requests nothing.
            .filter(|request| vehicles[request.row].route.lanes().len() >= request.to)
            .filter(|request| self.waits[request.row] == WaitReason::ExitBlocked)
            .filter_map(|request| {
                let agent = self.exit_room(vehicles, request, view).err()?;
                let row = view.agents.row.get(agent as usize).copied().unwrap_or(NONE);
                (row != NONE && vehicles[row as usize].located == 1).then_some((*request, row))
            })
            .collect();
        let after: Vec<Option<usize>> = heads
            .iter()
            .map(|&(_, blocker)| {
                let entry_lane = entry_lane(vehicles, blocker as usize, view)?;
                heads.iter().position(|(head, _)| {
                    vehicles[head.row].route.lanes()[head.from - 1] == entry_lane
                })
            })
            .collect();
        let mut done = vec![false; heads.len()];
        for start in 0..heads.len() {
            if done[start] {
                continue;
            }
            let Some(cycle) = cycle(&after, start) else { continue };
            for &head in &cycle {
                done[head] = true;
            }
            if cycle.iter().all(|&head| self.is_clear(vehicles, &heads[head].0, view).is_ok()) {
                for &head in &cycle {
                    self.grant(vehicles, reservations, &heads[head].0, view);
                    self.constraints[heads[head].0.row] = JunctionConstraint::FREE;
                }
            }
        }
    }
}

/// Returns the lane by which a row will reach the next junction.
fn entry_lane(vehicles: &VehicleTable, row: usize, view: &View) -> Option<u32> {
    let lanes = vehicles[row].route.lanes();
    let entry = lanes.iter().skip(1).position(|&lane| view.map.tracks.in_zone(lane))?;
    Some(lanes[entry])
}

/// Returns the cycle that contains `start`, if there is one.
fn cycle(after: &[Option<usize>], start: usize) -> Option<Vec<usize>> {
    let mut cycle = vec![start];
    let mut at = after[start]?;
    while at != start {
        if cycle.contains(&at) {
            return None;
        }
        cycle.push(at);
        at = after[at]?;
    }
    Some(cycle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_found_only_from_its_members() {
        let after = [Some(1), Some(2), Some(0), Some(0), None];
        assert_eq!(cycle(&after, 0), Some(vec![0, 1, 2]));
        assert_eq!(cycle(&after, 3), None);
        assert_eq!(cycle(&after, 4), None);
    }
}
