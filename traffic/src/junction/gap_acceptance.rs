//! Whether someone may pass now, and to whom he gives way once he may.

use super::state::{
    BRAKE_MPS2, Junctions, Request, STANDING_GAP_M, View, present, request_lanes, reserved_lanes,
};
use crate::{
    approach::Sign, constraint::WaitReason, swept_path::RUN_OUT_M, tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Seconds between two who use the same place one after the other.
const MARGIN_S: f32 = 0.8;
/// Seconds between two who merge into one lane.
const MERGE_S: f32 = 1.3;
/// Who stands though he may pass, and is farther than so many seconds away, sees in time who is
/// before him.
const STANDING_LEAD_S: f32 = 3.5;
/// Seconds that must remain before someone of higher rank comes.
const CUT_OFF_S: f32 = 1.2;

impl Junctions {
    /// Whether a vehicle may pass now, or what for it must wait, and for whom (an index into the
    /// crowd, or [`NONE`]).
    pub(super) fn assess(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> (WaitReason, u32) {
        // Who is in already is in.
        if request.entry_m <= 0.0 {
            return (WaitReason::None, NONE);
        }
        let wait = self.right_of_way(vehicles, request, view);
        if wait != WaitReason::None {
            return (wait, NONE);
        }
        if let Err(agent) = self.exit_room(vehicles, request, view) {
            return (WaitReason::ExitBlocked, agent);
        }
        if let Err(agent) = self.is_clear(vehicles, request, view) {
            return (WaitReason::Conflict, agent);
        }
        if !self.is_swept_path_free(vehicles, request, view) {
            return (WaitReason::SweptPath, NONE);
        }
        (WaitReason::None, NONE)
    }

    /// Whether it is this vehicle's turn as far as lights, signs and its own queue go.
    pub(super) fn right_of_way(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> WaitReason {
        let row = request.row;
        let agent = view.agents.driven[row] as usize;
        let speed = view.agents.speed(agent).max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 1.5 * speed + 8.0;
        let lane = vehicles.route[row].lanes()[request.from];
        let full_stop = self.sign(vehicles, row, request.from, view) != Sign::Stop
            || view.map.approaches.signal[lane as usize] != NONE
            || vehicles.wait_s[row] > 0.8;
        if request.red || !full_stop {
            WaitReason::Signal
        } else if request.line_m >= horizon || !self.is_first(vehicles, request, view) {
            WaitReason::Queue
        } else {
            WaitReason::None
        }
    }

    /// Whether nobody stands where a wide vehicle would sweep on its way through.
    fn is_swept_path_free(&self, vehicles: &VehicleTable, request: &Request, view: &View) -> bool {
        let lanes = &vehicles.route[request.row].lanes()[request.from..];
        let out_m = self.start(request.row, request.to) + RUN_OUT_M;
        view.obstacles.iter().filter(|obstacle| obstacle.row == request.row).all(|obstacle| {
            let leader = &obstacle.leader;
            let on_way = lanes.iter().any(|&lane| {
                view.occupancy.on(lane).iter().any(|o| o.agent == leader.agent && o.aligned > 0.7)
            });
            on_way || leader.gap_m > out_m || leader.gap_m < request.line_m - 1.0
        })
    }

    /// Whether everybody between here and the line has leave himself.
    pub(super) fn is_first(&self, vehicles: &VehicleTable, request: &Request, view: &View) -> bool {
        let own = view.agents.driven[request.row];
        for k in 0..request.from {
            let start = self.start(request.row, k);
            for occupant in view.occupancy.on(vehicles.route[request.row].lanes()[k]) {
                let (front, rear) = (start + occupant.front_m, start + occupant.rear_m);
                if !view.occupancy.reacts_to(own, occupant.agent)
                    || front < 0.0
                    || rear > request.entry_m
                {
                    continue;
                }
                let row = view.agents.row[occupant.agent as usize];
                // A tail in front of the line belongs to someone who is in already.
                let leaving = front > request.entry_m + 1.0 && occupant.speed_mps > 1.0;
                let holds = row != NONE && vehicles.reservation[row as usize] != 0;
                if !holds && !leaving {
                    return false;
                }
            }
        }
        true
    }

    /// Whether there is room to stand beyond the junction; if not, who takes it (an index into the
    /// crowd).
    pub(super) fn exit_room(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        let (tracks, row) = (&view.map.tracks, request.row);
        let lanes = vehicles.route[row].lanes();
        if request.to >= lanes.len() {
            return Ok(());
        }
        let own = view.agents.driven[row];
        let exit = lanes[request.to];
        let mut need = view.agents.body[own as usize].length_m() + STANDING_GAP_M;
        for holder in 0..vehicles.id.len() {
            if holder == row || vehicles.reservation[holder] == 0 || vehicles.located[holder] == 0 {
                continue;
            }
            let end = reserved_lanes(vehicles, holder);
            let route = vehicles.route[holder].lanes();
            if end > 0 && end < route.len() && route[end] == exit {
                let body = view.agents.body[view.agents.driven[holder] as usize];
                need += body.length_m() + STANDING_GAP_M;
            }
        }
        let begin = self.start(row, request.to);
        let (mut room, mut blocker) = (f32::INFINITY, own);
        for (k, &lane) in lanes.iter().enumerate().skip(request.to) {
            let start = self.start(row, k);
            if start - begin > need + 1.0 || (k > request.to && tracks.in_junction(lane)) {
                break;
            }
            for occupant in view.occupancy.on(lane) {
                let inside = view.agents.row[occupant.agent as usize];
                let counted = inside != NONE
                    && vehicles.reservation[inside as usize] != 0
                    && start + occupant.front_m < begin + 1.0;
                if !view.occupancy.reacts_to(own, occupant.agent)
                    || counted
                    || start + occupant.front_m < begin
                {
                    continue;
                }
                // Who moves on makes room until we are there, but not beyond his next line.
                let until_m = if inside == NONE {
                    f32::INFINITY
                } else {
                    self.to_next_line(vehicles, inside as usize, view)
                };
                let gains = (2.0 * (occupant.speed_mps - 1.0)).max(0.0).min(until_m.max(0.0));
                let free = start + occupant.rear_m - begin + gains;
                if free < room {
                    (room, blocker) = (free, occupant.agent);
                }
            }
        }
        if room >= need { Ok(()) } else { Err(blocker) }
    }

    /// How far it is to the first line before which a row must stop as things stand.
    fn to_next_line(&self, vehicles: &VehicleTable, row: usize, view: &View) -> f32 {
        let lanes = vehicles.route[row].lanes();
        let next = (reserved_lanes(vehicles, row)..lanes.len())
            .find(|&k| view.map.tracks.in_junction(lanes[k]));
        next.map_or(f32::INFINITY, |k| {
            self.start(row, k) - view.map.approaches.line_m[lanes[k] as usize]
        })
    }

    /// Whether nobody with leave, nobody of higher rank and nothing in the way is met; if not, who
    /// is (an index into the crowd).
    pub(super) fn is_clear(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        self.is_clear_except(&[], vehicles, request, view)
    }

    /// The same, but for those of `bound` (rows) who are not in the way yet.
    pub(super) fn is_clear_except(
        &self,
        blocked: &[usize],
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Result<(), u32> {
        let row = request.row;
        let own = view.agents.driven[row];
        let lanes = vehicles.route[row].lanes();
        for (k, &lane) in request_lanes(lanes, request) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                for holder in present(&self.holders, conflict.other) {
                    let Some(meet) = conflict.between(is_wide(view, own, holder.agent)) else {
                        continue;
                    };
                    if !view.occupancy.reacts_to(own, holder.agent) {
                        continue;
                    }
                    let mine = self.window(view, own, start, meet.mine, lane, f32::INFINITY);
                    let stuck = is_idle(vehicles, view, holder.agent);
                    let theirs = self.arrival(view, holder, meet.theirs);
                    if theirs.1 <= 0.0 {
                        continue;
                    }
                    let there = holder.start_m + meet.theirs.0 <= 0.0;
                    let other = view.agents.row[holder.agent as usize];
                    if !there && other != NONE && blocked.contains(&(other as usize)) {
                        continue;
                    }
                    let behind = conflict.merge && !stuck && theirs.0 + MERGE_S < mine.0;
                    let margin_s = margin_s(view, own, holder.agent);
                    let after = !stuck && theirs.1 + margin_s < mine.0;
                    let before = mine.1 + margin_s < theirs.0;
                    let far_from_standing = stuck && theirs.0 > STANDING_LEAD_S;
                    if !(after || before || behind || far_from_standing) {
                        return Err(holder.agent);
                    }
                }
                for other in present(&self.approaching, conflict.other) {
                    let Some(meet) = conflict.between(is_wide(view, own, other.agent)) else {
                        continue;
                    };
                    if !view.occupancy.reacts_to(own, other.agent) || other.rank >= request.rank {
                        continue;
                    }
                    let mine = self.window(view, own, start, meet.mine, lane, f32::INFINITY);
                    let theirs = self.arrival(view, other, meet.theirs);
                    if mine.1 + CUT_OFF_S - MARGIN_S + margin_s(view, own, other.agent) > theirs.0
                        && theirs.0 < 8.0
                    {
                        return Err(other.agent);
                    }
                }
                let blocked = view.occupancy.on(lane).iter().find(|o| {
                    conflict.between(is_wide(view, own, o.agent)).is_some_and(|meet| {
                        view.occupancy.reacts_to(own, o.agent)
                            && o.aligned < 0.6
                            && o.speed_mps.abs() < 2.0
                            && o.front_m > meet.mine.0
                            && o.rear_m < meet.mine.1
                            && is_idle(vehicles, view, o.agent)
                    })
                });
                if let Some(occupant) = blocked {
                    return Err(occupant.agent);
                }
            }
        }
        Ok(())
    }

    /// Makes the holder of a later leave yield to those with earlier ones.
    pub(super) fn give_way(&mut self, vehicles: &VehicleTable, row: usize, view: &View) {
        let own = view.agents.driven[row];
        let lanes = vehicles.route[row].lanes();
        let mut constraint = self.constraints[row];
        for (k, &lane) in lanes.iter().enumerate().take(reserved_lanes(vehicles, row)) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                for holder in present(&self.holders, conflict.other) {
                    let Some(meet) = conflict.between(is_wide(view, own, holder.agent)) else {
                        continue;
                    };
                    let other = view.agents.row[holder.agent as usize];
                    if !view.occupancy.reacts_to(own, holder.agent)
                        || (other != NONE
                            && vehicles.reservation[other as usize] > vehicles.reservation[row])
                        || (vehicles.reservation_idle_s[row] > 4.0
                            && is_idle(vehicles, view, holder.agent))
                    {
                        continue;
                    }
                    let mine = self.window(view, own, start, meet.mine, lane, f32::INFINITY);
                    let theirs = self.arrival(view, holder, meet.theirs);
                    if theirs.1 <= 0.0 {
                        continue;
                    }
                    if conflict.merge {
                        // Where he is on his way to the merge, seen as a distance on ours.
                        let length = view.agents.body[holder.agent as usize].length_m();
                        let front = start + meet.mine.1 - (holder.start_m + meet.theirs.1);
                        let gap = front - length;
                        let speed = view.agents.velocity[holder.agent as usize].length();
                        if gap >= 0.0 {
                            if gap < constraint.merge_leader_m {
                                (constraint.merge_leader_m, constraint.merge_leader_mps) =
                                    (gap, speed);
                            }
                            continue;
                        }
                    }
                    let far = mine.1 + 0.5 * MARGIN_S < theirs.0;
                    if far || theirs.1 + 0.5 * MARGIN_S <= mine.0 {
                        continue;
                    }
                    let wide = is_wide(view, own, holder.agent);
                    let Some(enter_m) = conflict.last_stop(wide, -start) else { continue };
                    let before_m = if wide { 1.2 } else { 0.5 };
                    let stop_m = (start + enter_m - before_m).max(0.0);
                    if stop_m < constraint.stop_m {
                        constraint.stop_m = stop_m;
                        self.yields_to[row] = holder.agent;
                    }
                }
            }
        }
        self.constraints[row] = constraint;
    }
}

/// Whether this vehicle stands though nothing keeps it, or nobody here knows what keeps it.
fn is_idle(vehicles: &VehicleTable, view: &View, agent: u32) -> bool {
    let row = view.agents.row[agent as usize];
    let stands = view.agents.velocity[agent as usize].length_squared() < 0.25;
    stands
        && (row == NONE
            || vehicles.reservation[row as usize] == 0
            || vehicles.reservation_idle_s[row as usize] > 1.5)
}

/// Seconds between two; what is long and heavy is hard to predict.
fn margin_s(view: &View, a: u32, b: u32) -> f32 {
    if is_wide(view, a, b) { 2.0 * MARGIN_S } else { MARGIN_S }
}

pub(super) fn is_wide(view: &View, a: u32, b: u32) -> bool {
    view.agents.body[a as usize].is_wide() || view.agents.body[b as usize].is_wide()
}
