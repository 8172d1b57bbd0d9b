//! Whether someone may pass now, and to whom he gives way once he may.

use super::presence::present;
use super::{BRAKE_MPS2, Junctions, Request, STANDING_GAP_M, View, pass_end, way};
use crate::approach::Sign;
use crate::rows::Rows;
use crate::tracks::NONE;

/// Seconds between two who use the same place one after the other.
const MARGIN_S: f32 = 0.8;
/// Seconds between two who merge into one lane.
const MERGE_S: f32 = 1.3;
/// Seconds that must remain before someone of higher rank comes.
const CUT_OFF_S: f32 = 1.2;

impl Junctions {
    pub(super) fn may_pass(&self, rows: &Rows, request: &Request, view: &View) -> bool {
        let row = request.row;
        let body = view.crowd.driven[row] as usize;
        // Who is in already is in.
        if request.entry_m <= 0.0 {
            return true;
        }
        let speed = view.crowd.speed(body).max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 1.2 * speed + 6.0;
        let lane = rows.route[row].lanes()[request.from];
        let full_stop = view.map.approaches.sign[lane as usize] != Sign::Stop
            || view.map.approaches.signal[lane as usize] != NONE
            || rows.wait_s[row] > 0.8;
        !request.red
            && full_stop
            && request.line_m < horizon
            && self.is_first(rows, request, view)
            && self.has_room(rows, request, view)
            && self.is_clear(rows, request, view)
    }

    /// Whether everybody between here and the line has leave himself.
    pub(super) fn is_first(&self, rows: &Rows, request: &Request, view: &View) -> bool {
        let own = view.crowd.driven[request.row];
        for k in 0..request.from {
            let start = self.start(request.row, k);
            for occupant in view.occupancy.on(rows.route[request.row].lanes()[k]) {
                let (front, rear) = (start + occupant.front_m, start + occupant.rear_m);
                if occupant.body == own || front < 0.0 || rear > request.entry_m {
                    continue;
                }
                let row = view.crowd.row[occupant.body as usize];
                // A tail in front of the line belongs to someone who is in already.
                let leaving = front > request.entry_m + 1.0 && occupant.speed_mps > 1.0;
                let holds = row != NONE && rows.order[row as usize] != 0;
                if !holds && !leaving {
                    return false;
                }
            }
        }
        true
    }

    /// Whether there is room to stand beyond the junction.
    pub(super) fn has_room(&self, rows: &Rows, request: &Request, view: &View) -> bool {
        let (tracks, row) = (&view.map.tracks, request.row);
        let lanes = rows.route[row].lanes();
        if request.to >= lanes.len() {
            return true;
        }
        let own = view.crowd.driven[row];
        let exit = lanes[request.to];
        let mut need = view.crowd.body[own as usize].length_m() + STANDING_GAP_M;
        for holder in 0..rows.id.len() {
            if holder == row || rows.order[holder] == 0 || rows.placed[holder] == 0 {
                continue;
            }
            let end = pass_end(rows, holder);
            let route = rows.route[holder].lanes();
            if end > 0 && end < route.len() && route[end] == exit {
                let body = view.crowd.body[view.crowd.driven[holder] as usize];
                need += body.length_m() + STANDING_GAP_M;
            }
        }
        let begin = self.start(row, request.to);
        let mut room = f32::INFINITY;
        for (k, &lane) in lanes.iter().enumerate().skip(request.to) {
            let start = self.start(row, k);
            if start - begin > need + 1.0 || (k > request.to && tracks.in_junction(lane)) {
                break;
            }
            for occupant in view.occupancy.on(lane) {
                let inside = view.crowd.row[occupant.body as usize];
                let counted = inside != NONE
                    && rows.order[inside as usize] != 0
                    && start + occupant.front_m < begin + 1.0;
                if occupant.body == own || counted || start + occupant.front_m < begin {
                    continue;
                }
                // Who moves on makes room until we are there.
                let gains = 2.0 * (occupant.speed_mps - 1.0).max(0.0);
                room = room.min(start + occupant.rear_m - begin + gains);
            }
        }
        room >= need
    }

    /// Whether nobody with leave, nobody of higher rank and nothing in the way is met.
    pub(super) fn is_clear(&self, rows: &Rows, request: &Request, view: &View) -> bool {
        let row = request.row;
        let own = view.crowd.driven[row];
        let lanes = rows.route[row].lanes();
        for (k, &lane) in way(lanes, request) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                let mine = self.window(view, own, start, conflict.mine, lane);
                for holder in present(&self.holders, conflict.other) {
                    if holder.body == own {
                        continue;
                    }
                    let stuck = is_idle(rows, view, holder.body);
                    let theirs = self.window(
                        view,
                        holder.body,
                        holder.start_m,
                        conflict.theirs,
                        holder.lane,
                    );
                    if theirs.1 <= 0.0 {
                        continue;
                    }
                    let behind = conflict.merge && !stuck && theirs.0 + MERGE_S < mine.0;
                    let after = !stuck && theirs.1 + MARGIN_S < mine.0;
                    let before = mine.1 + MARGIN_S < theirs.0;
                    if !(after || before || behind) {
                        return false;
                    }
                }
                for other in present(&self.coming, conflict.other) {
                    if other.body == own || other.rank >= request.rank {
                        continue;
                    }
                    let theirs =
                        self.window(view, other.body, other.start_m, conflict.theirs, other.lane);
                    if mine.1 + CUT_OFF_S > theirs.0 && theirs.0 < 8.0 {
                        return false;
                    }
                }
                let blocked = view.occupancy.on(lane).iter().any(|o| {
                    o.body != own
                        && o.aligned < 0.6
                        && o.speed_mps.abs() < 2.0
                        && o.front_m > conflict.mine.0
                        && o.rear_m < conflict.mine.1
                        && is_idle(rows, view, o.body)
                });
                if blocked {
                    return false;
                }
            }
        }
        true
    }

    /// Makes the holder of a later leave yield to those with earlier ones.
    pub(super) fn give_way(&mut self, rows: &Rows, row: usize, view: &View) {
        let own = view.crowd.driven[row];
        let lanes = rows.route[row].lanes();
        let mut halt = self.halts[row];
        for (k, &lane) in lanes.iter().enumerate().take(pass_end(rows, row)) {
            let start = self.start(row, k);
            for conflict in view.map.conflicts.of(lane) {
                let enter_m = start + conflict.mine.0;
                if enter_m <= 0.0 {
                    continue;
                }
                let mine = self.window(view, own, start, conflict.mine, lane);
                for holder in present(&self.holders, conflict.other) {
                    let other = view.crowd.row[holder.body as usize];
                    if holder.body == own
                        || (other != NONE && rows.order[other as usize] > rows.order[row])
                        || (rows.idle_s[row] > 4.0 && is_idle(rows, view, holder.body))
                    {
                        continue;
                    }
                    let theirs = self.window(
                        view,
                        holder.body,
                        holder.start_m,
                        conflict.theirs,
                        holder.lane,
                    );
                    if theirs.1 <= 0.0 || mine.1 + 0.5 * MARGIN_S < theirs.0 {
                        continue;
                    }
                    if conflict.merge {
                        // Where he is on his way to the merge, seen as a distance on ours.
                        let length = view.crowd.body[holder.body as usize].length_m();
                        let front = enter_m - (holder.start_m + conflict.theirs.0);
                        let gap = front - length;
                        let speed = view.crowd.velocity[holder.body as usize].length();
                        if gap >= 0.0 {
                            if gap < halt.behind_m {
                                (halt.behind_m, halt.behind_mps) = (gap, speed);
                            }
                        } else {
                            halt.stop_m = halt.stop_m.min((enter_m - 0.5).max(0.0));
                        }
                    } else if theirs.1 + 0.5 * MARGIN_S > mine.0 {
                        halt.stop_m = halt.stop_m.min((enter_m - 0.5).max(0.0));
                    }
                }
            }
        }
        self.halts[row] = halt;
    }
}

/// Whether this vehicle stands though nothing keeps it, or nobody here knows what keeps it.
fn is_idle(rows: &Rows, view: &View, body: u32) -> bool {
    let row = view.crowd.row[body as usize];
    let stands = view.crowd.velocity[body as usize].length_squared() < 0.25;
    stands && (row == NONE || rows.order[row as usize] == 0 || rows.idle_s[row as usize] > 1.5)
}
