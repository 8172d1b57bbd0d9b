//! Deadlocks: cycles of vehicles that wait for each other at a junction.
//!
//! The order of reservations has no cycle, but queues add dependencies: a holder may stand behind a
//! vehicle that waits, for want of a reservation or by a later one, for a third that yields to the
//! first. No vehicle of such a cycle would ever go, nor would those that wait for one of them. One
//! of the cycle, first in its lane, then goes before all of these: one without a reservation if
//! none of them is in its way yet, or a holder whose way is free.

use super::gap_acceptance::{Blocked, are_wide};
use super::state::{Junctions, Request, View, reserved_lanes};
use super::wait_graph::{BEHIND_M, WaitGraph};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    leader, obstacles,
    tracks::NONE,
    vehicle_table::VehicleTable,
};

/// Waiting time after which a cycle is searched.
const PATIENCE_S: f32 = 4.0;

/// Waiting time after which a vehicle enters a junction in which others of the cycle stand.
const MOVE_UP_AFTER_S: f32 = 20.0;
/// Free distance, beyond its own length, that it requires.
const MOVE_UP_M: f32 = 10.0;

/// Returns whether a vehicle searches for a cycle in this frame: after its patience, then every
/// second.
fn is_time(waited_s: f32, view: &View) -> bool {
    waited_s >= PATIENCE_S && waited_s.floor() > (waited_s - view.delta_s).floor()
}

impl Junctions {
    /// Lets one vehicle of each cycle go first.
    pub(super) fn break_deadlocks(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        let mut graph = None;
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let row = request.row;
            // A vehicle that has just dropped its way through the junction requests nothing.
            let requests_way = || vehicles[row].route.lanes().len() >= request.to;
            if self.waits[row] != WaitReason::Conflict
                || !requests_way()
                || !is_time(vehicles[row].wait_s, view)
            {
                continue;
            }
            let waits = graph.get_or_insert_with(|| WaitGraph::new(vehicles.len()));
            let examine = |row: usize| self.waits_of(vehicles, row, view);
            let Some(cycle) = waits.cycle(row, &examine) else { continue };
            let blocked = waits.blocked_by(&cycle, &examine, view.spread);
            if self.exit_room(vehicles, &request, view).is_ok()
                && self.can_enter(vehicles, &request, &blocked, view)
            {
                self.grant_first(vehicles, reservations, &blocked, &request, view);
                graph = None;
            }
        }
        for row in 0..vehicles.len() {
            let waits = self.yields_to[row] != NONE || self.merges_behind[row] != NONE;
            if !waits
                || vehicles[row].located == 0
                || !is_time(vehicles[row].reservation_idle_s, view)
            {
                continue;
            }
            let waits = graph.get_or_insert_with(|| WaitGraph::new(vehicles.len()));
            let examine = |row: usize| self.waits_of(vehicles, row, view);
            let Some(cycle) = waits.cycle(row, &examine) else { continue };
            let blocked = waits.blocked_by(&cycle, &examine, view.spread);
            if self.can_go(vehicles, row, &blocked, view)
                && self.move_forward(vehicles, reservations, row, &cycle)
            {
                graph = None;
            }
        }
    }

    /// Returns whether a vehicle could enter if it did not yield to the `blocked` rows: none of them
    /// is in its way yet, or, after a longer wait, there is room to move up.
    fn can_enter(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        blocked: &[usize],
        view: &View,
    ) -> bool {
        let row = request.row;
        let is_clear =
            |those: Blocked| self.is_clear_except(blocked, those, vehicles, request, view).is_ok();
        is_clear(Blocked::Outside)
            || (vehicles[row].wait_s > MOVE_UP_AFTER_S
                && is_clear(Blocked::All)
                && self.can_move_up(vehicles, row, f32::INFINITY, view))
    }

    /// Returns whether a row could drive this far, or out of the way of the vehicles behind it, if
    /// all others stood still.
    fn can_move_up(&self, vehicles: &VehicleTable, row: usize, way_m: f32, view: &View) -> bool {
        let length_m = view.agents.body[view.agents.driven[row] as usize].length_m();
        let way_m = way_m.min(length_m + MOVE_UP_M);
        obstacles::is_way_free(vehicles, row, &view.map.tracks, view.agents, way_m)
    }

    /// Returns whether a holder could go if it did not yield to the `blocked` rows.
    fn can_go(&self, vehicles: &VehicleTable, row: usize, blocked: &[usize], view: &View) -> bool {
        let (tracks, agents) = (&view.map.tracks, view.agents);
        let leader = leader::leader(&vehicles[row], row, tracks, agents, view.occupancy, BEHIND_M);
        if leader.gap_m < BEHIND_M {
            return false;
        }
        match self.contested_m(vehicles, row, blocked, view) {
            None => true,
            Some(way_m) => self.can_move_up(vehicles, row, way_m, view),
        }
    }

    /// Returns the distance after which a row has left all conflict areas of its reservation in
    /// which one of the `blocked` rows is; `None` if they are in none.
    fn contested_m(
        &self,
        vehicles: &VehicleTable,
        row: usize,
        blocked: &[usize],
        view: &View,
    ) -> Option<f32> {
        let own = view.agents.driven[row];
        let own_m = view.agents.body[own as usize].length_m();
        let lanes = vehicles[row].route.lanes();
        let mut contested: Option<f32> = None;
        for (k, &lane) in lanes.iter().enumerate().take(reserved_lanes(&vehicles[row])) {
            for conflict in view.map.conflicts.of(lane) {
                for holder in self.holders.of(conflict.other) {
                    let other = view.agents.row[holder.agent as usize];
                    if holder.agent == own || other == NONE || !blocked.contains(&(other as usize))
                    {
                        continue;
                    }
                    let wide = are_wide(view, own, holder.agent);
                    let Some(area) = conflict.between(wide) else { continue };
                    let body = view.agents.body[holder.agent as usize];
                    let has_passed = -holder.start_m > area.other.1 + body.length_m();
                    let is_there = holder.start_m + area.other.0 <= 0.0 && !has_passed;
                    let leaves_m = self.start(row, k) + area.own.1;
                    if is_there && leaves_m > 0.0 {
                        contested = Some(contested.unwrap_or(0.0).max(leaves_m + own_m));
                    }
                }
            }
        }
        contested
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
        let others = [blocked, &self.rows_behind(vehicles, request, view)].concat();
        if !self.move_forward(vehicles, reservations, request.row, &others) {
            return;
        }
        vehicles[request.row].reservation_idle_s = 0.0;
        self.grant(vehicles, reservations, request, view);
        self.constraints[request.row] = JunctionConstraint::FREE;
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use protocol::{ActorId, ActorState, Pose, flag, kind, light};
    use road::LaneTypes;

    use super::*;
    use crate::{
        agents::Agents,
        map::Map,
        occupancy::Occupancy,
        spread::Spread,
        tests::maps,
        vehicle_table::{Route, Vehicle},
    };

    /// Calls `examine` with a vehicle that waits at a light which shows `phase`, row 0, and one that has
    /// stood in the crossing behind it for 10 s, row 1.
    fn before_crossing(phase: u32, examine: impl Fn(&Junctions, &VehicleTable, &View)) {
        let network = maps::two_crossings(26.0);
        let map = Map::new(&network, Box::new(Default::default));
        let quarter = std::f32::consts::FRAC_PI_2;
        let actor = |id: u32, x: f32, y: f32, yaw: f32, flags: u32| ActorState {
            actor_id: ActorId(id),
            kind: kind::VEHICLE,
            blueprint: u32::MAX,
            flags,
            pose: Pose::level(Vec3::new(x, y, 0.0), yaw),
            ..ActorState::default()
        };
        let actors = [
            actor(1, 12.8, -1.75, 0.0, flag::AUTOPILOT),
            actor(2, 27.75, -1.0, quarter, flag::AUTOPILOT),
            actor(3, 27.75, 5.0, quarter, 0),
        ];
        let (mut agents, mut occupancy) = (Agents::default(), Occupancy::default());
        agents.read(&actors, &map.bodies);
        occupancy.rebuild(&map.tracks, &map.grid, &agents, &[], Spread::Alone);
        let lane = |x: f64, y: f64| {
            network.nearest(DVec3::new(x, y, 0.0), LaneTypes::DRIVABLE).expect("a road").lane.0
        };
        let mut vehicles = VehicleTable::default();
        vehicles.retain(&[1, 2]);
        let mut place = |row: usize, arc_m: f32, lanes: &[u32]| {
            let vehicle: &mut Vehicle = &mut vehicles[row];
            (vehicle.located, vehicle.arc_m) = (1, arc_m);
            vehicle.route = Route::from_lane(lanes[0], 0);
            lanes[1..].iter().for_each(|&lane| vehicle.route.push(lane));
        };
        place(0, 2.8, &[lane(13.0, -1.75), lane(26.0, -1.75), lane(40.0, -1.75)]);
        place(1, 9.0, &[lane(27.75, 0.0), lane(27.75, 20.0)]);
        vehicles[1].reservation_idle_s = 10.0;
        (vehicles[1].reservation, vehicles[1].reservation_end) = (1, 1);
        let view = View {
            map: &map,
            agents: &agents,
            occupancy: &occupancy,
            obstacles: &[],
            lights: &[phase; 2],
            seed: 0,
            delta_s: 0.05,
            spread: Spread::Alone,
            ignore_lights: &[0.0; 2],
            ignore_signs: &[0.0; 2],
        };
        let mut junctions = Junctions::default();
        junctions.arbitrate(&mut vehicles, &mut 1, &view);
        examine(&junctions, &vehicles, &view);
    }

    #[test]
    fn a_vehicle_at_a_light_waits_for_one_that_stands_beyond_it() {
        for (phase, reason) in
            [(light::RED, WaitReason::Signal), (light::GREEN, WaitReason::Conflict)]
        {
            before_crossing(phase, |junctions, vehicles, view| {
                assert_eq!(junctions.waits[0], reason);
                assert_eq!(junctions.waits_of(vehicles, 0, view), [1, NONE, NONE]);
            });
        }
    }

    #[test]
    fn one_of_a_cycle_may_move_up_to_another_that_stands_in_the_crossing() {
        before_crossing(light::GREEN, |junctions, vehicles, view| {
            let request = junctions.request(&vehicles[0], 0, view).expect("a request");
            let is_clear = |those: Blocked| {
                junctions.is_clear_except(&[1], those, vehicles, &request, view).is_ok()
            };
            assert!(is_clear(Blocked::All) && !is_clear(Blocked::Outside));
        });
    }
}
