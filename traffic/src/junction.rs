//! Who may pass a junction, and when.
//!
//! Nobody enters a stretch of a junction that others' paths cross without *leave*. Leaves are
//! numbered in the order in which they are given, and whoever holds a later one yields to an
//! earlier one wherever both would be at the same place at the same time. That order has no cycle,
//! so of all who wait the first can always go: a junction cannot lock itself. Leave is given to
//! the first in line who would not be at any conflict together with someone who has leave, whose
//! way out has room, whom no light stops, and who cuts off nobody of higher rank.

use bus::light;

use crate::approach::Sign;
use crate::map::Map;
use crate::perceive::{Crowd, Occupancy, ordered};
use crate::random::{Purpose, unit};
use crate::rows::Rows;
use crate::signals::LEFT_TURN_RAD;
use crate::tracks::NONE;

/// Seconds between two who use the same place one after the other.
const MARGIN_S: f32 = 0.8;
/// Seconds between two who merge into one lane.
const MERGE_S: f32 = 1.3;
/// Seconds that must remain before someone of higher rank comes.
const CUT_OFF_S: f32 = 1.2;
/// After so long at the line, rank does not matter any more.
const PATIENCE_S: f32 = 15.0;
/// After so long before a full way out, another way is drawn.
const DETOUR_S: f32 = 25.0;
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

/// Someone's presence on a lane of a junction, now or soon.
#[derive(Clone, Copy)]
struct Presence {
    lane: u32,
    /// Index into the crowd.
    body: u32,
    /// From its front bumper to the lane's start.
    start_m: f32,
    rank: i32,
}

/// Scratch of the stage; results by row.
#[derive(Default)]
pub(crate) struct Junctions {
    pub(crate) halts: Vec<Halt>,
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
    /// By signal: what it shows.
    pub(crate) lights: &'a [u32],
    pub(crate) seed: u64,
    pub(crate) delta_s: f32,
    /// By row: share of red lights to ignore.
    pub(crate) ignore_lights: &'a [f32],
}

impl Junctions {
    /// Gives and takes leaves, and says where everybody must stop.
    pub(crate) fn arbitrate(&mut self, rows: &mut Rows, orders: &mut u64, view: &View) {
        let count = rows.id.len();
        self.halts.clear();
        self.halts.resize(count, FREE);
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
            if self.may_pass(rows, &request, view) {
                self.grant(rows, orders, &request, view);
            } else {
                self.refuse(rows, &request, view);
            }
        }
        for row in 0..count {
            if rows.order[row] != 0 {
                self.give_way(rows, row, view);
            }
        }
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
    fn start(&self, row: usize, k: usize) -> f32 {
        self.starts[self.starts_from[row] + k]
    }

    /// Takes back a leave that has not been used yet and cannot be used now.
    fn withdraw(&self, rows: &mut Rows, row: usize, view: &View) {
        if rows.order[row] == 0 {
            return;
        }
        let lanes = rows.route[row].lanes();
        let end = pass_end(rows, row);
        let Some(from) = (0..end.min(lanes.len())).find(|&k| view.map.tracks.in_junction(lanes[k]))
        else {
            return;
        };
        let entry_m = self.start(row, from);
        if entry_m <= 0.0 {
            return;
        }
        let body = view.crowd.driven[row] as usize;
        let speed = view.crowd.speed(body);
        let line_m = entry_m - view.map.approaches.line_m[lanes[from] as usize];
        let stoppable =
            speed * speed < 2.0 * YELLOW_BRAKE_MPS2 * (line_m - LINE_GAP_M).max(0.0) || speed < 0.5;
        let light = self.light(rows, row, from, view);
        let stopped = light == light::RED || light == light::YELLOW;
        if stoppable && (stopped || rows.idle_s[row] > 4.0) {
            rows.order[row] = 0;
            rows.pass_end[row] = 0;
            rows.idle_s[row] = 0.0;
        }
    }

    /// What the light of route lane `k` shows to this vehicle; dark without one.
    fn light(&self, rows: &Rows, row: usize, k: usize, view: &View) -> u32 {
        let lane = rows.route[row].lanes()[k] as usize;
        let signal = view.map.approaches.signal[lane];
        if signal == NONE {
            return light::OFF;
        }
        let share = view.ignore_lights[row];
        let nth = u64::from(rows.route[row].passed.wrapping_add(k as u32));
        if share > 0.0 && unit(view.seed, rows.id[row], Purpose::Light, nth) < share {
            return light::GREEN;
        }
        view.lights[signal as usize]
    }

    /// The next way through a junction that needs a leave, if it is near enough to matter.
    fn request(&self, rows: &Rows, row: usize, view: &View) -> Option<Request> {
        let map = view.map;
        let lanes = rows.route[row].lanes();
        let body = view.crowd.driven[row] as usize;
        let speed = view.crowd.speed(body).max(0.0);
        let horizon = speed * speed / (2.0 * BRAKE_MPS2) + 2.0 * speed + 15.0;
        let mut k = pass_end(rows, row);
        while k < lanes.len() {
            if self.start(row, k) > horizon.max(8.0 * speed) {
                return None;
            }
            if !map.tracks.in_junction(lanes[k]) {
                k += 1;
                continue;
            }
            let to = self.way_end(rows, row, k, view);
            let way = &lanes[k..to];
            let contested = way.iter().any(|&lane| !map.conflicts.of(lane).is_empty())
                || map.approaches.signal[lanes[k] as usize] != NONE
                || map.approaches.sign[lanes[k] as usize] == Sign::Stop;
            if !contested {
                k = to;
                continue;
            }
            let entry_m = self.start(row, k);
            let line_m = entry_m - map.approaches.line_m[lanes[k] as usize];
            let light = self.light(rows, row, k, view);
            let free_m = (line_m - LINE_GAP_M).max(0.0);
            let late = speed * speed > 2.0 * YELLOW_BRAKE_MPS2 * free_m;
            let red = light == light::RED || (light == light::YELLOW && !late);
            let rank = self.rank(rows, row, k, to, light, view);
            return Some(Request { row, from: k, to, line_m, entry_m, rank, rights: 0, red });
        }
        None
    }

    /// One past the last lane of the way through the junction that begins at `from`; goes on
    /// through the next junction if there is no room to stand between the two.
    fn way_end(&self, rows: &Rows, row: usize, from: usize, view: &View) -> usize {
        let tracks = &view.map.tracks;
        let lanes = rows.route[row].lanes();
        let body = view.crowd.body[view.crowd.driven[row] as usize];
        let mut to = from;
        loop {
            while to < lanes.len() && tracks.in_junction(lanes[to]) {
                to += 1;
            }
            let mut room = 0.0;
            let mut next = to;
            while next < lanes.len() && !tracks.in_junction(lanes[next]) {
                room += tracks.length(lanes[next]);
                next += 1;
            }
            if next < lanes.len() && room < body.length_m() + STANDING_GAP_M {
                to = next;
            } else {
                return to;
            }
        }
    }

    /// Who goes first; lower does.
    fn rank(
        &self,
        rows: &Rows,
        row: usize,
        from: usize,
        to: usize,
        light: u32,
        view: &View,
    ) -> i32 {
        let map = view.map;
        if rows.wait_s[row] > PATIENCE_S {
            return -1;
        }
        let lanes = rows.route[row].lanes();
        let first = lanes[from] as usize;
        let mut last = from;
        while last + 1 < to
            && map.tracks.junction[lanes[last + 1] as usize] == map.tracks.junction[first]
        {
            last += 1;
        }
        let way_in = map.tracks.at(lanes[from], 0.0).1;
        let way_out = map.tracks.at(lanes[last], map.tracks.length(lanes[last])).1;
        let left = i32::from(way_in.angle_to(way_out) > LEFT_TURN_RAD);
        match light {
            light::OFF => {
                let sign = map.approaches.sign[first] != Sign::None;
                let low = sign || map.approaches.beside_lights[first];
                left + 2 * i32::from(map.approaches.minor[first]) + 4 * i32::from(low)
            }
            _ => left,
        }
    }

    fn list_presences(&mut self, rows: &Rows, view: &View) {
        let tracks = &view.map.tracks;
        self.holders.clear();
        self.coming.clear();
        for row in 0..rows.id.len() {
            if rows.placed[row] == 0 || rows.order[row] == 0 {
                continue;
            }
            let lanes = rows.route[row].lanes();
            for (k, &lane) in lanes.iter().enumerate().take(pass_end(rows, row)) {
                if tracks.in_junction(lane) {
                    self.holders.push(Presence {
                        lane,
                        body: view.crowd.driven[row],
                        start_m: self.start(row, k),
                        rank: 0,
                    });
                }
            }
        }
        for request in self.requests.iter().filter(|request| !request.red) {
            let lanes = rows.route[request.row].lanes();
            for (k, &lane) in way(lanes, request) {
                if tracks.in_junction(lane) {
                    self.coming.push(Presence {
                        lane,
                        body: view.crowd.driven[request.row],
                        start_m: self.start(request.row, k),
                        rank: request.rank,
                    });
                }
            }
        }
        self.list_strangers(view);
        self.holders.sort_unstable_by_key(|p| (p.lane, p.body));
        self.coming.sort_unstable_by_key(|p| (p.lane, p.body));
    }

    /// Vehicles that others drive count as if they had leave for every way that they may take.
    fn list_strangers(&mut self, view: &View) {
        let (tracks, crowd) = (&view.map.tracks, view.crowd);
        for body in (0..crowd.count()).filter(|&body| crowd.row[body] == NONE) {
            if crowd.velocity[body].length_squared() < 0.25 {
                continue;
            }
            for &(lane, _) in view.map.grid.near(crowd.position[body].truncate()) {
                let Some(occupant) = view.occupancy.on(lane).iter().find(|o| o.body == body as u32)
                else {
                    continue;
                };
                if occupant.aligned < 0.8 || occupant.speed_mps < 0.5 {
                    continue;
                }
                if tracks.in_junction(lane) {
                    let start_m = -occupant.front_m;
                    self.holders.push(Presence { lane, body: body as u32, start_m, rank: 0 });
                }
                let left_m = tracks.length(lane) - occupant.front_m;
                if left_m < 3.0 * occupant.speed_mps {
                    for &next in tracks.next(lane).iter().filter(|&&l| tracks.in_junction(l)) {
                        self.holders.push(Presence {
                            lane: next,
                            body: body as u32,
                            start_m: left_m,
                            rank: 0,
                        });
                    }
                }
            }
        }
    }

    fn sort_requests(&mut self, rows: &Rows, view: &View) {
        let tracks = &view.map.tracks;
        let bucket = |rows: &Rows, request: &Request| {
            // Who waits longer goes first; who comes sooner goes first.
            let speed = view.crowd.speed(view.crowd.driven[request.row] as usize).max(0.5);
            let soon = (request.line_m.max(0.0) / speed).min(100.0) as u32;
            (u32::MAX - rows.wait_s[request.row] as u32, soon)
        };
        for a in 0..self.requests.len() {
            let mine = self.requests[a];
            let lane = rows.route[mine.row].lanes()[mine.from];
            let heading = tracks.at(lane, 0.0).1;
            let rights = self.requests.iter().filter(|other| {
                let from = rows.route[other.row].lanes()[other.from];
                other.rank == mine.rank
                    && tracks.junction[from as usize] == tracks.junction[lane as usize]
                    && bucket(rows, other) == bucket(rows, &mine)
                    && heading.perp_dot(tracks.at(from, 0.0).1) > 0.5
            });
            self.requests[a].rights = rights.count() as u32;
        }
        self.requests
            .sort_by_key(|r| (r.rank, bucket(rows, r), r.rights, ordered(r.line_m), r.row));
    }

    fn may_pass(&self, rows: &Rows, request: &Request, view: &View) -> bool {
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
    fn is_first(&self, rows: &Rows, request: &Request, view: &View) -> bool {
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
    fn has_room(&self, rows: &Rows, request: &Request, view: &View) -> bool {
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
    fn is_clear(&self, rows: &Rows, request: &Request, view: &View) -> bool {
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

    /// From when to when a vehicle may be on a stretch of a lane, in seconds from now: as early and
    /// as late as it may come.
    fn window(
        &self,
        view: &View,
        body: u32,
        start_m: f32,
        on: (f32, f32),
        lane: u32,
    ) -> (f32, f32) {
        let body = body as usize;
        let tracks = &view.map.tracks;
        let speed = view.crowd.velocity[body].length();
        let limit = tracks.limit_mps[lane as usize];
        let pace = tracks.pace_at(lane, on.0).min(limit).max(2.0);
        let enter = start_m + on.0;
        let leave = start_m + on.1 + view.crowd.body[body].length_m();
        (travel_s(enter, speed, limit * 1.1, 2.2), travel_s(leave, speed, 0.85 * pace, 1.2))
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
                .is_some_and(|k| self.start(other, k) > request.entry_m.max(0.0));
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
            if again && !request.red && request.from > 0 && !self.has_room(rows, request, view) {
                rows.route[row].truncate(request.from);
                rows.turns[row] = rows.turns[row].wrapping_add(1);
            }
        }
    }

    /// Makes the holder of a later leave yield to those with earlier ones.
    fn give_way(&mut self, rows: &Rows, row: usize, view: &View) {
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

/// Whether this vehicle stands though nothing keeps it, or nobody here knows what keeps it.
fn is_idle(rows: &Rows, view: &View, body: u32) -> bool {
    let row = view.crowd.row[body as usize];
    let stands = view.crowd.velocity[body as usize].length_squared() < 0.25;
    stands && (row == NONE || rows.order[row as usize] == 0 || rows.idle_s[row as usize] > 1.5)
}

/// The entries of one lane in a list sorted by lane.
fn present(list: &[Presence], lane: u32) -> &[Presence] {
    let begin = list.partition_point(|p| p.lane < lane);
    let end = begin + list[begin..].partition_point(|p| p.lane == lane);
    &list[begin..end]
}

/// Seconds to drive `distance_m` from `speed`, gaining `gain` m/s² up to `top`. Not positive if the
/// place lies behind.
fn travel_s(distance_m: f32, speed: f32, top: f32, gain: f32) -> f32 {
    if distance_m <= 0.0 {
        return 0.0;
    }
    if speed >= top {
        return distance_m / speed.max(0.1);
    }
    let ramp_m = (top * top - speed * speed) / (2.0 * gain);
    if distance_m <= ramp_m {
        ((speed * speed + 2.0 * gain * distance_m).sqrt() - speed) / gain
    } else {
        (top - speed) / gain + (distance_m - ramp_m) / top
    }
}
