//! Where the tracks of a junction get in each other's way.
//!
//! Two tracks *conflict* where a vehicle on one leaves no room for a vehicle on the other, which
//! depends on how large they are. Tracks
//! that share their way in do not conflict: who drives behind sees who drives in front. Tracks
//! that share their way out *merge*: the second follows the first. All others *cross*: the second
//! waits until the first has left.

use glam::{Vec2, Vec3};

use crate::{
    swept_path::{self, BUS_M, CAR_M, Station},
    tracks::{NONE, Tracks},
};

/// Left free between two cars that pass each other, and if one is as large as a bus.
const CLEARANCE_M: [f32; 2] = [0.3, 0.15];
/// Who sweeps less than this to a side drives as straight as lanes are made for.
const SWING_M: f32 = 0.2;
/// No two bodies reach each other whose tracks are farther apart than this.
const REACH_M: f32 = 8.0;
/// Tracks farther apart in height pass over each other.
const STOREY_M: f32 = 3.0;
/// How far before a junction crossing paths can sweep over waiting vehicles.
const SWEEP_M: f32 = 14.0;
/// Half the width of who waits, and what is left free beside him.
const WAITING_M: f32 = 1.3;
/// Beside a straight track nobody waits farther away than this.
const BESIDE_M: f32 = 2.3;

/// Stretches of two tracks, by arc length, on each of which a vehicle is in the way of one on the
/// other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretches {
    /// From where to where on this track.
    pub(crate) mine: (f32, f32),
    /// From where to where on the other.
    pub(crate) theirs: (f32, f32),
}

/// A track that leaves too little room beside a stretch of it, seen from the other track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conflict {
    /// The other track.
    pub(crate) other: u32,
    /// Both leave by the same lane.
    pub(crate) merge: bool,
    /// Where two cars meet, if they do.
    cars: Option<Stretches>,
    /// Where two meet of whom one is as large as a bus.
    wide: Stretches,
    /// The part of that which lies in the junction on both tracks.
    core: Option<Stretches>,
}

impl Conflict {
    /// Where two meet, one of them `wide` or neither; `None` if they can pass each other.
    pub(crate) fn between(&self, wide: bool) -> Option<Stretches> {
        if wide { Some(self.wide) } else { self.cars }
    }

    /// How far along this track one may still stop before the other: to where the stretch begins,
    /// or, for who is beyond that already, to where the junction's own part of it begins.
    pub(crate) fn last_stop(&self, wide: bool, front_m: f32) -> Option<f32> {
        let stretches = [self.between(wide), if wide { self.core } else { None }];
        stretches.into_iter().flatten().map(|s| s.mine.0).find(|&enter_m| enter_m > front_m)
    }

    fn reversed(&self, other: u32) -> Conflict {
        let turn = |s: Stretches| Stretches { mine: s.theirs, theirs: s.mine };
        Conflict {
            other,
            merge: self.merge,
            cars: self.cars.map(turn),
            wide: turn(self.wide),
            core: self.core.map(turn),
        }
    }
}

/// All conflicts of all junctions, by lane.
pub(crate) struct Conflicts {
    first: Vec<u32>,
    list: Vec<Conflict>,
    /// By lane of a junction: how far before it one waits, so that no other path sweeps over.
    pub(crate) setback_m: Vec<f32>,
}

impl Conflicts {
    /// Compares the tracks of every junction pairwise.
    pub(crate) fn new(tracks: &Tracks) -> Conflicts {
        let lanes = tracks.count();
        let members = junction_members(tracks);
        let mut found: Vec<(u32, Conflict)> = Vec::new();
        let mut setback_m = vec![0.0; lanes];
        for lanes in &members {
            let ends: Vec<Ends> = lanes.iter().map(|&lane| Ends::of(tracks, lane)).collect();
            let paths: Vec<Path> = lanes.iter().map(|&lane| Path::of(tracks, lane)).collect();
            for a in 0..lanes.len() {
                for b in a + 1..lanes.len() {
                    if shares(&ends[a].entries, &ends[b].entries) || !paths[a].is_near(&paths[b]) {
                        continue;
                    }
                    let merge = shares(&ends[a].exits, &ends[b].exits);
                    let [cars, wide, core] = overlap(&paths[a], &paths[b], merge);
                    let Some(wide) = wide else { continue };
                    let conflict = Conflict { other: lanes[b], merge, cars, wide, core };
                    found.push((lanes[a], conflict));
                    found.push((lanes[b], conflict.reversed(lanes[a])));
                }
            }
            for (a, &lane) in lanes.iter().enumerate() {
                for &entry in tracks.previous(lane).iter().filter(|&&l| !tracks.in_junction(l)) {
                    for (b, other) in paths.iter().enumerate() {
                        if a != b && !ends[b].entries.contains(&entry) {
                            let swept = swept(tracks, entry, &other.stations);
                            setback_m[lane as usize] = f32::max(setback_m[lane as usize], swept);
                        }
                    }
                }
            }
        }
        found.sort_unstable_by_key(|(lane, conflict)| (*lane, conflict.other));
        let mut first = vec![0u32; lanes + 1];
        for (lane, _) in &found {
            first[*lane as usize + 1] += 1;
        }
        for lane in 0..lanes {
            first[lane + 1] += first[lane];
        }
        let list = found.into_iter().map(|(_, conflict)| conflict).collect();
        Conflicts { first, list, setback_m }
    }

    /// Conflicts of `lane`, ascending by the other lane.
    pub(crate) fn of(&self, lane: u32) -> &[Conflict] {
        let lane = lane as usize;
        &self.list[self.first[lane] as usize..self.first[lane + 1] as usize]
    }
}

/// Tracks of each junction, ascending.
fn junction_members(tracks: &Tracks) -> Vec<Vec<u32>> {
    let mut members: Vec<Vec<u32>> = Vec::new();
    for lane in 0..tracks.count() as u32 {
        let junction = tracks.junction[lane as usize];
        if junction != NONE && tracks.has(lane) {
            if members.len() <= junction as usize {
                members.resize(junction as usize + 1, Vec::new());
            }
            members[junction as usize].push(lane);
        }
    }
    members
}

/// The lanes outside the junction from which a lane is reached, and which it reaches.
struct Ends {
    entries: Vec<u32>,
    exits: Vec<u32>,
}

impl Ends {
    fn of(tracks: &Tracks, lane: u32) -> Ends {
        Ends {
            entries: outside(tracks, lane, Tracks::previous),
            exits: outside(tracks, lane, Tracks::next),
        }
    }
}

/// Walks through lanes of the same junction until outside it.
fn outside<'a>(tracks: &'a Tracks, lane: u32, step: fn(&'a Tracks, u32) -> &'a [u32]) -> Vec<u32> {
    let junction = tracks.junction[lane as usize];
    let (mut seen, mut found, mut open) = (vec![lane], Vec::new(), vec![lane]);
    while let Some(at) = open.pop() {
        for &to in step(tracks, at) {
            if tracks.junction[to as usize] != junction {
                found.push(to);
            } else if !seen.contains(&to) {
                seen.push(to);
                open.push(to);
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

fn shares(a: &[u32], b: &[u32]) -> bool {
    a.iter().any(|lane| b.contains(lane))
}

/// A track of a junction with the room that it takes.
struct Path {
    length_m: f32,
    stations: Vec<Station>,
    bounds: (Vec2, Vec2),
}

impl Path {
    fn of(tracks: &Tracks, lane: u32) -> Path {
        let stations = swept_path::stations(tracks, lane);
        let mut bounds = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for station in &stations {
            let point = station.point.truncate();
            bounds = (bounds.0.min(point), bounds.1.max(point));
        }
        Path { length_m: tracks.length(lane), stations, bounds }
    }

    /// Whether a station lies in the junction.
    fn holds(&self, station: &Station) -> bool {
        (0.0..=self.length_m).contains(&station.arc_m)
    }

    fn is_near(&self, other: &Path) -> bool {
        let (a, b) = (self.bounds, other.bounds);
        (a.0 - REACH_M).cmple(b.1).all() && (b.0 - REACH_M).cmple(a.1).all()
    }
}

/// The stretches of two tracks on which bodies reach each other: two cars, two buses, and two buses
/// inside the junction. Those
/// of buses begin before a track or end after it where one on the other swings out of the junction.
fn overlap(a: &Path, b: &Path, merge: bool) -> [Option<Stretches>; 3] {
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let mut found = [(none, none); 3];
    for mine in &a.stations {
        let mine_inside = a.holds(mine);
        for theirs in &b.stations {
            let to = theirs.point - mine.point;
            let flat = to.truncate();
            let square = flat.length_squared();
            if square > REACH_M * REACH_M || to.z.abs() > STOREY_M {
                continue;
            }
            let inside = [mine_inside, b.holds(theirs)];
            // Behind a merge one follows; before the junction everybody waits for himself.
            let outside = inside == [false; 2];
            if outside && (merge || (mine.arc_m < 0.0 && theirs.arc_m < 0.0)) {
                continue;
            }
            let pairs = [(mine.car, theirs.car, CAR_M), (mine.bus, theirs.bus, BUS_M)];
            for (kind, (reach_a, reach_b, half_m)) in pairs.into_iter().enumerate() {
                let reach_a = reach_a.towards(mine.tangent, flat);
                let reach_b = reach_b.towards(theirs.tangent, -flat);
                let reach = reach_a + reach_b + CLEARANCE_M[kind];
                let swings = kind == 1 && reach_a.max(reach_b) > half_m + SWING_M;
                let within = inside == [true; 2];
                if square >= reach * reach || !(within || swings) {
                    continue;
                }
                // Cars; buses; buses where both tracks are in the junction.
                let kinds = if kind == 1 && within { 1..3 } else { kind..kind + 1 };
                for (on_a, on_b) in &mut found[kinds] {
                    *on_a = (on_a.0.min(mine.arc_m), on_a.1.max(mine.arc_m));
                    *on_b = (on_b.0.min(theirs.arc_m), on_b.1.max(theirs.arc_m));
                }
            }
        }
    }
    found.map(|(mine, theirs)| (mine.0 <= mine.1).then_some(Stretches { mine, theirs }))
}

/// How far before the end of `entry` a bus on the other path still passes too near.
fn swept(tracks: &Tracks, entry: u32, path: &[Station]) -> f32 {
    let (count, step) = tracks.samples(entry);
    let length = tracks.length(entry);
    let first = ((length - SWEEP_M) / step).ceil().max(0.0) as usize;
    let touches = |point: Vec3, station: &Station| {
        let to = point - station.point;
        let reach = station.bus.towards(station.tangent, to.truncate());
        let apart = if reach > BUS_M + SWING_M { reach + WAITING_M } else { BESIDE_M };
        to.truncate().length_squared() < apart * apart && to.z.abs() < STOREY_M
    };
    (first..count)
        .find(|&index| {
            let point = tracks.sample_point(entry, index);
            path.iter().any(|station| station.arc_m >= 0.0 && touches(point, station))
        })
        .map_or(0.0, |index| length - index as f32 * step + 0.5)
}
