//! Lane centre lines as tables of samples, which vehicles follow.
//!
//! A *track* is the centre line of one driving lane, sampled at equal arc lengths in driving
//! direction. All distances along tracks are arc lengths in metres; lateral offsets are positive to
//! the left. Tracks are indexed by `road::LaneIndex`; lanes for other uses have an empty track.

pub(crate) mod lookup;

use std::borrow::Cow;

use bake::Parts;
use bytemuck::{Pod, Zeroable, cast_slice};
use glam::{Vec2, Vec3};
use road::{Lane, LaneIndex, LanePoint, LaneTypes, Network};

/// Change of direction from which a path through a junction counts as a turn, radians (35 degrees).
pub(crate) const TURN_RAD: f32 = 0.61;

/// Largest number of consecutive lanes of a path through a junction.
const LINKS_MAX: usize = 64;

/// Radius of a bend below which a bus leaves its lane. Metres.
const BEND_RADIUS_M: f32 = 14.0;
/// Length up to which a section with such a bend is a conflict zone, within which no vehicle waits.
const BEND_MAX_M: f32 = 45.0;

/// No lane.
pub(crate) const NONE: u32 = u32::MAX;

/// Largest distance between samples, metres.
const STEP_M: f32 = 1.0;
/// Lateral acceleration in curves.
const CURVE_MPS2: f32 = 3.0;
/// Deceleration before curves.
const CURVE_BRAKE_MPS2: f32 = 2.5;
/// Speed limit where the map has none.
const DEFAULT_LIMIT_MPS: f32 = 50.0 / 3.6;
/// Half width at which an ending lane counts as ended.
const NARROW_M: f32 = 1.3;
/// Distance along a track from a sample up to which its direction and curvature tell whether something
/// is beside the track, metres, and the highest curvature that is reckoned with.
pub(crate) const HINT_M: f32 = 5.0;
const BEND_MAX_PER_M: f32 = 0.15;
/// Bound on the speed of all tracks.
const FASTEST_MPS: f32 = 70.0;

/// All tracks of a network as a structure of arrays.
pub(crate) struct Tracks {
    /// Where the samples of a lane lie, by lane.
    lines: Vec<LineHead>,
    /// Summaries of the samples, by lane.
    summaries: Vec<Summary>,
    /// Arc length, by lane; 0 for lanes without a track.
    pub(crate) length_m: Vec<f32>,
    /// Speed limit, by lane, metres per second.
    pub(crate) limit_mps: Vec<f32>,
    /// Junction index, or [`NONE`], by lane.
    pub(crate) junction: Vec<u32>,
    /// Index of the conflict zone, or [`NONE`], by lane: a junction, with the index of the junction,
    /// or a narrow curve.
    pub(crate) zone: Vec<u32>,
    /// The left neighbour with the same driving direction, or [`NONE`], by lane.
    pub(crate) left: Vec<u32>,
    /// The right neighbour with the same driving direction, or [`NONE`], by lane.
    pub(crate) right: Vec<u32>,
    /// Side of an adjacent oncoming lane: 1 left, −1 right, 0 neither, by lane.
    pub(crate) oncoming: Vec<f32>,
    /// Whether the markings allow a change to the left, by lane.
    pub(crate) left_change: Vec<bool>,
    /// Whether the markings allow a change to the right, by lane.
    pub(crate) right_change: Vec<bool>,
    /// Arc length up to which the lane is wide enough; its length unless it narrows to its end, by
    /// lane.
    pub(crate) usable_m: Vec<f32>,
    /// The lane for a U-turn at a dead end, else [`NONE`], by lane.
    pub(crate) u_turn_lane: Vec<u32>,
    /// Whether a vehicle can drive on from here indefinitely without changing lanes, by lane.
    pub(crate) endless: Vec<bool>,
    next: Links,
    previous: Links,
    samples: Vec<Sample>,
    /// Highest curve speed on the lane, by lane.
    top_curve_speed: Vec<f32>,
}

/// Where the samples of a lane lie. What is read together lies together.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct LineHead {
    /// The first sample, and the number of samples.
    first: u32,
    count: u32,
    /// Distance between samples, and arc length.
    step_m: f32,
    length_m: f32,
}

/// What is often asked of the samples of a lane without reading them: they fill more memory than a
/// processor's caches hold.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Summary {
    /// Least and greatest height.
    low_m: f32,
    high_m: f32,
    /// Curve speed of the first sample.
    curve_speed: f32,
    /// Highest curvature, whatever its sign.
    sharpest_per_m: f32,
    /// Driving directions of the first and of the last sample.
    tangents: [Vec2; 2],
}

impl Summary {
    /// Summarises samples before their curvatures and curve speeds are known.
    fn of(samples: &[Sample]) -> Summary {
        let heights = || samples.iter().map(|sample| sample.point.z);
        Summary {
            low_m: heights().fold(f32::INFINITY, f32::min),
            high_m: heights().fold(f32::NEG_INFINITY, f32::max),
            curve_speed: FASTEST_MPS,
            sharpest_per_m: 0.0,
            tangents: [samples[0].tangent, samples[samples.len() - 1].tangent],
        }
    }
}

/// A point of a track. What is read together lies together.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Sample {
    point: Vec3,
    tangent: Vec2,
    curvature: f32,
    /// Half the lane's width.
    half_width: f32,
    /// Highest speed that allows every curve ahead on this lane.
    curve_speed: f32,
}

/// Lists of lanes, by lane.
struct Links {
    first: Vec<u32>,
    lanes: Vec<u32>,
}

impl Links {
    fn new(count: usize, of: impl Fn(usize) -> Vec<u32>) -> Links {
        let mut links = Links { first: Vec::with_capacity(count + 1), lanes: Vec::new() };
        for lane in 0..count {
            links.first.push(links.lanes.len() as u32);
            links.lanes.extend(of(lane));
        }
        links.first.push(links.lanes.len() as u32);
        links
    }

    fn of(&self, lane: u32) -> &[u32] {
        let lane = lane as usize;
        &self.lanes[self.first[lane] as usize..self.first[lane + 1] as usize]
    }
}

impl Tracks {
    /// Samples every driving lane of `network`.
    pub(crate) fn new(network: &Network) -> Tracks {
        let lanes = network.lanes();
        let drivable = |lane: LaneIndex| LaneTypes::DRIVABLE.contains(network.lane(lane).kind);
        let sorted_links = |links: &[LaneIndex]| -> Vec<u32> {
            let mut kept: Vec<u32> =
                links.iter().filter(|&&lane| drivable(lane)).map(|lane| lane.0).collect();
            kept.sort_unstable();
            kept.dedup();
            kept
        };
        let neighbour = |own: &Lane, side: Option<LaneIndex>| match side {
            Some(lane) if drivable(lane) && network.lane(lane).forward == own.forward => lane.0,
            _ => NONE,
        };
        let usable = |lane: usize| LaneTypes::DRIVABLE.contains(lanes[lane].kind);
        let mut tracks = Tracks {
            lines: Vec::with_capacity(lanes.len()),
            summaries: Vec::with_capacity(lanes.len()),
            length_m: Vec::with_capacity(lanes.len()),
            limit_mps: limits(network),
            junction: lanes.iter().map(|lane| lane.junction.unwrap_or(NONE)).collect(),
            zone: Vec::new(),
            left: lanes.iter().map(|l| neighbour(l, l.left)).collect(),
            right: lanes.iter().map(|l| neighbour(l, l.right)).collect(),
            oncoming: lanes.iter().map(|l| f32::from(oncoming(network, l))).collect(),
            left_change: lanes.iter().map(|l| l.left_change).collect(),
            right_change: lanes.iter().map(|l| l.right_change).collect(),
            usable_m: Vec::with_capacity(lanes.len()),
            u_turn_lane: lanes.iter().map(|lane| u_turn_lane(network, lane)).collect(),
            endless: Vec::new(),
            next: Links::new(lanes.len(), |lane| {
                if usable(lane) { sorted_links(&lanes[lane].successors) } else { Vec::new() }
            }),
            previous: Links::new(lanes.len(), |lane| {
                if usable(lane) { sorted_links(&lanes[lane].predecessors) } else { Vec::new() }
            }),
            samples: Vec::new(),
            top_curve_speed: Vec::with_capacity(lanes.len()),
        };
        for lane in 0..lanes.len() {
            if usable(lane) {
                tracks.sample(network, LaneIndex(lane as u32));
            } else {
                let first = tracks.samples.len() as u32;
                tracks.lines.push(LineHead { first, step_m: 1.0, ..LineHead::zeroed() });
                tracks.summaries.push(Summary::zeroed());
                tracks.length_m.push(0.0);
                tracks.usable_m.push(0.0);
            }
        }
        tracks.endless = endless(&tracks);
        tracks.zone = zones(&tracks, network);
        for lane in 0..lanes.len() as u32 {
            tracks.set_curve_speed(lane);
        }
        tracks
    }

    /// Returns the tables as bytes, in the order in which [`Tracks::take`] reads them.
    pub(crate) fn parts(&self) -> Vec<Cow<'_, [u8]>> {
        let bools = |list: &[bool]| list.iter().copied().map(u8::from).collect::<Vec<u8>>().into();
        vec![
            cast_slice(&self.lines).into(),
            cast_slice(&self.summaries).into(),
            cast_slice(&self.length_m).into(),
            cast_slice(&self.limit_mps).into(),
            cast_slice(&self.junction).into(),
            cast_slice(&self.zone).into(),
            cast_slice(&self.left).into(),
            cast_slice(&self.right).into(),
            cast_slice(&self.oncoming).into(),
            bools(&self.left_change),
            bools(&self.right_change),
            cast_slice(&self.usable_m).into(),
            cast_slice(&self.u_turn_lane).into(),
            bools(&self.endless),
            cast_slice(&self.next.first).into(),
            cast_slice(&self.next.lanes).into(),
            cast_slice(&self.previous.first).into(),
            cast_slice(&self.previous.lanes).into(),
            cast_slice(&self.samples).into(),
            cast_slice(&self.top_curve_speed).into(),
        ]
    }

    /// Reads what [`Tracks::parts`] gave; `None` if a part is missing or damaged.
    pub(crate) fn take(parts: &mut Parts) -> Option<Tracks> {
        fn bools(parts: &mut Parts) -> Option<Vec<bool>> {
            Some(parts.take::<u8>()?.into_iter().map(|byte| byte != 0).collect())
        }
        // In the order of the file.
        Some(Tracks {
            lines: parts.take()?,
            summaries: parts.take()?,
            length_m: parts.take()?,
            limit_mps: parts.take()?,
            junction: parts.take()?,
            zone: parts.take()?,
            left: parts.take()?,
            right: parts.take()?,
            oncoming: parts.take()?,
            left_change: bools(parts)?,
            right_change: bools(parts)?,
            usable_m: parts.take()?,
            u_turn_lane: parts.take()?,
            endless: bools(parts)?,
            next: Links { first: parts.take()?, lanes: parts.take()? },
            previous: Links { first: parts.take()?, lanes: parts.take()? },
            samples: parts.take()?,
            top_curve_speed: parts.take()?,
        })
    }

    /// Returns the number of lanes, with or without a track.
    pub(crate) fn count(&self) -> usize {
        self.length_m.len()
    }

    /// Returns whether `lane` has a track.
    pub(crate) fn has(&self, lane: u32) -> bool {
        (lane as usize) < self.length_m.len() && self.length_m[lane as usize] > 0.0
    }

    /// Returns the lanes that follow `lane`, ascending.
    pub(crate) fn next(&self, lane: u32) -> &[u32] {
        self.next.of(lane)
    }

    /// Returns the lanes that lead to `lane`, ascending.
    pub(crate) fn previous(&self, lane: u32) -> &[u32] {
        self.previous.of(lane)
    }

    /// Returns the arc length of `lane`.
    pub(crate) fn length(&self, lane: u32) -> f32 {
        self.length_m[lane as usize]
    }

    /// Returns whether `lane` lies in a junction.
    pub(crate) fn in_junction(&self, lane: u32) -> bool {
        self.junction[lane as usize] != NONE
    }

    /// Returns whether `lane` lies in a conflict zone.
    pub(crate) fn in_zone(&self, lane: u32) -> bool {
        self.zone[lane as usize] != NONE
    }

    /// Returns the highest curvature of `lane`, whatever its sign.
    pub(crate) fn sharpest(&self, lane: u32) -> f32 {
        self.summaries[lane as usize].sharpest_per_m
    }

    /// Returns the change of direction of a path through a junction from its first lane to its
    /// last, positive to the left, radians.
    pub(crate) fn turn_rad(&self, path: u32) -> f32 {
        let mut end = path;
        for _ in 0..LINKS_MAX {
            match self.next(end) {
                [next] if self.junction[*next as usize] == self.junction[path as usize] => {
                    end = *next;
                }
                _ => break,
            }
        }
        self.at(path, 0.0).1.angle_to(self.at(end, self.length(end)).1)
    }

    /// Returns the number of samples of `lane` and the distance between them.
    pub(crate) fn samples(&self, lane: u32) -> (usize, f32) {
        let line = &self.lines[lane as usize];
        (line.count as usize, line.step_m)
    }

    fn samples_of(&self, lane: u32) -> &[Sample] {
        let line = &self.lines[lane as usize];
        &self.samples[line.first as usize..][..line.count as usize]
    }

    /// Returns sample `index` of `lane`.
    pub(crate) fn sample_point(&self, lane: u32, index: usize) -> Vec3 {
        self.samples_of(lane)[index].point
    }

    /// Samples one lane: finely along s, then evenly along the arc.
    fn sample(&mut self, network: &Network, index: LaneIndex) {
        let lane = network.lane(index);
        let fine = ((lane.length_m / 0.25).ceil() as usize).clamp(2, 100_000);
        // Not quite from end to end: a record that begins at a section's very end may already apply
        // there though it belongs to the next section.
        let inset = lane.length_m.min(1.0) * 1e-3;
        let along = |k: usize| inset + (lane.length_m - 2.0 * inset) * k as f64 / fine as f64;
        let place = |along_m: f64| network.place(LanePoint { lane: index, along_m });
        let mut arc = Vec::with_capacity(fine + 1);
        let mut total = 0.0;
        let mut last = place(along(0)).position;
        for k in 0..=fine {
            let here = place(along(k)).position;
            total += here.distance(last);
            last = here;
            arc.push(total);
        }
        // A shorter lane is an artefact of the map; it still needs a direction.
        let total = total.max(0.01);
        let count = (total as f32 / STEP_M).ceil().max(1.0) as usize;
        let mut k = 0;
        for sample in 0..=count {
            let target_m = total * sample as f64 / count as f64;
            while k + 1 < fine && arc[k + 1] < target_m {
                k += 1;
            }
            let part = ((target_m - arc[k]) / (arc[k + 1] - arc[k]).max(1e-9)).clamp(0.0, 1.0);
            let along_m = along(k) + (along(k + 1) - along(k)) * part;
            let at = place(along_m);
            let width = network.width(LanePoint { lane: index, along_m });
            self.samples.push(Sample {
                point: at.position.as_vec3(),
                tangent: Vec2::from_angle(at.heading_rad as f32),
                curvature: 0.0,
                half_width: 0.5 * width as f32,
                curve_speed: FASTEST_MPS,
            });
        }
        let (length_m, step_m) = (total as f32, total as f32 / count as f32);
        let first = self.samples.len() - (count + 1);
        self.length_m.push(length_m);
        let samples = &self.samples[first..];
        let (begin, count_all) = (first as u32, samples.len() as u32);
        self.lines.push(LineHead { first: begin, count: count_all, step_m, length_m });
        self.summaries.push(Summary::of(samples));
        self.set_curvature(index.0);
        let ends = self.next(index.0).is_empty();
        let wide = self.samples[first..].iter().rposition(|at| at.half_width >= NARROW_M);
        let usable = wide.map_or(0, |last| if ends { last } else { count });
        self.usable_m.push(usable as f32 * step_m);
    }

    /// Computes curvature from the change of direction over two metres either way: maps often draw
    /// a smooth curve as many short arcs whose own curvature jumps.
    fn set_curvature(&mut self, lane: u32) {
        let (count, step) = self.samples(lane);
        let first = self.lines[lane as usize].first as usize;
        let reach = ((2.0 / step).round() as usize).max(1);
        for index in 0..count {
            let (from, to) = (index.saturating_sub(reach), (index + reach).min(count - 1));
            let tangent = |at: usize| self.samples[first + at].tangent;
            let turn = tangent(from).angle_to(tangent(to));
            self.samples[first + index].curvature = turn / ((to - from) as f32 * step).max(0.2);
        }
        let curvatures = self.samples_of(lane).iter().map(|at| at.curvature.abs());
        self.summaries[lane as usize].sharpest_per_m = curvatures.fold(0.0, f32::max);
    }

    fn set_curve_speed(&mut self, lane: u32) {
        let (count, step) = self.samples(lane);
        let first = self.lines[lane as usize].first as usize;
        let mut ahead = FASTEST_MPS;
        for index in (first..first + count).rev() {
            let curve = (CURVE_MPS2 / self.samples[index].curvature.abs().max(1e-4)).sqrt();
            let brake = (ahead * ahead + 2.0 * CURVE_BRAKE_MPS2 * step).sqrt();
            ahead = curve.min(brake).min(FASTEST_MPS);
            self.samples[index].curve_speed = ahead;
        }
        self.summaries[lane as usize].curve_speed = ahead;
        let speeds_mps = self.samples_of(lane).iter().map(|at| at.curve_speed);
        self.top_curve_speed.push(speeds_mps.fold(0.0, f32::max));
    }
}

impl Tracks {
    /// Returns for each sample of `lane` a bound on the curvature within [`HINT_M`]: by how much the
    /// direction turns and the track leaves the straight continuation, with a margin.
    pub(crate) fn bends(&self, lane: u32) -> Vec<f32> {
        let (count, step_m) = self.samples(lane);
        let samples = self.samples_of(lane);
        let reach = ((HINT_M + 2.0) / step_m).ceil() as usize;
        let bend = |index: usize| {
            let own = &samples[index];
            let (from, to) = (index.saturating_sub(reach), (index + reach).min(count - 1));
            let mut most = 0.0f32;
            for (other, sample) in (from..=to).zip(&samples[from..=to]) {
                let apart_m = other.abs_diff(index) as f32 * step_m;
                if apart_m == 0.0 {
                    continue;
                }
                if own.tangent.dot(sample.tangent) < 0.7 {
                    return BEND_MAX_PER_M;
                }
                let offset = (sample.point - own.point).truncate();
                // Up to 45 degrees an angle is at most 1.12 times its sine.
                let turn = 1.12 * own.tangent.perp_dot(sample.tangent).abs() / apart_m;
                let aside = 2.0 * own.tangent.perp_dot(offset).abs() / (apart_m * apart_m);
                most = most.max(turn).max(aside);
            }
            (1.5 * most + 0.002).min(BEND_MAX_PER_M)
        };
        (0..count).map(bend).collect()
    }
}

/// Returns the conflict zones: junctions, and narrow curves. A narrow curve is a short section of a
/// road with oncoming traffic and a bend in which a bus needs the oncoming lane too: vehicles that
/// do not leave it to a bus and its oncoming traffic one after the other would block each other for
/// ever.
fn zones(tracks: &Tracks, network: &Network) -> Vec<u32> {
    let mut zones = tracks.junction.clone();
    let is_bend = |lane: u32| {
        tracks.has(lane)
            && !tracks.in_junction(lane)
            && tracks.oncoming[lane as usize] != 0.0
            && tracks.length(lane) < BEND_MAX_M
            && tracks.sharpest(lane) > 1.0 / BEND_RADIUS_M
    };
    let mut sections: Vec<((u32, u32), u32)> = (0..tracks.count() as u32)
        .filter(|&lane| is_bend(lane))
        .map(|lane| {
            let of = network.lane(LaneIndex(lane));
            ((of.road, of.section), lane)
        })
        .collect();
    sections.sort_unstable();
    let bends = sections.chunk_by(|a, b| a.0 == b.0).filter(|lanes| lanes.len() > 1);
    for (zone, lanes) in (network.junctions().len() as u32..).zip(bends) {
        for &(_, lane) in lanes {
            zones[lane as usize] = zone;
        }
    }
    zones
}

/// Returns the side of an adjacent oncoming lane: 1 left, −1 right, 0 neither.
fn oncoming(network: &Network, lane: &Lane) -> i8 {
    let opposes = |side: Option<LaneIndex>| {
        side.map(|side| network.lane(side)).is_some_and(|side| {
            LaneTypes::DRIVABLE.contains(side.kind) && side.forward != lane.forward
        })
    };
    i8::from(opposes(lane.left)) - i8::from(opposes(lane.right))
}

/// Returns the nearest oncoming lane, for a lane without successors.
fn u_turn_lane(network: &Network, lane: &Lane) -> u32 {
    let mut at = lane;
    if !lane.successors.is_empty() {
        return NONE;
    }
    for _ in 0..8 {
        // In driving direction, the other side of the road is to the left in right-hand traffic;
        // beyond the middle, directions swap.
        let side = if network.roads()[lane.road as usize].left_hand { at.right } else { at.left };
        let Some(next) = side else { return NONE };
        at = network.lane(next);
        if at.forward != lane.forward {
            let open = LaneTypes::DRIVABLE.contains(at.kind) && !at.successors.is_empty();
            if open {
                return at.index.0;
            }
            return NONE;
        }
    }
    NONE
}

/// Returns speed limits by lane. A lane without one takes the lowest of its predecessors, then of
/// its successors, so that connecting roads have the limit of their approach.
fn limits(network: &Network) -> Vec<f32> {
    let lanes = network.lanes();
    let mut limit: Vec<Option<f32>> =
        lanes.iter().map(|l| l.speed_limit_mps.map(|mps| (mps as f32).max(2.0))).collect();
    for _ in 0..8 {
        let before_pass = limit.clone();
        for (index, lane) in lanes.iter().enumerate() {
            if before_pass[index].is_none() {
                let of = |links: &[LaneIndex]| {
                    links.iter().filter_map(|l| before_pass[l.0 as usize]).min_by(f32::total_cmp)
                };
                limit[index] = of(&lane.predecessors).or_else(|| of(&lane.successors));
            }
        }
    }
    limit.into_iter().map(|l| l.unwrap_or(DEFAULT_LIMIT_MPS).min(FASTEST_MPS)).collect()
}

/// Returns the lanes from which a vehicle can drive on indefinitely: dead ends, and lanes that lead
/// only to dead ends, are removed.
fn endless(tracks: &Tracks) -> Vec<bool> {
    let count = tracks.count();
    let mut endless: Vec<bool> = (0..count as u32).map(|lane| tracks.has(lane)).collect();
    let mut branch_counts: Vec<usize> =
        (0..count as u32).map(|lane| tracks.next(lane).len()).collect();
    let mut removed: Vec<u32> = (0..count as u32)
        .filter(|&lane| endless[lane as usize] && branch_counts[lane as usize] == 0)
        .collect();
    while let Some(lane) = removed.pop() {
        endless[lane as usize] = false;
        for &before in tracks.previous(lane) {
            let before_index = before as usize;
            if endless[before_index] && tracks.next(before).contains(&lane) {
                branch_counts[before_index] -= 1;
                if branch_counts[before_index] == 0 {
                    endless[before_index] = false;
                    removed.push(before);
                }
            }
        }
    }
    endless
}
