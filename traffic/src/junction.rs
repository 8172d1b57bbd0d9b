//! Who may pass a junction, and when.
//!
//! Nobody enters a stretch of a junction that others' paths cross without *leave*. Leaves are
//! numbered in the order in which they are given, and whoever holds a later one yields to an
//! earlier one wherever both would be at the same place at the same time. That order has no cycle,
//! so of all who wait the first can always go: a junction cannot lock itself. Leave is given to
//! the first in line who would not be at any conflict together with someone who has leave, whose
//! way out has room, whom no light stops, and who cuts off nobody of higher rank.

mod ask;
mod pass;
mod presence;
mod reserve;
mod rotate;
mod state;
mod unlock;

use self::reserve::expire;
pub(crate) use self::state::{Junctions, View};
use crate::{
    constraint::{Halt, Wait},
    rows::Rows,
    tracks::NONE,
};

impl Junctions {
    /// Gives and takes leaves, and says where everybody must stop.
    pub(crate) fn arbitrate(&mut self, rows: &mut Rows, orders: &mut u64, view: &View) {
        let count = rows.id.len();
        self.halts.clear();
        self.halts.resize(count, Halt::FREE);
        self.waits.clear();
        self.waits.resize(count, Wait::No);
        self.blockers.clear();
        self.blockers.resize(count, NONE);
        self.yields.clear();
        self.yields.resize(count, NONE);
        self.measure(rows, view);
        self.requests.clear();
        for row in 0..count {
            if rows.placed[row] == 1 {
                expire(rows, row, view);
                self.withdraw(rows, row, view);
                if let Some(request) = self.request(rows, row, view) {
                    self.requests.push(request);
                }
            }
        }
        self.list_presences(rows, view);
        self.sort_requests(rows, view);
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let (wait, body) = self.judge(rows, &request, view);
            (self.waits[request.row], self.blockers[request.row]) = (wait, body);
            if wait == Wait::No {
                self.grant(rows, orders, &request, view);
            } else {
                self.refuse(rows, &request, view);
            }
        }
        self.rotate(rows, orders, view);
        for row in 0..count {
            if rows.order[row] != 0 {
                self.give_way(rows, row, view);
            }
        }
        self.unlock(rows, orders, view);
        self.overtake(rows, orders, view);
    }
}
