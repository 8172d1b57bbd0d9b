//! Reservations: granted, denied, withdrawn and expired.

use protocol::light;

use super::presence_list::Presence;
use super::state::{
    BRAKE_MPS2, Junctions, LINE_GAP_M, PASSED_M, Request, View, request_lanes, reserved_lanes,
};
use crate::{
    tracks::NONE,
    vehicle_table::{Vehicle, VehicleTable},
};

/// Waiting time before a blocked exit after which another turn is drawn.
const DETOUR_S: f32 = 8.0;

impl Junctions {
    /// Withdraws the unused part of a reservation that cannot be used now: all of it, or what lies
    /// beyond the junction that the vehicle is in. Otherwise a vehicle in a queue would block
    /// vehicles that it cannot reach.
    pub(super) fn withdraw(&self, vehicle: &mut Vehicle, row: usize, view: &View) {
        if vehicle.reservation == 0 {
            return;
        }
        let (tracks, lanes) = (&view.map.tracks, vehicle.route.lanes());
        let end = reserved_lanes(vehicle).min(lanes.len());
        let enters = |k: &usize| {
            let is_entry = tracks.in_zone(lanes[*k]) && (*k == 0 || !tracks.in_zone(lanes[*k - 1]));
            is_entry && self.start(row, *k) > -PASSED_M
        };
        let can_stop = |k: &usize| self.can_stop(vehicle, row, *k, view);
        let stops = |k: usize| {
            matches!(self.light(vehicle, row, k, view), light::RED | light::YELLOW)
                && !self.has_passed_line(vehicle, row, k, view)
        };
        let mut entries = (0..end).filter(enters).filter(can_stop);
        let withdrawn = if vehicle.reservation_idle_s > 4.0 {
            entries.find(|&k| self.start(row, k) > 0.0 || stops(k))
        } else {
            let closed = entries.find(|&k| stops(k));
            // There is no room to stand between the junctions of one way.
            let covers = |k: &usize, closed: usize| self.way_end(vehicle, row, *k, view) > closed;
            closed.and_then(|closed| {
                let mut before = (0..=closed).filter(enters).filter(can_stop);
                before.find(|k| *k == closed || covers(k, closed))
            })
        };
        let Some(from) = withdrawn else { return };
        if (0..from).any(|k| tracks.in_zone(lanes[k])) {
            vehicle.reservation_end = vehicle.route.lanes_passed.wrapping_add(from as u32);
        } else {
            vehicle.reservation = 0;
            vehicle.reservation_end = 0;
            vehicle.reservation_idle_s = 0.0;
        }
    }

    /// Grants a reservation for a request, or extends the one that the vehicle has.
    pub(super) fn grant(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        request: &Request,
        view: &View,
    ) {
        let row = request.row;
        if vehicles[row].reservation == 0 {
            let behind = self.rows_behind(vehicles, request, view);
            if !self.move_forward(vehicles, reservations, row, &behind) {
                *reservations += 1;
                self.reserve(vehicles, row, *reservations);
            }
        }
        vehicles[row].reservation_end =
            vehicles[row].route.lanes_passed.wrapping_add(request.to as u32);
        vehicles[row].reservation_idle_s = 0.0;
        let lanes = vehicles[row].route.lanes();
        if let Some(&exit) = lanes.get(request.to) {
            self.leaving_to.add_row(exit, row as u32);
        }
        for (k, &lane) in request_lanes(lanes, request) {
            if view.map.tracks.in_zone(lane) {
                let presence = Presence {
                    lane,
                    agent: view.agents.driven[row],
                    start_m: self.start(row, k),
                    rank: 0,
                    top_mps: self.top_mps(&vehicles[row], row, k, view),
                };
                self.holders.add(presence);
            }
        }
    }

    /// Returns the holders behind the vehicle of a request on the same lane. A reservation before
    /// theirs keeps reservations in the order of the queue; otherwise their order would have cycles.
    pub(super) fn rows_behind(
        &self,
        vehicles: &VehicleTable,
        request: &Request,
        view: &View,
    ) -> Vec<usize> {
        let lane = vehicles[request.row].route.lanes()[request.from];
        let is_behind = |other: &usize| {
            if *other == request.row
                || vehicles[*other].reservation == 0
                || vehicles[*other].located == 0
            {
                return false;
            }
            let lanes = vehicles[*other].route.lanes();
            let end = reserved_lanes(&vehicles[*other]).min(lanes.len());
            (0..end)
                .find(|&k| lanes[k] == lane)
                .is_some_and(|k| self.start(*other, k) > request.entry_m)
        };
        let holders = self.holders.of(lane).iter();
        let rows = holders.map(|holder| view.agents.row[holder.agent as usize]);
        let mut behind: Vec<usize> =
            rows.filter(|&row| row != NONE).map(|row| row as usize).filter(is_behind).collect();
        behind.dedup();
        behind
    }

    /// Stops a vehicle without a reservation at its line and counts its waiting time.
    pub(super) fn deny(&mut self, vehicles: &mut VehicleTable, request: &Request, view: &View) {
        let row = request.row;
        let speed = request.speed_mps;
        // Beyond the line but not in the junction: stop here.
        let stop_m = (request.line_m - LINE_GAP_M).max(0.0);
        let brake_from = speed * speed / (2.0 * BRAKE_MPS2 * 0.9) + 1.0 * speed.max(0.0) + 4.0;
        if stop_m < brake_from {
            self.constraints[row].stop_m = self.constraints[row].stop_m.min(stop_m);
        }
        if speed < 0.5 && stop_m < 4.0 {
            let before = vehicles[row].wait_s;
            vehicles[row].wait_s += view.delta_s;
            let again = (before / DETOUR_S) as u32 != (vehicles[row].wait_s / DETOUR_S) as u32;
            if again
                && !request.red
                && request.from > 0
                && self.exit_room(vehicles, request, view).is_err()
            {
                vehicles[row].route.truncate(request.from);
                vehicles[row].turn_draws = vehicles[row].turn_draws.wrapping_add(1);
            }
        }
    }

    /// Gives a row a reservation before those of `others`; returns `false` if it has the earliest
    /// already or none of them has one.
    pub(super) fn move_forward(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        row: usize,
        others: &[usize],
    ) -> bool {
        let reserved = others
            .iter()
            .map(|&other| vehicles[other].reservation)
            .filter(|&reservation| reservation != 0);
        let Some(earliest) = reserved.min().filter(|&first| first != vehicles[row].reservation)
        else {
            return false;
        };
        for &(holder, _) in &self.holding {
            let reservation = &mut vehicles[holder].reservation;
            *reservation += u64::from(*reservation >= earliest);
        }
        *reservations += 1;
        self.reserve(vehicles, row, earliest);
        true
    }

    /// Gives a row the reservation of this number.
    fn reserve(&mut self, vehicles: &mut VehicleTable, row: usize, number: u64) {
        if vehicles[row].reservation == 0 {
            self.holding.push((row, NONE));
        }
        vehicles[row].reservation = number;
    }
}

/// Ends a reservation when all its lanes lie behind, and measures for how long it is unused.
pub(super) fn expire(vehicle: &mut Vehicle, row: usize, view: &View) {
    if vehicle.reservation == 0 {
        return;
    }
    if vehicle.reservation_end.wrapping_sub(vehicle.route.lanes_passed) as i32 <= 0 {
        vehicle.reservation = 0;
        vehicle.reservation_end = 0;
    }
    let is_standing =
        view.agents.velocity[view.agents.driven[row] as usize].length_squared() < 0.25;
    if !is_standing {
        // Not when it is granted: the light may turn red before the vehicle has started.
        vehicle.wait_s = 0.0;
    }
    let is_used = vehicle.reservation == 0 || !is_standing;
    vehicle.reservation_idle_s =
        if is_used { 0.0 } else { vehicle.reservation_idle_s + view.delta_s };
}
