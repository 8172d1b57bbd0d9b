//! Where each vehicle is on its route, and where it goes next.

use crate::{
    agents::Crowd,
    grid::Grid,
    guide::Guides,
    occupancy::Occupancy,
    random::{Purpose, draw},
    rows::{Route, Rows},
    tracks::{NONE, Tracks},
};

/// Routes reach at least so far ahead, as far as lanes go.
const AHEAD_M: f32 = 320.0;
/// A vehicle farther from its track than this has lost it and looks for the best one anew.
const LOST_M: f32 = 4.5;

/// How far beyond a fork one looks for who is there already.
const CROWD_REACH_M: f32 = 80.0;

/// How many vehicles each lane holds.
pub(crate) struct Load(Vec<u32>);

impl Load {
    /// Counts the vehicles of this room.
    pub(crate) fn count(rows: &Rows, tracks: &Tracks) -> Load {
        let mut load = Load(vec![0; tracks.count()]);
        for row in (0..rows.id.len()).filter(|&row| rows.placed[row] == 1) {
            load.0[rows.route[row].lane() as usize] += 1;
        }
        load
    }

    /// Vehicles per metre on `way` and the lanes that follow it.
    fn density(&self, tracks: &Tracks, way: u32) -> f32 {
        let (mut at, mut length_m, mut vehicles) = (way, 0.0, 0);
        loop {
            length_m += tracks.length(at);
            vehicles += self.0[at as usize];
            let fork = !tracks.in_junction(at) && length_m > CROWD_REACH_M;
            match tracks.next(at) {
                [next, ..] if !fork && length_m < 4.0 * CROWD_REACH_M => at = *next,
                _ => return vehicles as f32 / length_m.max(1.0),
            }
            if at == way {
                return vehicles as f32 / length_m.max(1.0);
            }
        }
    }
}

/// Finds every row's place on its route and lengthens the route.
pub(crate) fn follow(
    rows: &mut Rows,
    guides: &mut Guides,
    tracks: &Tracks,
    grid: &Grid,
    crowd: &Crowd,
    seed: u64,
) {
    let load = Load::count(rows, tracks);
    for body in 0..crowd.count() {
        let row = crowd.row[body];
        if row == NONE {
            continue;
        }
        let row = row as usize;
        if rows.placed[row] == 1 && crowd.flags[body] & protocol::flag::TELEPORTED != 0 {
            rows.reset(row);
        }
        if rows.placed[row] == 1 && !advance(rows, row, tracks, crowd, body) {
            lose(rows, row);
        }
        if rows.placed[row] == 0 {
            find(rows, row, tracks, grid, crowd, body);
        }
        if rows.placed[row] == 1 {
            guides.lead(rows, row, tracks, grid);
            lengthen(rows, row, guides, tracks, &load, seed);
        }
    }
}

/// Moves a row along its route; `false` if the vehicle is no longer on it.
fn advance(rows: &mut Rows, row: usize, tracks: &Tracks, crowd: &Crowd, body: usize) -> bool {
    let position = crowd.position[body].truncate();
    let before = (rows.route[row].passed, rows.arc_m[row]);
    let mut seat = tracks.project(rows.route[row].lane(), position, rows.arc_m[row] + 0.5);
    let mut driven = seat.arc_m - before.1;
    while seat.arc_m > tracks.length(rows.route[row].lane()) && rows.route[row].lanes().len() > 1 {
        let length = tracks.length(rows.route[row].lane());
        rows.route[row].pop();
        let next = rows.route[row].lane();
        let on = tracks.project(next, position, (seat.arc_m - length).max(0.0));
        driven += (length + on.arc_m) - seat.arc_m;
        seat = on;
    }
    rows.arc_m[row] = seat.arc_m;
    if rows.shift_m[row] != 0.0 {
        rows.shift_done_m[row] += driven.max(0.0);
        if rows.shift_done_m[row] >= rows.shift_over_m[row] {
            rows.shift_m[row] = 0.0;
            rows.shift_done_m[row] = 0.0;
            rows.shift_over_m[row] = 0.0;
        }
    }
    let astray = seat.left_m - shift_at(rows, row, 0.0).0;
    let aligned = seat.tangent.dot(crowd.forward[body]);
    if rows.turning[row] == 1 {
        rows.turning[row] = u32::from(aligned < 0.7);
        return seat.left_m.abs() < 4.0 * LOST_M;
    }
    let backwards = aligned < -0.2;
    let jumped = driven.abs() > 8.0;
    astray.abs() < LOST_M && !backwards && !jumped && seat.arc_m > -6.0
}

/// Forgets the place on the route, and what hangs on it.
fn lose(rows: &mut Rows, row: usize) {
    rows.placed[row] = 0;
    (rows.shift_m[row], rows.shift_done_m[row], rows.shift_over_m[row]) = (0.0, 0.0, 0.0);
    (rows.order[row], rows.pass_end[row], rows.idle_s[row]) = (0, 0, 0.0);
    rows.wait_s[row] = 0.0;
    rows.turning[row] = 0;
}

/// How long before a dead end one stops in order to turn round there.
pub(crate) const TURN_ROOM_M: f32 = 9.0;

/// Who turns round wants nobody so near in front, and nobody else who turns.
const CROWDED_M: f32 = 16.0;

/// Lets whoever stands at a dead end turn round and drive back, when nobody is coming.
pub(crate) fn turn_round(
    rows: &mut Rows,
    row: usize,
    tracks: &Tracks,
    crowd: &Crowd,
    occupancy: &Occupancy,
) {
    let [lane] = *rows.route[row].lanes() else { return };
    let back = tracks.back[lane as usize];
    let own = crowd.driven[row];
    let body = own as usize;
    let left_m = tracks.length(lane) - rows.arc_m[row] - crowd.body[body].front_m;
    if back == NONE || crowd.speed(body).abs() > 0.5 || left_m > TURN_ROOM_M + 3.0 {
        return;
    }
    let position = crowd.position[body].truncate();
    let seat = tracks.project(back, position, (tracks.length(back) - rows.arc_m[row]).max(0.0));
    let coming = occupancy.on(back).iter().any(|o| {
        let reach = crowd.body[body].length_m() + 6.0 + 4.0 * o.speed_mps.max(0.0);
        o.body != own && (o.front_m - seat.arc_m).abs() < reach
    });
    let crowded = (0..rows.id.len()).any(|other| {
        let place = crowd.position[crowd.driven[other] as usize].truncate();
        let ahead = (place - position).dot(crowd.forward[body]) > 0.0;
        let near = place.distance_squared(position) < CROWDED_M * CROWDED_M;
        other != row && near && (ahead || rows.turning[other] == 1)
    });
    if coming || crowded {
        return;
    }
    rows.route[row] = Route::from_lane(back, rows.route[row].passed.wrapping_add(1));
    rows.arc_m[row] = seat.arc_m.clamp(0.0, tracks.length(back));
    rows.turning[row] = 1;
}

/// Puts a row onto the track that fits the vehicle's place and heading best.
fn find(rows: &mut Rows, row: usize, tracks: &Tracks, grid: &Grid, crowd: &Crowd, body: usize) {
    let position = crowd.position[body];
    let flat = position.truncate();
    let mut best: Option<(f32, u32, f32)> = None;
    let mut consider = |lane: u32, hint_m: f32| {
        let seat = tracks.project(lane, flat, hint_m);
        let (centre, ..) = tracks.at(lane, seat.arc_m);
        let beyond = (seat.arc_m - seat.arc_m.clamp(0.0, tracks.length(lane))).abs();
        let cost = seat.left_m.abs()
            + beyond
            + 4.0 * (1.0 - seat.tangent.dot(crowd.forward[body]))
            + 3.0 * ((centre.z - position.z).abs() - 1.0).max(0.0)
            + if tracks.endless[lane as usize] { 0.0 } else { 1.5 };
        if best.is_none_or(|(least, ..)| cost < least) {
            best = Some((cost, lane, seat.arc_m));
        }
    };
    for &(lane, hint_m) in grid.near(flat) {
        consider(lane, hint_m);
    }
    if best.is_none() {
        // Far from every road, which is rare: look at all of them.
        if let Some((lane, hint_m)) = tracks.nearest(flat) {
            let seat = tracks.project(lane, flat, hint_m);
            best = Some((0.0, lane, seat.arc_m));
        }
    }
    if let Some((_, lane, arc_m)) = best {
        rows.route[row] = Route::from_lane(lane, rows.route[row].passed.wrapping_add(1));
        rows.arc_m[row] = arc_m.clamp(0.0, tracks.length(lane));
        rows.placed[row] = 1;
    }
}

/// Takes the turns that a client asked for, else draws some, until the route reaches far enough.
pub(crate) fn lengthen(
    rows: &mut Rows,
    row: usize,
    guides: &Guides,
    tracks: &Tracks,
    load: &Load,
    seed: u64,
) {
    let mut reach = -rows.arc_m[row];
    for &lane in rows.route[row].lanes() {
        reach += tracks.length(lane);
    }
    while reach < AHEAD_M && !rows.route[row].is_full() {
        let (id, count) = (rows.id[row], rows.route[row].lanes().len());
        let last = *rows.route[row].lanes().last().expect("a route has a lane");
        let asked = guides.next(id, count, last).filter(|way| tracks.next(last).contains(way));
        let Some(next) = asked.or_else(|| turn(tracks, last, load, (seed, id, rows.turns[row])))
        else {
            return;
        };
        if tracks.next(last).len() > 1 {
            rows.turns[row] = rows.turns[row].wrapping_add(1);
        }
        rows.route[row].push(next);
        reach += tracks.length(next);
    }
}

/// Draws where to go after `lane`, away from dead ends if there is a choice. Of two draws, the
/// less crowded way is taken: that alone keeps random routes from piling up.
fn turn(tracks: &Tracks, lane: u32, load: &Load, draws: (u64, u32, u32)) -> Option<u32> {
    let (seed, id, count) = draws;
    let ways = tracks.next(lane);
    let open = ways.iter().filter(|&&way| tracks.endless[way as usize]).count();
    let fits = |way: &&u32| open == 0 || tracks.endless[**way as usize];
    let choices = if open == 0 { ways.len() } else { open };
    if choices == 0 {
        return None;
    }
    let pick = |purpose| {
        let nth = draw(seed, id, purpose, u64::from(count)) % choices as u64;
        ways.iter().filter(fits).nth(nth as usize).copied()
    };
    let (first, second) = (pick(Purpose::Turn)?, pick(Purpose::Detour)?);
    let is_better = load.density(tracks, second) < load.density(tracks, first);
    Some(if is_better { second } else { first })
}

/// How far left of the route's tracks the vehicle should be after `ahead_m` more metres, and the
/// slope of that offset: a fifth-order blend from where a lane change began.
pub(crate) fn shift_at(rows: &Rows, row: usize, ahead_m: f32) -> (f32, f32) {
    let (shift, over) = (rows.shift_m[row], rows.shift_over_m[row]);
    if shift == 0.0 {
        return (0.0, 0.0);
    }
    let u = ((rows.shift_done_m[row] + ahead_m) / over).clamp(0.0, 1.0);
    let blend = u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
    let slope = 30.0 * u * u * (1.0 - u) * (1.0 - u) / over;
    (shift * (1.0 - blend), -shift * slope)
}

/// The point on the route `ahead_m` after the vehicle's place: its lane and arc length.
pub(crate) fn ahead(rows: &Rows, row: usize, tracks: &Tracks, ahead_m: f32) -> (u32, f32) {
    let lanes = rows.route[row].lanes();
    let mut arc_m = rows.arc_m[row] + ahead_m;
    for &lane in &lanes[..lanes.len() - 1] {
        let length = tracks.length(lane);
        if arc_m <= length {
            return (lane, arc_m);
        }
        arc_m -= length;
    }
    (lanes[lanes.len() - 1], arc_m)
}
