//! Reservations: given, withdrawn, refused and expired.

use protocol::light;

use super::state::{
    BRAKE_MPS2, Junctions, LINE_GAP_M, Presence, Request, View, YELLOW_BRAKE_MPS2, pass_end, way,
};
use crate::rows::Rows;

/// After so long before a full way out, another way is drawn.
const DETOUR_S: f32 = 8.0;

impl Junctions {
    /// Takes back what has not been used yet of a leave and cannot be used now: all of it, or what
    /// lies beyond the junction that the vehicle is in. Otherwise who stands in a queue would keep
    /// from going whom he cannot reach.
    pub(super) fn withdraw(&self, rows: &mut Rows, row: usize, view: &View) {
        if rows.order[row] == 0 {
            return;
        }
        let (tracks, lanes) = (&view.map.tracks, rows.route[row].lanes());
        let end = pass_end(rows, row).min(lanes.len());
        let speed = view.crowd.speed(view.crowd.driven[row] as usize);
        let enters = |k: usize| {
            tracks.in_junction(lanes[k]) && (k == 0 || !tracks.in_junction(lanes[k - 1]))
        };
        let taken = (0..end).filter(|&k| enters(k) && self.start(row, k) > 0.0).find(|&from| {
            let line_m = self.start(row, from) - view.map.approaches.line_m[lanes[from] as usize];
            let brakes = 2.0 * YELLOW_BRAKE_MPS2 * (line_m - LINE_GAP_M).max(0.0);
            let stoppable = speed * speed < brakes || speed < 0.5;
            // Between two junctions with no room in between one would stand in others' way.
            let outside = !(0..from).any(|k| tracks.in_junction(lanes[k]));
            let light = self.light(rows, row, from, view);
            let stopped = outside && (light == light::RED || light == light::YELLOW);
            stoppable && (stopped || rows.idle_s[row] > 4.0)
        });
        let Some(from) = taken else { return };
        if (0..from).any(|k| tracks.in_junction(lanes[k])) {
            rows.pass_end[row] = rows.route[row].passed.wrapping_add(from as u32);
        } else {
            rows.order[row] = 0;
            rows.pass_end[row] = 0;
            rows.idle_s[row] = 0.0;
        }
    }

    pub(super) fn grant(
        &mut self,
        rows: &mut Rows,
        orders: &mut u64,
        request: &Request,
        view: &View,
    ) {
        let row = request.row;
        if rows.order[row] == 0 {
            *orders += 1;
            rows.order[row] = *orders;
            self.recall_behind(rows, request);
        }
        rows.pass_end[row] = rows.route[row].passed.wrapping_add(request.to as u32);
        rows.wait_s[row] = 0.0;
        rows.idle_s[row] = 0.0;
        let lanes = rows.route[row].lanes();
        for (k, &lane) in way(lanes, request) {
            if view.map.tracks.in_junction(lane) {
                let presence = Presence {
                    lane,
                    body: view.crowd.driven[row],
                    start_m: self.start(row, k),
                    rank: 0,
                    top_mps: self.top_mps(rows, row, k, view),
                };
                let key = (presence.lane, presence.body);
                let at = self.holders.partition_point(|p| (p.lane, p.body) < key);
                self.holders.insert(at, presence);
            }
        }
    }

    /// Takes back earlier leaves of those who come behind on the same lane: the order of leaves
    /// must be the order of the queue, or it would have cycles.
    pub(super) fn recall_behind(&self, rows: &mut Rows, request: &Request) {
        let lane = rows.route[request.row].lanes()[request.from];
        for other in 0..rows.id.len() {
            if other == request.row || rows.order[other] == 0 || rows.placed[other] == 0 {
                continue;
            }
            let lanes = rows.route[other].lanes();
            let end = pass_end(rows, other).min(lanes.len());
            let behind = (0..end)
                .find(|&k| lanes[k] == lane)
                .is_some_and(|k| self.start(other, k) > request.entry_m);
            if behind {
                rows.order[other] = 0;
                rows.pass_end[other] = 0;
            }
        }
    }

    pub(super) fn refuse(&mut self, rows: &mut Rows, request: &Request, view: &View) {
        let row = request.row;
        let body = view.crowd.driven[row] as usize;
        let speed = view.crowd.speed(body);
        // Beyond the line but not in: stand here.
        let stop_m = (request.line_m - LINE_GAP_M).max(0.0);
        let brake_from = speed * speed / (2.0 * BRAKE_MPS2 * 0.9) + 1.0 * speed.max(0.0) + 4.0;
        if stop_m < brake_from {
            self.halts[row].stop_m = self.halts[row].stop_m.min(stop_m);
        }
        if speed < 0.5 && stop_m < 4.0 {
            let before = rows.wait_s[row];
            rows.wait_s[row] += view.delta_s;
            let again = (before / DETOUR_S) as u32 != (rows.wait_s[row] / DETOUR_S) as u32;
            if again && !request.red && request.from > 0 && self.room(rows, request, view).is_err()
            {
                rows.route[row].truncate(request.from);
                rows.turns[row] = rows.turns[row].wrapping_add(1);
            }
        }
    }
}

/// Ends a leave when all its lanes lie behind, and notes for how long it goes unused.
pub(super) fn expire(rows: &mut Rows, row: usize, view: &View) {
    if rows.order[row] == 0 {
        return;
    }
    if rows.pass_end[row].wrapping_sub(rows.route[row].passed) as i32 <= 0 {
        rows.order[row] = 0;
        rows.pass_end[row] = 0;
    }
    let stands = view.crowd.velocity[view.crowd.driven[row] as usize].length_squared() < 0.25;
    let used = rows.order[row] == 0 || !stands;
    rows.idle_s[row] = if used { 0.0 } else { rows.idle_s[row] + view.delta_s };
}
