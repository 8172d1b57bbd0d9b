//! Where the tracks of a junction get in each other's way.
//!
//! Two tracks *conflict* where a vehicle on one leaves no room for a vehicle on the other. Tracks
//! that share their way in do not conflict: who drives behind sees who drives in front. Tracks
//! that share their way out *merge*: the second follows the first. All others *cross*: the second
//! waits until the first has left.

use glam::Vec2;

use crate::tracks::{NONE, Tracks};

/// Nearer than this, two centres leave no room for two vehicles.
const CLEARANCE_M: f32 = 2.5;
/// Tracks farther apart in height pass over each other.
const STOREY_M: f32 = 3.0;
/// How far before a junction crossing paths can sweep over waiting vehicles.
const SWEEP_M: f32 = 14.0;
/// Nearer than this, a passing vehicle touches a waiting one.
const SWEEP_CLEARANCE_M: f32 = 2.3;

/// A stretch of one track that a stretch of another makes unsafe, seen from the first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conflict {
    /// The other track.
    pub(crate) other: u32,
    /// From where to where on this track.
    pub(crate) mine: (f32, f32),
    /// From where to where on the other.
    pub(crate) theirs: (f32, f32),
    /// Both leave by the same lane.
    pub(crate) merge: bool,
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
            let boxes: Vec<(Vec2, Vec2)> = lanes.iter().map(|&lane| bounds(tracks, lane)).collect();
            for a in 0..lanes.len() {
                for b in a + 1..lanes.len() {
                    if shares(&ends[a].entries, &ends[b].entries) || !near(boxes[a], boxes[b]) {
                        continue;
                    }
                    let Some((mine, theirs)) = overlap(tracks, lanes[a], lanes[b]) else {
                        continue;
                    };
                    let merge = shares(&ends[a].exits, &ends[b].exits);
                    found.push((lanes[a], Conflict { other: lanes[b], mine, theirs, merge }));
                    found.push((
                        lanes[b],
                        Conflict { other: lanes[a], mine: theirs, theirs: mine, merge },
                    ));
                }
            }
            for (a, &lane) in lanes.iter().enumerate() {
                for &entry in tracks.previous(lane).iter().filter(|&&l| !tracks.in_junction(l)) {
                    for (b, &other) in lanes.iter().enumerate() {
                        if a != b && !ends[b].entries.contains(&entry) {
                            let swept = swept(tracks, entry, other);
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

fn bounds(tracks: &Tracks, lane: u32) -> (Vec2, Vec2) {
    let mut bounds = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    for index in 0..tracks.samples(lane).0 {
        let point = tracks.sample_point(lane, index).truncate();
        bounds = (bounds.0.min(point), bounds.1.max(point));
    }
    bounds
}

fn near(a: (Vec2, Vec2), b: (Vec2, Vec2)) -> bool {
    (a.0 - CLEARANCE_M).cmple(b.1).all() && (b.0 - CLEARANCE_M).cmple(a.1).all()
}

/// The stretches of two tracks that lie within the clearance of the other.
fn overlap(tracks: &Tracks, a: u32, b: u32) -> Option<((f32, f32), (f32, f32))> {
    let ((count_a, step_a), (count_b, step_b)) = (tracks.samples(a), tracks.samples(b));
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let (mut on_a, mut on_b) = (none, none);
    for i in 0..count_a {
        let point = tracks.sample_point(a, i);
        for j in 0..count_b {
            let to = tracks.sample_point(b, j) - point;
            if to.truncate().length_squared() < CLEARANCE_M * CLEARANCE_M && to.z.abs() < STOREY_M {
                let (at_a, at_b) = (i as f32 * step_a, j as f32 * step_b);
                on_a = (on_a.0.min(at_a), on_a.1.max(at_a));
                on_b = (on_b.0.min(at_b), on_b.1.max(at_b));
            }
        }
    }
    (on_a.0 <= on_a.1).then_some((on_a, on_b))
}

/// How far before the end of `entry` the path `other` still passes too near.
fn swept(tracks: &Tracks, entry: u32, other: u32) -> f32 {
    let (count, step) = tracks.samples(entry);
    let length = tracks.length(entry);
    let mut swept = 0.0f32;
    for index in 0..count {
        let before = length - index as f32 * step;
        if before > SWEEP_M {
            continue;
        }
        let point = tracks.sample_point(entry, index);
        let touched = (0..tracks.samples(other).0).any(|j| {
            let to = tracks.sample_point(other, j) - point;
            to.truncate().length_squared() < SWEEP_CLEARANCE_M * SWEEP_CLEARANCE_M
                && to.z.abs() < STOREY_M
        });
        if touched {
            swept = swept.max(before + 0.5);
        }
    }
    swept
}
