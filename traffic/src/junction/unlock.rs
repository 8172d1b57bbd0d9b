//! Rings of vehicles that stand for each other at a junction.
//!
//! The order of leaves has no cycle, but the queue has a say too: who has leave may stand behind
//! one who has none, because that one waits for a third who gives way to the first. Nobody of such
//! a ring would ever go, nor would those who stand for one of them. The one without leave then
//! goes before all of these, if none of them is in the way yet.

use super::pass::is_wide;
use super::state::{Junctions, Request, View, pass_end, present};
use crate::{
    constraint::{Halt, Wait},
    leader,
    rows::Rows,
    tracks::NONE,
};

/// Waiting for so long for others makes one think of a ring.
const PATIENCE_S: f32 = 4.0;
/// Who is no farther behind another stands because of him.
const BEHIND_M: f32 = 5.0;
/// Longer rings are not looked for.
const RING_MAX: usize = 16;

/// Whether one who has waited for so long looks round: when patience ends, then every second.
fn is_time(waited_s: f32, view: &View) -> bool {
    waited_s >= PATIENCE_S && waited_s.floor() > (waited_s - view.delta_s).floor()
}

impl Junctions {
    /// Gives leave to the first vehicle of each ring that lacks it.
    pub(super) fn unlock(&mut self, rows: &mut Rows, orders: &mut u64, view: &View) {
        for index in 0..self.requests.len() {
            let request = self.requests[index];
            let row = request.row;
            // Who has just given up his way has none to ask for.
            let asks = rows.route[row].lanes().len() >= request.to;
            if !asks || self.waits[row] != Wait::Others || !is_time(rows.wait_s[row], view) {
                continue;
            }
            let Some(ring) = self.ring(rows, row, view) else { continue };
            let bound = self.bound(rows, &ring, view);
            if self.room(rows, &request, view).is_ok()
                && self.is_clear_but_for(&bound, rows, &request, view).is_ok()
            {
                self.go_first(rows, orders, &bound, &request, view);
            }
        }
    }

    /// Lets one go first who has leave but gives way to somebody who stands for him.
    pub(super) fn overtake(&mut self, rows: &mut Rows, orders: &mut u64, view: &View) {
        for row in 0..rows.id.len() {
            if rows.placed[row] == 0 || !is_time(rows.idle_s[row], view) || self.yields[row] == NONE
            {
                continue;
            }
            let Some(ring) = self.ring(rows, row, view) else { continue };
            let bound = self.bound(rows, &ring, view);
            let held = ring.iter().map(|&row| rows.order[row]).filter(|&order| order != 0);
            let earliest = held.min().unwrap_or(0);
            if earliest == rows.order[row] || self.is_blocked(rows, row, &bound, view) {
                continue;
            }
            for order in rows.order.iter_mut().filter(|order| **order >= earliest) {
                *order += 1;
            }
            *orders += 1;
            rows.order[row] = earliest;
        }
    }

    /// Whether one of `bound` is in the way that a row has leave for.
    fn is_blocked(&self, rows: &Rows, row: usize, bound: &[usize], view: &View) -> bool {
        let own = view.crowd.driven[row];
        let lanes = rows.route[row].lanes();
        lanes.iter().take(pass_end(rows, row)).enumerate().any(|(k, &lane)| {
            view.map.conflicts.of(lane).iter().any(|conflict| {
                present(&self.holders, conflict.other).iter().any(|holder| {
                    let other = view.crowd.row[holder.body as usize];
                    let is_bound = other != NONE && bound.contains(&(other as usize));
                    let wide = is_wide(view, own, holder.body);
                    conflict.between(wide).is_some_and(|meet| {
                        let body = view.crowd.body[holder.body as usize];
                        let passed = -holder.start_m > meet.theirs.1 + body.length_m();
                        let there = holder.start_m + meet.theirs.0 <= 0.0 && !passed;
                        let mine = -self.start(row, k) < meet.mine.1;
                        holder.body != own && is_bound && there && mine
                    })
                })
            })
        })
    }

    /// All who stand for each other, from `row` back to itself.
    fn ring(&self, rows: &Rows, row: usize, view: &View) -> Option<Vec<usize>> {
        let mut ring = vec![row];
        loop {
            let body = self.stands_for(rows, ring[ring.len() - 1], view);
            let next = *view.crowd.row.get(body as usize)?;
            if next == NONE || view.crowd.velocity[body as usize].length_squared() > 0.25 {
                return None;
            }
            let next = next as usize;
            if next == row {
                return Some(ring);
            }
            if ring.contains(&next) || ring.len() == RING_MAX || rows.placed[next] == 0 {
                return None;
            }
            ring.push(next);
        }
    }

    /// A ring, and all who stand for one of it.
    fn bound(&self, rows: &Rows, ring: &[usize], view: &View) -> Vec<usize> {
        let mut bound = ring.to_vec();
        for row in (0..rows.id.len()).filter(|&row| rows.placed[row] == 1) {
            let mut queue = vec![row];
            while let Some(&last) = queue.last().filter(|last| !bound.contains(last)) {
                let body = self.stands_for(rows, last, view);
                let next = view.crowd.row.get(body as usize).copied().unwrap_or(NONE);
                let stands = |row: usize| {
                    let body = view.crowd.driven[row] as usize;
                    view.crowd.velocity[body].length_squared() < 0.25
                };
                let goes_on = next != NONE && queue.len() < RING_MAX && stands(last);
                if !goes_on || queue.contains(&(next as usize)) {
                    queue.clear();
                } else {
                    queue.push(next as usize);
                }
            }
            queue.pop();
            bound.extend(queue);
        }
        bound
    }

    /// Because of whom a row stands: an index into the crowd, or [`NONE`].
    fn stands_for(&self, rows: &Rows, row: usize, view: &View) -> u32 {
        let yields = rows.order[row] != 0 && self.yields[row] != NONE;
        let asked = if yields { self.yields[row] } else { self.blockers[row] };
        let (tracks, crowd) = (&view.map.tracks, view.crowd);
        let mut leader = leader::leader(rows, row, tracks, crowd, view.occupancy, BEHIND_M);
        for obstacle in view.obstacles.iter().filter(|obstacle| obstacle.row == row) {
            leader = leader.nearer(obstacle.leader);
        }
        if leader.gap_m < BEHIND_M && (asked == NONE || leader.gap_m < self.halts[row].stop_m) {
            leader.body
        } else {
            asked
        }
    }

    /// Gives leave before the earliest leave of those who are bound.
    fn go_first(
        &mut self,
        rows: &mut Rows,
        orders: &mut u64,
        bound: &[usize],
        request: &Request,
        view: &View,
    ) {
        let held = bound.iter().map(|&row| rows.order[row]).filter(|&order| order != 0);
        let Some(earliest) = held.min() else { return };
        for order in rows.order.iter_mut().filter(|order| **order >= earliest) {
            *order += 1;
        }
        *orders += 1;
        rows.order[request.row] = earliest;
        rows.idle_s[request.row] = 0.0;
        self.recall_behind(rows, request);
        self.grant(rows, orders, request, view);
        self.halts[request.row] = Halt::FREE;
    }
}
