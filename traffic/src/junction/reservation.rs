//! Reservations: granted, denied, withdrawn and expired.

use protocol::light;

use super::presence_list::Presence;
use super::state::{
    BRAKE_MPS2, Junctions, LINE_GAP_M, Request, View, YELLOW_BRAKE_MPS2, request_lanes,
    reserved_lanes,
};
use crate::{tracks::NONE, vehicle_table::VehicleTable};

/// Waiting time before a blocked exit after which another turn is drawn.
const DETOUR_S: f32 = 8.0;

impl Junctions {
    /// Withdraws the unused part of a reservation that cannot be used now: all of it, or what lies
    /// beyond the junction that the vehicle is in. Otherwise a vehicle in a queue would block
    /// vehicles that it cannot reach.
    pub(super) fn withdraw(&self, vehicles: &mut VehicleTable, row: usize, view: &View) {
        if vehicles.reservation[row] == 0 {
            return;
        }
        let (tracks, lanes) = (&view.map.tracks, vehicles.route[row].lanes());
        let end = reserved_lanes(vehicles, row).min(lanes.len());
        let speed = view.agents.speed(view.agents.driven[row] as usize);
        let enters =
            |k: usize| tracks.in_zone(lanes[k]) && (k == 0 || !tracks.in_zone(lanes[k - 1]));
        let withdrawn = (0..end).filter(|&k| enters(k) && self.start(row, k) > 0.0).find(|&from| {
            let line_m = self.start(row, from) - view.map.approaches.line_m[lanes[from] as usize];
            let brake_limit = 2.0 * YELLOW_BRAKE_MPS2 * (line_m - LINE_GAP_M).max(0.0);
            let stoppable = speed * speed < brake_limit || speed < 0.5;
            // Between two junctions without room between them the vehicle would obstruct others.
            let outside = !(0..from).any(|k| tracks.in_zone(lanes[k]));
            let light = self.light(vehicles, row, from, view);
            let stopped = outside && (light == light::RED || light == light::YELLOW);
            stoppable && (stopped || vehicles.reservation_idle_s[row] > 4.0)
        });
        let Some(from) = withdrawn else { return };
        if (0..from).any(|k| tracks.in_zone(lanes[k])) {
            vehicles.reservation_end[row] =
                vehicles.route[row].lanes_passed.wrapping_add(from as u32);
        } else {
            vehicles.reservation[row] = 0;
            vehicles.reservation_end[row] = 0;
            vehicles.reservation_idle_s[row] = 0.0;
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
        if vehicles.reservation[row] == 0
            && !move_forward(
                vehicles,
                reservations,
                row,
                &self.rows_behind(vehicles, request, view),
            )
        {
            *reservations += 1;
            vehicles.reservation[row] = *reservations;
        }
        vehicles.reservation_end[row] =
            vehicles.route[row].lanes_passed.wrapping_add(request.to as u32);
        vehicles.wait_s[row] = 0.0;
        vehicles.reservation_idle_s[row] = 0.0;
        let lanes = vehicles.route[row].lanes();
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
                    top_mps: self.top_mps(vehicles, row, k, view),
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
        let lane = vehicles.route[request.row].lanes()[request.from];
        let is_behind = |other: &usize| {
            if *other == request.row
                || vehicles.reservation[*other] == 0
                || vehicles.located[*other] == 0
            {
                return false;
            }
            let lanes = vehicles.route[*other].lanes();
            let end = reserved_lanes(vehicles, *other).min(lanes.len());
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
        let agent = view.agents.driven[row] as usize;
        let speed = view.agents.speed(agent);
        // Beyond the line but not in the junction: stop here.
        let stop_m = (request.line_m - LINE_GAP_M).max(0.0);
        let brake_from = speed * speed / (2.0 * BRAKE_MPS2 * 0.9) + 1.0 * speed.max(0.0) + 4.0;
        if stop_m < brake_from {
            self.constraints[row].stop_m = self.constraints[row].stop_m.min(stop_m);
        }
        if speed < 0.5 && stop_m < 4.0 {
            let before = vehicles.wait_s[row];
            vehicles.wait_s[row] += view.delta_s;
            let again = (before / DETOUR_S) as u32 != (vehicles.wait_s[row] / DETOUR_S) as u32;
            if again
                && !request.red
                && request.from > 0
                && self.exit_room(vehicles, request, view).is_err()
            {
                vehicles.route[row].truncate(request.from);
                vehicles.turn_draws[row] = vehicles.turn_draws[row].wrapping_add(1);
            }
        }
    }
}

/// Gives a row a reservation before those of `others`; returns `false` if it has the earliest
/// already or none of them has one.
pub(super) fn move_forward(
    vehicles: &mut VehicleTable,
    reservations: &mut u64,
    row: usize,
    others: &[usize],
) -> bool {
    let reserved = others
        .iter()
        .map(|&other| vehicles.reservation[other])
        .filter(|&reservation| reservation != 0);
    let Some(earliest) = reserved.min().filter(|&first| first != vehicles.reservation[row]) else {
        return false;
    };
    for reservation in vehicles.reservation.iter_mut().filter(|number| **number >= earliest) {
        *reservation += 1;
    }
    *reservations += 1;
    vehicles.reservation[row] = earliest;
    true
}

/// Ends a reservation when all its lanes lie behind, and measures for how long it is unused.
pub(super) fn expire(vehicles: &mut VehicleTable, row: usize, view: &View) {
    if vehicles.reservation[row] == 0 {
        return;
    }
    if vehicles.reservation_end[row].wrapping_sub(vehicles.route[row].lanes_passed) as i32 <= 0 {
        vehicles.reservation[row] = 0;
        vehicles.reservation_end[row] = 0;
    }
    let is_standing =
        view.agents.velocity[view.agents.driven[row] as usize].length_squared() < 0.25;
    let is_used = vehicles.reservation[row] == 0 || !is_standing;
    vehicles.reservation_idle_s[row] =
        if is_used { 0.0 } else { vehicles.reservation_idle_s[row] + view.delta_s };
}
