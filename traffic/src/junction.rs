//! Right of way at junctions: reservations, granted by rules and gap acceptance.
//!
//! No vehicle enters a conflict area of a junction without a *reservation* (after Dresner and
//! Stone's reservation-based intersections). Reservations are numbered in the order in which they
//! are granted, and the holder of a later one yields to an earlier one wherever both would be in
//! the same conflict area at the same time. That order has no cycle, so that the first of all
//! waiting vehicles can always go: the junction cannot deadlock by it. A reservation is granted to
//! the first vehicle in its lane whose time windows in all conflict areas are free of other
//! holders, whose exit has room, which no light stops, and which cuts off no vehicle of higher
//! rank.

mod deadlock;
mod exit_cycles;
mod exit_room;
mod gap_acceptance;
mod presence;
mod presence_list;
mod requests;
mod reservation;
mod state;
mod wait_graph;

pub(crate) use self::{
    requests::STARTING_MPS,
    state::{Junctions, PASSED_M, View, reserved_lanes},
};
use self::{reservation::expire, state::Found};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    tracks::NONE,
    vehicle_table::VehicleTable,
};

impl Junctions {
    /// Withdraws and grants reservations, and sets the constraints of all vehicles.
    pub(crate) fn arbitrate(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        let count = vehicles.len();
        self.constraints.clear();
        self.constraints.resize(count, JunctionConstraint::FREE);
        self.waits.clear();
        self.waits.resize(count, WaitReason::None);
        self.blockers.clear();
        self.blockers.resize(count, NONE);
        self.yields_to.clear();
        self.yields_to.resize(count, NONE);
        self.merges_behind.clear();
        self.merges_behind.resize(count, NONE);
        self.measure(vehicles, view);
        let mut found = std::mem::take(&mut self.found);
        view.spread.update_list(vehicles, &mut found, |row, vehicle, found| {
            if vehicle.located == 0 {
                return;
            }
            expire(vehicle, row, view);
            self.withdraw(vehicle, row, view);
            if vehicle.reservation != 0 {
                let exit = vehicle.route.lanes().get(reserved_lanes(vehicle));
                found.push(Found::Holder(row, exit.copied().unwrap_or(NONE)));
            }
            found.extend(self.request(vehicle, row, view).map(Found::Request));
        });
        self.requests.clear();
        self.holding.clear();
        for &of_row in &found {
            match of_row {
                Found::Holder(row, exit) => self.holding.push((row, exit)),
                Found::Request(request) => self.requests.push(request),
            }
        }
        self.found = found;
        self.list_presences(vehicles, view);
        self.sort_requests(vehicles, view);
        self.list_starving(vehicles, view);
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let (wait, agent) = self.assess(vehicles, &request, view);
            (self.waits[request.row], self.blockers[request.row]) = (wait, agent);
            if wait == WaitReason::None {
                self.grant(vehicles, reservations, &request, view);
            } else {
                self.deny(vehicles, &request, view);
            }
        }
        self.grant_exit_cycles(vehicles, reservations, view);
        self.give_way(vehicles, view);
        self.break_deadlocks(vehicles, reservations, view);
    }
}
