//! Gap acceptance: whether a vehicle may enter now, and to which vehicles a holder yields.

use super::state::{
    BRAKE_MPS2, Junctions, PASSED_M, Request, View, Yielding, request_lanes, reserved_lanes,
};
use crate::{
    approach::Sign,
    constraint::WaitReason,
    leader::{Leader, leader},
    obstacles,
    swept_path::RUN_OUT_M,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Time gap between two vehicles in the same conflict area.
const MARGIN_S: f32 = 0.8;
/// Time gap between two vehicles that merge into one lane.
const MERGE_S: f32 = 1.3;
/// A standing holder that is farther from the conflict area than this, in seconds, sees a vehicle
/// there in time.
const STANDING_LEAD_S: f32 = 3.5;
/// Gap within which a standing vehicle waits for its leader.
const BEHIND_M: f32 = 3.0;
/// Longest queue that is followed.
const QUEUE_LEN_MAX: usize = 8;
/// Least time until a vehicle of higher rank arrives.
const CUT_OFF_S: f32 = 1.2;

/// Which of the vehicles that wait in a cycle need not be clear of the way.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Blocked {
    /// All of them.
    All,
    /// Those that are not in a conflict area of the way.
    Outside,
}

impl Junctions {
    /// Returns whether a vehicle may enter now, or else why it waits and for which agent (an index
    /// into the agents, or [`NONE`]).
    pub(super) fn assess(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> (WaitReason, u32) {
        // The vehicle is in the junction already. One whose front alone is over the line waits at red.
        let is_in = if request.red { -PASSED_M } else { 0.0 };
        if request.entry_m <= is_in {
            return (WaitReason::None, NONE);
        }
        let wait = self.right_of_way(vehicles, request, view);
        if wait != WaitReason::None { (wait, NONE) } else { self.way_free(vehicles, request, view) }
    }

    /// Returns whether the way of a vehicle and its exit are free, or else why it waits and for which
    /// agent (an index into the agents, or [`NONE`]), whatever lights, signs and the queue require.
    pub(super) fn way_free(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> (WaitReason, u32) {
        if let Err(agent) = self.exit_room(vehicles, request, view) {
            return (WaitReason::ExitBlocked, agent);
        }
        if let Err(agent) = self.is_clear(vehicles, request, view) {
            return (WaitReason::Conflict, agent);
        }
        if let Err(agent) = self.swept_path_free(vehicles, request, view) {
            return (WaitReason::SweptPath, agent);
        }
        (WaitReason::None, NONE)
    }

    /// Returns whether lights, signs and the queue on its own lane let the vehicle enter.
    pub(super) fn right_of_way(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> WaitReason {
        if request.red {
            return WaitReason::Signal;
        }
        let row = request.row;
        let speed = request.speed_mps.max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 1.5 * speed + 8.0;
        let lane = vehicles[row].route.lanes()[request.from];
        let full_stop = self.sign(&vehicles[row], row, request.from, view) != Sign::Stop
            || view.map.approaches.signal[lane as usize] != NONE
            || vehicles[row].wait_s > 0.8;
        if !full_stop {
            WaitReason::Signal
        } else if request.line_m >= horizon || !self.is_first(vehicles, request, view) {
            WaitReason::Queue
        } else {
            WaitReason::None
        }
    }

    /// Returns whether nothing stands in the swept path of a wide vehicle through the junction, or
    /// else the agent there (an index into the agents).
    fn swept_path_free(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        let lanes = &vehicles[request.row].route.lanes()[request.from..];
        let out_m = self.start(request.row, request.to) + RUN_OUT_M;
        let blocks = |leader: &Leader| {
            let on_way = lanes.iter().any(|&lane| {
                view.occupancy.on(lane).iter().any(|o| o.agent == leader.agent && o.aligned > 0.7)
            });
            !on_way && leader.gap_m <= out_m && leader.gap_m >= request.line_m - 1.0
        };
        let mut obstacles = obstacles::of_row(view.obstacles, request.row).iter();
        let found = obstacles.find(|obstacle| blocks(&obstacle.leader));
        found.map_or(Ok(()), |obstacle| Err(obstacle.leader.agent))
    }

    /// Returns whether every vehicle between here and the line has a reservation.
    pub(super) fn is_first(&self, vehicles: &VehicleTable, request: &Request, view: &View) -> bool {
        let own = view.agents.driven[request.row];
        for k in 0..request.from {
            let start = self.start(request.row, k);
            for occupant in view.occupancy.on(vehicles[request.row].route.lanes()[k]) {
                let (front, rear) = (start + occupant.front_m, start + occupant.rear_m);
                if !view.occupancy.reacts_to(own, occupant.agent)
                    || front < 0.0
                    || rear > request.entry_m
                {
                    continue;
                }
                let row = view.agents.row[occupant.agent as usize];
                // A rear end before the line belongs to a vehicle that is in the junction already.
                let leaving = front > request.entry_m + 1.0 && occupant.speed_mps > 1.0;
                let holds = row != NONE && vehicles[row as usize].reservation != 0;
                if !holds && !leaving {
                    return false;
                }
            }
        }
        true
    }

    /// Returns whether the way is free of holders, vehicles of higher rank and obstacles, or else
    /// the agent in the way (an index into the agents).
    pub(super) fn is_clear(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        self.is_clear_except(&[], Blocked::All, vehicles, request, view)
    }

    /// As [`Junctions::is_clear`], except for `those` of the `blocked` rows.
    pub(super) fn is_clear_except(
        &self,
        blocked: &[usize],
        those: Blocked,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        let row = request.row;
        let own = view.agents.driven[row];
        let lanes = vehicles[row].route.lanes();
        let is_blocked = |agent: u32| {
            let other = view.agents.row[agent as usize];
            other != NONE && blocked.contains(&(other as usize))
        };
        for (k, &lane) in request_lanes(lanes, request) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                for holder in self.holders.of(conflict.other) {
                    let Some(area) = conflict.between(are_wide(view, own, holder.agent)) else {
                        continue;
                    };
                    if !view.occupancy.reacts_to(own, holder.agent) {
                        continue;
                    }
                    let own_window = self.window(view, own, start, area.own, lane, f32::INFINITY);
                    let stuck = is_idle(vehicles, view, holder.agent);
                    let other_window = self.arrival(view, holder, area.other);
                    if other_window.1 <= 0.0 {
                        continue;
                    }
                    let is_there = holder.start_m + area.other.0 <= 0.0;
                    if (!is_there || those == Blocked::All) && is_blocked(holder.agent) {
                        continue;
                    }
                    let behind =
                        conflict.merge && !stuck && other_window.0 + MERGE_S < own_window.0;
                    let margin_s = margin_s(view, own, holder.agent);
                    let after = !stuck && other_window.1 + margin_s < own_window.0;
                    let before = own_window.1 + margin_s < other_window.0;
                    let far_from_standing = stuck && other_window.0 > STANDING_LEAD_S;
                    if !(after || before || behind || far_from_standing) {
                        return Err(holder.agent);
                    }
                }
                for other in self.approaching.of(conflict.other) {
                    let Some(area) = conflict.between(are_wide(view, own, other.agent)) else {
                        continue;
                    };
                    if !view.occupancy.reacts_to(own, other.agent) || other.rank >= request.rank {
                        continue;
                    }
                    let own_window = self.window(view, own, start, area.own, lane, f32::INFINITY);
                    let other_window = self.arrival(view, other, area.other);
                    if own_window.1 + CUT_OFF_S - MARGIN_S + margin_s(view, own, other.agent)
                        > other_window.0
                        && other_window.0 < 8.0
                    {
                        return Err(other.agent);
                    }
                }
                let obstacle = view.occupancy.on(lane).iter().find(|o| {
                    conflict.between(are_wide(view, own, o.agent)).is_some_and(|area| {
                        view.occupancy.reacts_to(own, o.agent)
                            && o.aligned < 0.6
                            && o.speed_mps.abs() < 2.0
                            && o.front_m > area.own.0
                            && o.rear_m < area.own.1
                            && is_idle(vehicles, view, o.agent)
                            && !(those == Blocked::All && is_blocked(o.agent))
                    })
                });
                if let Some(occupant) = obstacle {
                    return Err(occupant.agent);
                }
            }
        }
        Ok(())
    }

    /// Makes the holders of later reservations yield to the holders of earlier ones.
    pub(super) fn give_way(&mut self, vehicles: &VehicleTable, view: &View) {
        let mut yielding = std::mem::take(&mut self.yielding);
        view.spread.list(vehicles.len(), &mut yielding, |row, yielding| {
            if vehicles[row].reservation != 0 {
                yielding.push(self.yielding(vehicles, row, view));
            }
        });
        for of in &yielding {
            self.constraints[of.row] = of.constraint;
            self.yields_to[of.row] = of.yields_to;
            self.merges_behind[of.row] = of.merges_behind;
        }
        self.yielding = yielding;
    }

    /// Returns to which holders of earlier reservations the holder of a row yields.
    fn yielding(&self, vehicles: &VehicleTable, row: usize, view: &View) -> Yielding {
        let own = view.agents.driven[row];
        let lanes = vehicles[row].route.lanes();
        let brake_m = view.agents.velocity[own as usize].length_squared() / (2.0 * BRAKE_MPS2);
        let mut constraint = self.constraints[row];
        let (mut yields_to, mut merges_behind) = (NONE, NONE);
        for (k, &lane) in lanes.iter().enumerate().take(reserved_lanes(&vehicles[row])) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                for holder in self.holders.of(conflict.other) {
                    let Some(area) = conflict.between(are_wide(view, own, holder.agent)) else {
                        continue;
                    };
                    let other = view.agents.row[holder.agent as usize];
                    if !view.occupancy.reacts_to(own, holder.agent)
                        || (other != NONE
                            && vehicles[other as usize].reservation > vehicles[row].reservation)
                        || (vehicles[row].reservation_idle_s > 4.0
                            && is_idle(vehicles, view, holder.agent))
                        || stands_behind(vehicles, view, holder.agent, own)
                    {
                        continue;
                    }
                    let own_window = self.window(view, own, start, area.own, lane, f32::INFINITY);
                    let other_window = self.arrival(view, holder, area.other);
                    if other_window.1 <= 0.0 {
                        continue;
                    }
                    if conflict.merge {
                        // The gap to the other vehicle, as if it were on this vehicle's path to the
                        // merge.
                        let length = view.agents.body[holder.agent as usize].length_m();
                        let front = start + area.own.1 - (holder.start_m + area.other.1);
                        let gap = front - length;
                        let speed = view.agents.velocity[holder.agent as usize].length();
                        if gap >= 0.0 {
                            if gap < constraint.merge_leader_m {
                                (constraint.merge_leader_m, constraint.merge_leader_mps) =
                                    (gap, speed);
                                merges_behind = holder.agent;
                            }
                            continue;
                        }
                    }
                    let is_before = own_window.1 + 0.5 * MARGIN_S < other_window.0;
                    if is_before || other_window.1 + 0.5 * MARGIN_S <= own_window.0 {
                        continue;
                    }
                    let wide = are_wide(view, own, holder.agent);
                    let Some(stop_m) = conflict.stop_at(wide, -start, brake_m) else { continue };
                    let before_m = if wide == (false, false) { 0.5 } else { 1.2 };
                    let stop_m = (start + stop_m - before_m).max(0.0);
                    if stop_m < constraint.stop_m {
                        constraint.stop_m = stop_m;
                        yields_to = holder.agent;
                    }
                }
            }
        }
        Yielding { row, constraint, yields_to, merges_behind }
    }
}

/// Returns whether an agent stands though no rule stops it, or for reasons unknown here.
fn is_idle(vehicles: &VehicleTable, view: &View, agent: u32) -> bool {
    let row = view.agents.row[agent as usize];
    let is_standing = view.agents.velocity[agent as usize].length_squared() < 0.25;
    is_standing
        && (row == NONE
            || vehicles[row as usize].reservation == 0
            || vehicles[row as usize].reservation_idle_s > 1.5)
}

/// Returns whether an agent stands because another one is in front of it, or in front of the queue
/// in which it stands: it cannot go first, whatever its reservation.
fn stands_behind(vehicles: &VehicleTable, view: &View, agent: u32, other: u32) -> bool {
    let (tracks, agents) = (&view.map.tracks, view.agents);
    let mut at = agent;
    for _ in 0..QUEUE_LEN_MAX {
        let row = agents.row[at as usize];
        if row == NONE || agents.velocity[at as usize].length_squared() > 0.25 {
            return false;
        }
        let ahead =
            leader(&vehicles[row as usize], row as usize, tracks, agents, view.occupancy, BEHIND_M);
        if ahead.gap_m > BEHIND_M || ahead.agent == other {
            return ahead.agent == other;
        }
        at = ahead.agent;
    }
    false
}

/// Returns the time gap between two vehicles; large vehicles are harder to predict.
fn margin_s(view: &View, a: u32, b: u32) -> f32 {
    if are_wide(view, a, b) == (false, false) { MARGIN_S } else { 2.0 * MARGIN_S }
}

/// Returns for each of two agents whether it is wide.
pub(super) fn are_wide(view: &View, a: u32, b: u32) -> (bool, bool) {
    (view.agents.body[a as usize].is_wide(), view.agents.body[b as usize].is_wide())
}
