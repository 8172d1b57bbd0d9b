//! Deadlocks: cycles of vehicles that wait for each other at a junction.
//!
//! The order of reservations has no cycle, but queues add dependencies: a holder may stand behind a
//! vehicle without a reservation, which waits for a third that yields to the first. No vehicle of
//! such a cycle would ever go, nor would those that wait for one of them. The vehicle without a
//! reservation then goes before all of these, if none of them is in its way yet.

use super::gap_acceptance::is_wide;
use super::state::{Junctions, Request, View, present, reserved_lanes};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    leader,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Waiting time after which a cycle is searched.
const PATIENCE_S: f32 = 4.0;
/// Gap within which a vehicle waits for its leader.
const BEHIND_M: f32 = 5.0;
/// Length of the longest cycle that is searched.
const CYCLE_LEN_MAX: usize = 16;

/// Returns whether a vehicle searches for a cycle in this frame: after its patience, then every
/// second.
fn is_time(waited_s: f32, view: &View) -> bool {
    waited_s >= PATIENCE_S && waited_s.floor() > (waited_s - view.delta_s).floor()
}

impl Junctions {
    /// Grants a reservation to the first vehicle without one of each cycle.
    pub(super) fn break_deadlocks(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let row = request.row;
            // A vehicle that has just dropped its way through the junction requests nothing.
            let requests_way = vehicles.route[row].lanes().len() >= request.to;
            if !requests_way
                || self.waits[row] != WaitReason::Conflict
                || !is_time(vehicles.wait_s[row], view)
            {
                continue;
            }
            let Some(cycle) = self.cycle(vehicles, row, view) else { continue };
            let blocked = self.blocked(vehicles, &cycle, view);
            if self.exit_room(vehicles, &request, view).is_ok()
                && self.is_clear_except(&blocked, vehicles, &request, view).is_ok()
            {
                self.grant_first(vehicles, reservations, &blocked, &request, view);
            }
        }
    }

    /// Moves a reservation forward whose holder yields to a vehicle that waits for the holder.
    pub(super) fn break_yield_cycles(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        for row in 0..vehicles.id.len() {
            if vehicles.located[row] == 0
                || !is_time(vehicles.reservation_idle_s[row], view)
                || self.yields_to[row] == NONE
            {
                continue;
            }
            let Some(cycle) = self.cycle(vehicles, row, view) else { continue };
            let blocked = self.blocked(vehicles, &cycle, view);
            let reserved = cycle
                .iter()
                .map(|&row| vehicles.reservation[row])
                .filter(|&reservation| reservation != 0);
            let earliest = reserved.min().unwrap_or(0);
            if earliest == vehicles.reservation[row]
                || self.is_blocked(vehicles, row, &blocked, view)
            {
                continue;
            }
            for reservation in
                vehicles.reservation.iter_mut().filter(|reservation| **reservation >= earliest)
            {
                *reservation += 1;
            }
            *reservations += 1;
            vehicles.reservation[row] = earliest;
        }
    }

    /// Returns whether one of the `blocked` rows is in the conflict areas of a row's reservation.
    fn is_blocked(
        &self,
        vehicles: &VehicleTable,
        row: usize,
        blocked: &[usize],
        view: &View,
    ) -> bool {
        let own = view.agents.driven[row];
        let lanes = vehicles.route[row].lanes();
        lanes.iter().take(reserved_lanes(vehicles, row)).enumerate().any(|(k, &lane)| {
            view.map.conflicts.of(lane).iter().any(|conflict| {
                present(&self.holders, conflict.other).iter().any(|holder| {
                    let other = view.agents.row[holder.agent as usize];
                    let is_blocked_row = other != NONE && blocked.contains(&(other as usize));
                    let wide = is_wide(view, own, holder.agent);
                    conflict.between(wide).is_some_and(|area| {
                        let body = view.agents.body[holder.agent as usize];
                        let has_passed = -holder.start_m > area.other.1 + body.length_m();
                        let is_there = holder.start_m + area.other.0 <= 0.0 && !has_passed;
                        let is_ahead = -self.start(row, k) < area.own.1;
                        holder.agent != own && is_blocked_row && is_there && is_ahead
                    })
                })
            })
        })
    }

    /// Returns the cycle of waiting vehicles from `row` back to itself.
    fn cycle(&self, vehicles: &VehicleTable, row: usize, view: &View) -> Option<Vec<usize>> {
        let mut cycle = vec![row];
        loop {
            let agent = self.blocker_of(vehicles, cycle[cycle.len() - 1], view);
            let next = *view.agents.row.get(agent as usize)?;
            if next == NONE || view.agents.velocity[agent as usize].length_squared() > 0.25 {
                return None;
            }
            let next = next as usize;
            if next == row {
                return Some(cycle);
            }
            if cycle.contains(&next) || cycle.len() == CYCLE_LEN_MAX || vehicles.located[next] == 0
            {
                return None;
            }
            cycle.push(next);
        }
    }

    /// Returns the rows of a cycle and all rows that wait for one of them.
    fn blocked(&self, vehicles: &VehicleTable, cycle: &[usize], view: &View) -> Vec<usize> {
        let mut blocked = cycle.to_vec();
        for row in (0..vehicles.id.len()).filter(|&row| vehicles.located[row] == 1) {
            let mut queue = vec![row];
            while let Some(&last) = queue.last().filter(|last| !blocked.contains(last)) {
                let agent = self.blocker_of(vehicles, last, view);
                let next = view.agents.row.get(agent as usize).copied().unwrap_or(NONE);
                let is_standing = |row: usize| {
                    let agent = view.agents.driven[row] as usize;
                    view.agents.velocity[agent].length_squared() < 0.25
                };
                let continues = next != NONE && queue.len() < CYCLE_LEN_MAX && is_standing(last);
                if !continues || queue.contains(&(next as usize)) {
                    queue.clear();
                } else {
                    queue.push(next as usize);
                }
            }
            queue.pop();
            blocked.extend(queue);
        }
        blocked
    }

    /// Returns the agent that a row waits for: an index into the agents, or [`NONE`].
    fn blocker_of(&self, vehicles: &VehicleTable, row: usize, view: &View) -> u32 {
        let yields = vehicles.reservation[row] != 0 && self.yields_to[row] != NONE;
        let required = if yields { self.yields_to[row] } else { self.blockers[row] };
        let (tracks, agents) = (&view.map.tracks, view.agents);
        let mut leader = leader::leader(vehicles, row, tracks, agents, view.occupancy, BEHIND_M);
        for obstacle in view.obstacles.iter().filter(|obstacle| obstacle.row == row) {
            leader = leader.nearer(obstacle.leader);
        }
        if leader.gap_m < BEHIND_M
            && (required == NONE || leader.gap_m < self.constraints[row].stop_m)
        {
            leader.agent
        } else {
            required
        }
    }

    /// Grants a reservation before the earliest one of the `blocked` rows.
    fn grant_first(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        blocked: &[usize],
        request: &Request,
        view: &View,
    ) {
        let reserved = blocked
            .iter()
            .map(|&row| vehicles.reservation[row])
            .filter(|&reservation| reservation != 0);
        let Some(earliest) = reserved.min() else { return };
        for reservation in
            vehicles.reservation.iter_mut().filter(|reservation| **reservation >= earliest)
        {
            *reservation += 1;
        }
        *reservations += 1;
        vehicles.reservation[request.row] = earliest;
        vehicles.reservation_idle_s[request.row] = 0.0;
        self.revoke_behind(vehicles, request);
        self.grant(vehicles, reservations, request, view);
        self.constraints[request.row] = JunctionConstraint::FREE;
    }
}
