//! Who may pass a junction, and when.
//!
//! Nobody enters a stretch of a junction that others' paths cross without *leave*. Leaves are
//! numbered in the order in which they are given, and whoever holds a later one yields to an
//! earlier one wherever both would be at the same place at the same time. That order has no cycle,
//! so of all who wait the first can always go: a junction cannot lock itself. Leave is given to
//! the first in line who would not be at any conflict together with someone who has leave, whose
//! way out has room, whom no light stops, and who cuts off nobody of higher rank.

mod deadlock;
mod exit_cycles;
mod gap_acceptance;
mod presence;
mod requests;
mod reservation;
mod state;

use self::reservation::expire;
pub(crate) use self::state::{Junctions, View};
use crate::{
    constraint::{JunctionConstraint, WaitReason},
    tracks::NONE,
    vehicle_table::VehicleTable,
};

impl Junctions {
    /// Gives and takes leaves, and says where everybody must stop.
    pub(crate) fn arbitrate(
        &mut self,
        vehicles: &mut VehicleTable,
        reservations: &mut u64,
        view: &View,
    ) {
        let count = vehicles.id.len();
        self.constraints.clear();
        self.constraints.resize(count, JunctionConstraint::FREE);
        self.waits.clear();
        self.waits.resize(count, WaitReason::None);
        self.blockers.clear();
        self.blockers.resize(count, NONE);
        self.yields_to.clear();
        self.yields_to.resize(count, NONE);
        self.measure(vehicles, view);
        self.requests.clear();
        for row in 0..count {
            if vehicles.located[row] == 1 {
                expire(vehicles, row, view);
                self.withdraw(vehicles, row, view);
                if let Some(request) = self.request(vehicles, row, view) {
                    self.requests.push(request);
                }
            }
        }
        self.list_presences(vehicles, view);
        self.sort_requests(vehicles, view);
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
        for row in 0..count {
            if vehicles.reservation[row] != 0 {
                self.give_way(vehicles, row, view);
            }
        }
        self.break_deadlocks(vehicles, reservations, view);
        self.break_yield_cycles(vehicles, reservations, view);
    }
}
