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
mod rotate;
mod unlock;

use protocol::light;

use self::presence::Presence;
use crate::map::Map;
use crate::outlook::Wait;
use crate::perceive::{Crowd, Occupancy};
use crate::rows::Rows;
use crate::sweep::Obstacle;
use crate::tracks::NONE;

/// After so long before a full way out, another way is drawn.
const DETOUR_S: f32 = 8.0;
/// Braking that a light turning yellow may ask for.
const YELLOW_BRAKE_MPS2: f32 = 3.0;
/// Braking on which plans are made.
const BRAKE_MPS2: f32 = 2.0;
/// Left free behind the one in front, beyond a junction.
const STANDING_GAP_M: f32 = 2.5;
/// Stand so far before a line.
const LINE_GAP_M: f32 = 0.5;

/// What a junction asks of a vehicle; distances from its front bumper.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Halt {
    /// Where it must stand, or infinity.
    pub(crate) stop_m: f32,
    /// Whom it must follow though he is on another lane yet: distance (infinity: nobody).
    pub(crate) behind_m: f32,
    /// And his speed.
    pub(crate) behind_mps: f32,
}

const FREE: Halt = Halt { stop_m: f32::INFINITY, behind_m: f32::INFINITY, behind_mps: 0.0 };

/// The next way through a junction for which a vehicle has no leave yet.
#[derive(Clone, Copy, Debug)]
struct Request {
    row: usize,
    /// Lanes of the route: first, and one past the last.
    from: usize,
    to: usize,
    /// From the front bumper to the line and to the first lane.
    line_m: f32,
    entry_m: f32,
    /// Lower goes first.
    rank: i32,
    /// 1 for who comes from the right of another of the same rank and time, and so on.
    rights: u32,
    red: bool,
}

/// Scratch of the stage; results by row.
#[derive(Default)]
pub(crate) struct Junctions {
    pub(crate) halts: Vec<Halt>,
    pub(crate) waits: Vec<Wait>,
    /// For whom it waits: an index into the crowd, or [`NONE`].
    pub(crate) blockers: Vec<u32>,
    /// To whom it gives way though it may pass, likewise.
    yields: Vec<u32>,
    requests: Vec<Request>,
    holders: Vec<Presence>,
    coming: Vec<Presence>,
    /// By row: from the front bumper to the start of each of the first route lanes.
    starts: Vec<f32>,
    starts_from: Vec<usize>,
}

/// What this stage reads.
pub(crate) struct View<'a> {
    pub(crate) map: &'a Map,
    pub(crate) crowd: &'a Crowd,
    pub(crate) occupancy: &'a Occupancy,
    /// Whom wide vehicles would touch beside their lanes.
    pub(crate) obstacles: &'a [Obstacle],
    /// By signal: what it shows.
    pub(crate) lights: &'a [u32],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
    /// By row: share of red lights to ignore.
    pub(crate) ignore_lights: &'a [f32],
    /// By row: share of signs to ignore.
    pub(crate) ignore_signs: &'a [f32],
}

impl Junctions {
    /// Gives and takes leaves, and says where everybody must stop.
    pub(crate) fn arbitrate(&mut self, rows: &mut Rows, orders: &mut u64, view: &View) {
        let count = rows.id.len();
        self.halts.clear();
        self.halts.resize(count, FREE);
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

    fn measure(&mut self, rows: &Rows, view: &View) {
        self.starts.clear();
        self.starts_from.clear();
        for row in 0..rows.id.len() {
            self.starts_from.push(self.starts.len());
            if rows.placed[row] == 0 {
                continue;
            }
            let body = view.crowd.driven[row] as usize;
            let mut start = -rows.arc_m[row] - view.crowd.body[body].front_m;
            for &lane in rows.route[row].lanes() {
                self.starts.push(start);
                start += view.map.tracks.length(lane);
            }
            self.starts.push(start);
        }
        self.starts_from.push(self.starts.len());
    }

    /// From the front bumper of `row` to the start of lane `k` of its route.
    pub(crate) fn start(&self, row: usize, k: usize) -> f32 {
        self.starts[self.starts_from[row] + k]
    }

    /// The same for every lane that its route had when junctions were looked at; none for who came
    /// onto the road since.
    pub(crate) fn starts(&self, row: usize) -> &[f32] {
        let (from, to) = (self.starts_from[row], self.starts_from[row + 1]);
        self.starts[from..to].split_last().map_or(&[], |(_, starts)| starts)
    }

    /// Takes back what has not been used yet of a leave and cannot be used now: all of it, or what
    /// lies beyond the junction that the vehicle is in. Otherwise who stands in a queue would keep
    /// from going whom he cannot reach.
    fn withdraw(&self, rows: &mut Rows, row: usize, view: &View) {
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

    fn grant(&mut self, rows: &mut Rows, orders: &mut u64, request: &Request, view: &View) {
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
    fn recall_behind(&self, rows: &mut Rows, request: &Request) {
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

    fn refuse(&mut self, rows: &mut Rows, request: &Request, view: &View) {
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

/// The lanes of a request, with their places in the route.
fn way<'a>(lanes: &'a [u32], request: &Request) -> impl Iterator<Item = (usize, &'a u32)> {
    lanes.iter().enumerate().take(request.to).skip(request.from)
}

/// How many lanes of the route the leave covers.
fn pass_end(rows: &Rows, row: usize) -> usize {
    if rows.order[row] == 0 {
        return 0;
    }
    rows.pass_end[row].wrapping_sub(rows.route[row].passed) as usize
}

/// Ends a leave when all its lanes lie behind, and notes for how long it goes unused.
fn expire(rows: &mut Rows, row: usize, view: &View) {
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
