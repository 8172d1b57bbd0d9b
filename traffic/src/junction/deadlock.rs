//! Rings of vehicles that stand for each other at a junction.
//!
//! The order of leaves has no cycle, but the queue has a say too: who has leave may stand behind
//! one who has none, because that one waits for a third who gives way to the first. Nobody of such
//! a ring would ever go, nor would those who stand for one of them. The one without leave then
//! goes before all of these, if none of them is in the way yet.

use super::gap_acceptance::is_wide;
use super::state::{Junctions, Request, View, present, reserved_lanes};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    leader,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Waiting for so long for others makes one think of a ring.
const PATIENCE_S: f32 = 4.0;
/// Who is no farther behind another stands because of him.
const BEHIND_M: f32 = 5.0;
/// Longer rings are not looked for.
const CYCLE_LEN_MAX: usize = 16;

/// Whether one who has waited for so long looks round: when patience ends, then every second.
fn is_time(waited_s: f32, view: &View) -> bool {
    waited_s >= PATIENCE_S && waited_s.floor() > (waited_s - view.delta_s).floor()
}

impl Junctions {
    /// Gives leave to the first vehicle of each ring that lacks it.
    pub(super) fn break_deadlocks(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let row = request.row;
            // Who has just given up his way has none to ask for.
            let asks = vehicles.route[row].lanes().len() >= request.to;
            if !asks
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

    /// Lets one go first who has leave but gives way to somebody who stands for him.
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
            let held = cycle
                .iter()
                .map(|&row| vehicles.reservation[row])
                .filter(|&reservation| reservation != 0);
            let earliest = held.min().unwrap_or(0);
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

    /// Whether one of `bound` is in the way that a row has leave for.
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
                    let is_bound = other != NONE && blocked.contains(&(other as usize));
                    let wide = is_wide(view, own, holder.agent);
                    conflict.between(wide).is_some_and(|meet| {
                        let body = view.agents.body[holder.agent as usize];
                        let lanes_passed = -holder.start_m > meet.theirs.1 + body.length_m();
                        let there = holder.start_m + meet.theirs.0 <= 0.0 && !lanes_passed;
                        let mine = -self.start(row, k) < meet.mine.1;
                        holder.agent != own && is_bound && there && mine
                    })
                })
            })
        })
    }

    /// All who stand for each other, from `row` back to itself.
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

    /// A ring, and all who stand for one of it.
    fn blocked(&self, vehicles: &VehicleTable, cycle: &[usize], view: &View) -> Vec<usize> {
        let mut blocked = cycle.to_vec();
        for row in (0..vehicles.id.len()).filter(|&row| vehicles.located[row] == 1) {
            let mut queue = vec![row];
            while let Some(&last) = queue.last().filter(|last| !blocked.contains(last)) {
                let agent = self.blocker_of(vehicles, last, view);
                let next = view.agents.row.get(agent as usize).copied().unwrap_or(NONE);
                let stands = |row: usize| {
                    let agent = view.agents.driven[row] as usize;
                    view.agents.velocity[agent].length_squared() < 0.25
                };
                let goes_on = next != NONE && queue.len() < CYCLE_LEN_MAX && stands(last);
                if !goes_on || queue.contains(&(next as usize)) {
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

    /// Because of whom a row stands: an index into the crowd, or [`NONE`].
    fn blocker_of(&self, vehicles: &VehicleTable, row: usize, view: &View) -> u32 {
        let yields = vehicles.reservation[row] != 0 && self.yields_to[row] != NONE;
        let asked = if yields { self.yields_to[row] } else { self.blockers[row] };
        let (tracks, agents) = (&view.map.tracks, view.agents);
        let mut leader = leader::leader(vehicles, row, tracks, agents, view.occupancy, BEHIND_M);
        for obstacle in view.obstacles.iter().filter(|obstacle| obstacle.row == row) {
            leader = leader.nearer(obstacle.leader);
        }
        if leader.gap_m < BEHIND_M && (asked == NONE || leader.gap_m < self.constraints[row].stop_m)
        {
            leader.agent
        } else {
            asked
        }
    }

    /// Gives leave before the earliest leave of those who are bound.
    fn grant_first(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        blocked: &[usize],
        request: &Request,
        view: &View,
    ) {
        let held = blocked
            .iter()
            .map(|&row| vehicles.reservation[row])
            .filter(|&reservation| reservation != 0);
        let Some(earliest) = held.min() else { return };
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
