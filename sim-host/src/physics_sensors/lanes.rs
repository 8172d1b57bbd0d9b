//! Which markings a carrier's corners crossed.
//!
//! A corner's place is told by lane and side: the nearest lane centre, and from there the lane that
//! the corner lies in, by widths. Two places of one section differ by the borders between them, and
//! what is painted on those is what was crossed. In junctions lanes lie over each other: there,
//! nothing is crossed, as in CARLA.

use glam::{DVec3, Vec3};
use protocol::{ActorState, LaneInvasionReading, flag};
use road::{Lane, LanePoint, LaneTypes, MarkKind, Network};

/// No frame moves a corner farther than this on wheels.
const LEAP_M: f64 = 10.0;
/// Lanes that a corner passes in one frame at most.
const LANES_MAX: usize = 8;

/// The four corners of one carrier, as they were a frame ago.
#[derive(Default)]
pub(super) struct Corners {
    before: Option<[DVec3; 4]>,
}

impl Corners {
    /// The carrier's new state: what was crossed on the way there.
    pub(super) fn crossings(
        &mut self,
        carrier: &ActorState,
        network: &Network,
    ) -> Vec<LaneInvasionReading> {
        let now = corners_of(carrier);
        let before = self.before.replace(now);
        let Some(before) = before.filter(|_| !carrier.has(flag::TELEPORTED)) else {
            return Vec::new();
        };
        let mut crossed = Vec::new();
        for (corner, (from, to)) in before.into_iter().zip(now).enumerate() {
            if from != to && from.distance(to) < LEAP_M {
                add_crossings(network, from, to, corner as u32, &mut crossed);
            }
        }
        crossed
    }
}

/// Front left, front right, rear left, rear right: the box's corners, on the ground.
fn corners_of(carrier: &ActorState) -> [DVec3; 4] {
    let blueprint = &town::catalogue()[carrier.blueprint as usize];
    let (half, middle) = (blueprint.half_extents_m, blueprint.center_m);
    let place = carrier.pose.affine();
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(ahead, left)| {
        let corner = Vec3::new(middle.x + ahead * half.x, middle.y + left * half.y, 0.0);
        place.transform_point3(corner).as_dvec3()
    })
}

/// Where a place lies: in a lane, or beyond the outermost one on a side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    at: LanePoint,
    /// 1: to the left of the lane, and there is no other; −1: to its right; 0: in it.
    beyond: i32,
}

fn add_crossings(
    network: &Network,
    from: DVec3,
    to: DVec3,
    corner: u32,
    crossed: &mut Vec<LaneInvasionReading>,
) {
    let nearest = |place| network.nearest(place, LaneTypes::ANY);
    let (Some(first), Some(last)) = (nearest(from), nearest(to)) else { return };
    let lane = |at: LanePoint| network.lane(at.lane);
    if lane(first).junction.is_some() || lane(last).junction.is_some() {
        return;
    }
    let section = |lane: &Lane| (lane.road, lane.section);
    let target = spot_of(network, last, to);
    let is_same = section(lane(first)) == section(lane(last));
    // Where a section has just begun, its lanes are taken to reach back to where the corner was.
    let start = spot_of(network, if is_same { first } else { last }, from);
    if (start.at.lane, start.beyond) == (target.at.lane, target.beyond) {
        return;
    }
    for is_left in [true, false] {
        let mut path = Vec::new();
        if walk(network, start, target, is_left, &mut path) {
            crossed.extend(path.into_iter().map(|found| LaneInvasionReading { corner, ..found }));
            return;
        }
    }
}

/// Metres to the left of a lane's centre.
fn left_of(network: &Network, at: LanePoint, place: DVec3) -> f64 {
    let centre = network.place(at);
    (centre.rotation().inverse() * (place - centre.position)).y
}

/// From a lane near a place to the lane that the place is in.
fn spot_of(network: &Network, near: LanePoint, place: DVec3) -> Spot {
    let mut at = near;
    for _ in 0..LANES_MAX {
        let left = left_of(network, at, place);
        let half = 0.5 * network.width(at);
        if left.abs() <= half {
            return Spot { at, beyond: 0 };
        }
        let is_left = left > 0.0;
        match neighbour(network, at, is_left) {
            Some(next) if next.lane != near.lane => at = next,
            _ => return Spot { at, beyond: if is_left { 1 } else { -1 } },
        }
    }
    Spot { at, beyond: 0 }
}

/// The lane beside, at the same s.
fn neighbour(network: &Network, at: LanePoint, is_left: bool) -> Option<LanePoint> {
    let lane = network.lane(at.lane);
    let next = network.lane(if is_left { lane.left? } else { lane.right? });
    let ds = if lane.forward { at.along_m } else { lane.length_m - at.along_m };
    let along_m = if next.forward { ds } else { next.length_m - ds };
    Some(LanePoint { lane: next.index, along_m: along_m.clamp(0.0, next.length_m) })
}

/// Goes from spot to spot over the borders on one side; true if the other one was reached.
fn walk(
    network: &Network,
    start: Spot,
    target: Spot,
    mut is_left: bool,
    path: &mut Vec<LaneInvasionReading>,
) -> bool {
    let mut at = start.at;
    if start.beyond != 0 {
        if (start.beyond > 0) == is_left {
            return false;
        }
        // Who was beyond the outermost lane comes into it over its border.
        add_mark(network, at, !is_left, path);
    }
    for _ in 0..LANES_MAX {
        let is_there = at.lane == target.at.lane;
        if is_there && target.beyond == 0 {
            return true;
        }
        add_mark(network, at, is_left, path);
        let Some(next) = neighbour(network, at, is_left) else {
            let side = if is_left { 1 } else { -1 };
            return is_there && target.beyond == side;
        };
        // Beyond the middle of the road the lanes look the other way.
        if network.lane(next.lane).forward != network.lane(at.lane).forward {
            is_left = !is_left;
        }
        at = next;
    }
    false
}

/// Notes what is painted on one border of a lane.
fn add_mark(network: &Network, at: LanePoint, is_left: bool, path: &mut Vec<LaneInvasionReading>) {
    let marks = network.marks(at);
    let Some(mark) = (if is_left { marks.left } else { marks.right }) else { return };
    if mark.kind == MarkKind::None {
        return;
    }
    path.push(LaneInvasionReading {
        kind: mark.kind as u32,
        color: mark.color as u32,
        change: mark.change as u32,
        width_m: mark.width_m as f32,
        corner: 0,
        to_left: is_left.into(),
        from_lane: at.lane.0,
        from_lane_id: network.lane(at.lane).id,
    });
}
