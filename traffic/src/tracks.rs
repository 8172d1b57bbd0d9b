//! Lane centres as tables of samples: what vehicles follow.
//!
//! A *track* is the centre of one driving lane, sampled at equal arc length in driving direction.
//! All distances along tracks are arc lengths in metres; lateral offsets are positive to the left.
//! Tracks are indexed by `road::LaneIndex`, so that lanes no vehicle uses have an empty track.

use glam::{Vec2, Vec3};
use road::{Lane, LaneIndex, LanePoint, LaneTypes, Network};

/// A way through a junction has turned if it leaves it in a direction so different, radians
/// (35 degrees).
pub(crate) const TURN_RAD: f32 = 0.61;

/// A way through a junction is of no more lanes than this, one after the other.
const LINKS_MAX: usize = 64;

/// No lane.
pub(crate) const NONE: u32 = u32::MAX;

/// Distance between samples, at most, metres.
const STEP_M: f32 = 1.0;
/// Side acceleration at which curves are taken.
const CURVE_MPS2: f32 = 3.0;
/// Slowing down before curves.
const CURVE_BRAKE_MPS2: f32 = 2.5;
/// Speed limit where the map has none.
const DEFAULT_LIMIT_MPS: f32 = 50.0 / 3.6;
/// A lane that ends counts as ended where half its width is less than this.
const NARROW_M: f32 = 1.3;
/// No curve is so straight that vehicles exceed this.
const FASTEST_MPS: f32 = 70.0;

/// Where a point lies relative to a track.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Projection {
    /// Along the track; below 0 or beyond the length where the point lies before or after it.
    pub(crate) arc_m: f32,
    /// Left of the track.
    pub(crate) left_m: f32,
    /// Driving direction there, unit length.
    pub(crate) tangent: Vec2,
}

/// All tracks of a network, structure of arrays.
pub(crate) struct Tracks {
    /// First sample, by lane; one more entry than lanes.
    first: Vec<u32>,
    /// Arc length, by lane; 0 for lanes without a track.
    pub(crate) length_m: Vec<f32>,
    /// Distance between samples, by lane.
    step_m: Vec<f32>,
    /// Speed limit, by lane, metres per second.
    pub(crate) limit_mps: Vec<f32>,
    /// Junction index, or [`NONE`], by lane.
    pub(crate) junction: Vec<u32>,
    /// The neighbour on the left driven the same way, or [`NONE`], by lane.
    pub(crate) left: Vec<u32>,
    /// As `left`.
    pub(crate) right: Vec<u32>,
    /// On which side the next lane is driven the other way: 1 left, −1 right, 0 neither, by lane.
    pub(crate) oncoming: Vec<f32>,
    /// Whether the markings allow a change to the left, by lane.
    pub(crate) left_change: Vec<bool>,
    /// As `left_change`.
    pub(crate) right_change: Vec<bool>,
    /// Up to where the lane is wide enough to drive on; its length unless it peters out, by lane.
    pub(crate) usable_m: Vec<f32>,
    /// For lanes at a dead end: the lane beside on which one can drive back, else [`NONE`].
    pub(crate) u_turn_lane: Vec<u32>,
    /// Whether one can drive on for ever from here without changing lanes.
    pub(crate) endless: Vec<bool>,
    next: Links,
    previous: Links,
    point: Vec<Vec3>,
    tangent: Vec<Vec2>,
    curvature: Vec<f32>,
    /// Half the lane's width, by sample.
    half_width: Vec<f32>,
    /// Highest speed that still allows every curve ahead on this lane, by sample.
    curve_speed: Vec<f32>,
    /// Highest pace on the lane, by lane.
    top_curve_speed: Vec<f32>,
}

/// Lists of lanes by lane.
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
        let keep = |links: &[LaneIndex]| -> Vec<u32> {
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
            first: Vec::with_capacity(lanes.len() + 1),
            length_m: Vec::with_capacity(lanes.len()),
            step_m: Vec::with_capacity(lanes.len()),
            limit_mps: limits(network),
            junction: lanes.iter().map(|lane| lane.junction.unwrap_or(NONE)).collect(),
            left: lanes.iter().map(|l| neighbour(l, l.left)).collect(),
            right: lanes.iter().map(|l| neighbour(l, l.right)).collect(),
            oncoming: lanes.iter().map(|l| f32::from(oncoming(network, l))).collect(),
            left_change: lanes.iter().map(|l| l.left_change).collect(),
            right_change: lanes.iter().map(|l| l.right_change).collect(),
            usable_m: Vec::with_capacity(lanes.len()),
            u_turn_lane: lanes.iter().map(|lane| u_turn_lane(network, lane)).collect(),
            endless: Vec::new(),
            next: Links::new(lanes.len(), |lane| {
                if usable(lane) { keep(&lanes[lane].successors) } else { Vec::new() }
            }),
            previous: Links::new(lanes.len(), |lane| {
                if usable(lane) { keep(&lanes[lane].predecessors) } else { Vec::new() }
            }),
            point: Vec::new(),
            tangent: Vec::new(),
            curvature: Vec::new(),
            half_width: Vec::new(),
            curve_speed: Vec::new(),
            top_curve_speed: Vec::with_capacity(lanes.len()),
        };
        for lane in 0..lanes.len() {
            tracks.first.push(tracks.point.len() as u32);
            if usable(lane) {
                tracks.sample(network, LaneIndex(lane as u32));
            } else {
                tracks.length_m.push(0.0);
                tracks.step_m.push(1.0);
                tracks.usable_m.push(0.0);
            }
        }
        tracks.first.push(tracks.point.len() as u32);
        tracks.endless = endless(&tracks);
        for lane in 0..lanes.len() as u32 {
            tracks.set_curve_speed(lane);
        }
        tracks
    }

    /// How many lanes there are, with or without a track.
    pub(crate) fn count(&self) -> usize {
        self.length_m.len()
    }

    /// Whether `lane` has a track.
    pub(crate) fn has(&self, lane: u32) -> bool {
        (lane as usize) < self.length_m.len() && self.length_m[lane as usize] > 0.0
    }

    /// Lanes that follow `lane`, ascending.
    pub(crate) fn next(&self, lane: u32) -> &[u32] {
        self.next.of(lane)
    }

    /// Lanes that lead to `lane`, ascending.
    pub(crate) fn previous(&self, lane: u32) -> &[u32] {
        self.previous.of(lane)
    }

    /// Arc length of `lane`.
    pub(crate) fn length(&self, lane: u32) -> f32 {
        self.length_m[lane as usize]
    }

    /// Whether `lane` lies in a junction.
    pub(crate) fn in_junction(&self, lane: u32) -> bool {
        self.junction[lane as usize] != NONE
    }

    /// By how much a way through a junction turns from its first lane to its last, positive to the
    /// left, radians.
    pub(crate) fn turn_rad(&self, way: u32) -> f32 {
        let mut end = way;
        for _ in 0..LINKS_MAX {
            match self.next(end) {
                [next] if self.junction[*next as usize] == self.junction[way as usize] => {
                    end = *next;
                }
                _ => break,
            }
        }
        self.at(way, 0.0).1.angle_to(self.at(end, self.length(end)).1)
    }

    /// Samples of `lane`: how many, and how far apart.
    pub(crate) fn samples(&self, lane: u32) -> (usize, f32) {
        let lane = lane as usize;
        ((self.first[lane + 1] - self.first[lane]) as usize, self.step_m[lane])
    }

    /// Sample `index` of `lane`.
    pub(crate) fn sample_point(&self, lane: u32, index: usize) -> Vec3 {
        self.point[self.first[lane as usize] as usize + index]
    }

    /// The sample at or before `arc_m`, and how far on to the next, 0 to 1.
    fn sample_at(&self, lane: u32, arc_m: f32) -> (usize, f32) {
        let first = self.first[lane as usize] as usize;
        let last = self.first[lane as usize + 1] as usize - 1;
        let at = (arc_m / self.step_m[lane as usize]).clamp(0.0, (last - first) as f32);
        let index = (at as usize).min(last - first - 1);
        (first + index, at - index as f32)
    }

    /// Centre, unit driving direction and curvature (positive to the left) at `arc_m`; straight on
    /// before the start and after the end.
    pub(crate) fn at(&self, lane: u32, arc_m: f32) -> (Vec3, Vec2, f32) {
        let (i, part) = self.sample_at(lane, arc_m);
        let tangent = self.tangent[i].lerp(self.tangent[i + 1], part).normalize_or(Vec2::X);
        let mut point = self.point[i].lerp(self.point[i + 1], part);
        let beyond = arc_m - arc_m.clamp(0.0, self.length(lane));
        point += (tangent * beyond).extend(0.0);
        let curvature = self.curvature[i] + (self.curvature[i + 1] - self.curvature[i]) * part;
        (point, tangent, curvature)
    }

    /// Highest speed at `arc_m` that still allows every curve ahead on this lane.
    pub(crate) fn curve_speed_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (i, part) = self.sample_at(lane, arc_m);
        self.curve_speed[i] + (self.curve_speed[i + 1] - self.curve_speed[i]) * part
    }

    /// The highest speed anywhere on `lane` that its curves allow.
    pub(crate) fn top_curve_speed(&self, lane: u32) -> f32 {
        self.top_curve_speed[lane as usize]
    }

    /// Half the lane's width at `arc_m`.
    pub(crate) fn half_width_at(&self, lane: u32, arc_m: f32) -> f32 {
        let (i, part) = self.sample_at(lane, arc_m);
        self.half_width[i] + (self.half_width[i + 1] - self.half_width[i]) * part
    }

    /// Drops `point` onto the track, beginning near `hint_m`.
    ///
    /// Newton's method on the arc length: two steps suffice from a hint within a few metres.
    pub(crate) fn project(&self, lane: u32, point: Vec2, hint_m: f32) -> Projection {
        let length = self.length(lane);
        let mut arc_m = hint_m.clamp(0.0, length);
        for _ in 0..3 {
            let (centre, tangent, curvature) = self.at(lane, arc_m);
            let offset = point - centre.truncate();
            let left = tangent.perp_dot(offset);
            let stretch = (1.0 - curvature * left).clamp(0.4, 2.5);
            arc_m = (arc_m + tangent.dot(offset) / stretch).clamp(0.0, length);
        }
        let (centre, tangent, _) = self.at(lane, arc_m);
        let offset = point - centre.truncate();
        let beyond = tangent.dot(offset);
        let beyond = if arc_m <= 0.0 {
            beyond.min(0.0)
        } else if arc_m >= length {
            beyond.max(0.0)
        } else {
            0.0
        };
        Projection { arc_m: arc_m + beyond, left_m: tangent.perp_dot(offset), tangent }
    }

    /// The sample of `lane` nearest to `point`: its arc length and squared distance.
    pub(crate) fn nearest_sample(&self, lane: u32, point: Vec2) -> (f32, f32) {
        let (count, step) = self.samples(lane);
        let mut best = (0.0, f32::INFINITY);
        for index in 0..count {
            let distance = self.sample_point(lane, index).truncate().distance_squared(point);
            if distance < best.1 {
                best = (index as f32 * step, distance);
            }
        }
        best
    }

    /// The track nearest to a point, however far, and the arc length there.
    pub(crate) fn nearest(&self, point: Vec2) -> Option<(u32, f32)> {
        let mut best: Option<(f32, u32, f32)> = None;
        for lane in (0..self.count() as u32).filter(|&lane| self.has(lane)) {
            let (arc_m, distance) = self.nearest_sample(lane, point);
            if best.is_none_or(|(least, ..)| distance < least) {
                best = Some((distance, lane, arc_m));
            }
        }
        best.map(|(_, lane, arc_m)| (lane, arc_m))
    }

    /// Samples one lane: finely along s, then evenly along the arc.
    fn sample(&mut self, network: &Network, index: LaneIndex) {
        let lane = network.lane(index);
        let fine = ((lane.length_m / 0.25).ceil() as usize).clamp(2, 100_000);
        // Not quite from end to end: at a section's very end, a record that begins there may
        // already hold for it though it means the next section.
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
        // A lane shorter than this is a slip of the drawing; it still needs a direction.
        let total = total.max(0.01);
        let count = (total as f32 / STEP_M).ceil().max(1.0) as usize;
        let mut k = 0;
        for sample in 0..=count {
            let wanted = total * sample as f64 / count as f64;
            while k + 1 < fine && arc[k + 1] < wanted {
                k += 1;
            }
            let part = ((wanted - arc[k]) / (arc[k + 1] - arc[k]).max(1e-9)).clamp(0.0, 1.0);
            let along_m = along(k) + (along(k + 1) - along(k)) * part;
            let at = place(along_m);
            self.point.push(at.position.as_vec3());
            self.tangent.push(Vec2::from_angle(at.heading_rad as f32));
            let width = network.width(LanePoint { lane: index, along_m });
            self.half_width.push(0.5 * width as f32);
        }
        self.length_m.push(total as f32);
        self.step_m.push(total as f32 / count as f32);
        self.set_curvature(index.0, count + 1);
        let first = self.first[index.0 as usize] as usize;
        let ends = self.next(index.0).is_empty();
        let wide = self.half_width[first..].iter().rposition(|&half| half >= NARROW_M);
        let usable = wide.map_or(0, |last| if ends { last } else { count });
        self.usable_m.push(usable as f32 * self.step_m[index.0 as usize]);
    }

    /// Curvature from the turn of the tangent over two metres either way: maps often draw a smooth
    /// curve as many short arcs whose own curvature jumps.
    fn set_curvature(&mut self, lane: u32, count: usize) {
        let first = self.first[lane as usize] as usize;
        let step = self.step_m[lane as usize];
        let reach = ((2.0 / step).round() as usize).max(1);
        for index in 0..count {
            let (from, to) = (index.saturating_sub(reach), (index + reach).min(count - 1));
            let turn = self.tangent[first + from].angle_to(self.tangent[first + to]);
            self.curvature.push(turn / ((to - from) as f32 * step).max(0.2));
        }
    }

    fn set_curve_speed(&mut self, lane: u32) {
        let (count, step) = self.samples(lane);
        let first = self.first[lane as usize] as usize;
        self.curve_speed.resize(first + count, FASTEST_MPS);
        let mut ahead = FASTEST_MPS;
        for index in (first..first + count).rev() {
            let curve = (CURVE_MPS2 / self.curvature[index].abs().max(1e-4)).sqrt();
            let brake = (ahead * ahead + 2.0 * CURVE_BRAKE_MPS2 * step).sqrt();
            ahead = curve.min(brake).min(FASTEST_MPS);
            self.curve_speed[index] = ahead;
        }
        self.top_curve_speed.push(self.curve_speed[first..].iter().copied().fold(0.0, f32::max));
    }
}

/// On which side of a lane the next lane is driven the other way: 1 left, −1 right.
fn oncoming(network: &Network, lane: &Lane) -> i8 {
    let opposes = |side: Option<LaneIndex>| {
        side.map(|side| network.lane(side)).is_some_and(|side| {
            LaneTypes::DRIVABLE.contains(side.kind) && side.forward != lane.forward
        })
    };
    i8::from(opposes(lane.left)) - i8::from(opposes(lane.right))
}

/// The nearest lane driven the other way, for a lane after which there is no road.
fn u_turn_lane(network: &Network, lane: &Lane) -> u32 {
    let mut at = lane;
    if !lane.successors.is_empty() {
        return NONE;
    }
    for _ in 0..8 {
        // Seen in driving direction, the other side of the road is to the left where traffic keeps
        // right; beyond the middle, directions swap.
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

/// Speed limits by lane. A lane without one takes the lowest of the lanes that lead to it, then of
/// those that follow it, so that connecting roads carry their approach's limit.
fn limits(network: &Network) -> Vec<f32> {
    let lanes = network.lanes();
    let mut limit: Vec<Option<f32>> =
        lanes.iter().map(|l| l.speed_limit_mps.map(|mps| (mps as f32).max(2.0))).collect();
    for _ in 0..8 {
        let known = limit.clone();
        for (index, lane) in lanes.iter().enumerate() {
            if known[index].is_none() {
                let of = |links: &[LaneIndex]| {
                    links.iter().filter_map(|l| known[l.0 as usize]).min_by(f32::total_cmp)
                };
                limit[index] = of(&lane.predecessors).or_else(|| of(&lane.successors));
            }
        }
    }
    limit.into_iter().map(|l| l.unwrap_or(DEFAULT_LIMIT_MPS).min(FASTEST_MPS)).collect()
}

/// Lanes from which one can drive on for ever: what remains after dead ends, and what leads only
/// to dead ends, are struck off.
fn endless(tracks: &Tracks) -> Vec<bool> {
    let count = tracks.count();
    let mut endless: Vec<bool> = (0..count as u32).map(|lane| tracks.has(lane)).collect();
    let mut ways: Vec<usize> = (0..count as u32)
        .map(|lane| tracks.next(lane).iter().filter(|&&n| n != lane).count())
        .collect();
    let mut removed: Vec<u32> = (0..count as u32)
        .filter(|&lane| endless[lane as usize] && ways[lane as usize] == 0)
        .collect();
    while let Some(lane) = removed.pop() {
        endless[lane as usize] = false;
        for &before in tracks.previous(lane) {
            let before_index = before as usize;
            if endless[before_index] && tracks.next(before).contains(&lane) {
                ways[before_index] -= 1;
                if ways[before_index] == 0 {
                    endless[before_index] = false;
                    removed.push(before);
                }
            }
        }
    }
    endless
}
