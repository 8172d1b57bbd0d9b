//! Lane invasions: the markings that a carrier's corners crossed.
//!
//! The position of a corner is a lane, from the nearest lane centre and the widths of its
//! neighbours, or the area beyond the outermost lane. Two positions in one section differ by the
//! borders between them, and the marks on these borders are the crossings. In junctions lanes
//! overlap: there are no crossings, as in CARLA.

use glam::{DVec3, Vec3};
use protocol::{ActorState, LaneInvasionReading, flag};
use road::{Lane, LanePoint, LaneTypes, MarkKind, Network};

/// Largest plausible movement of a corner in one frame.
const LEAP_M: f64 = 10.0;
/// Most lanes that a corner passes in one frame.
const LANES_MAX: usize = 8;

/// The four corners of a carrier in the previous frame.
#[derive(Default)]
pub(super) struct Corners {
    before: Option<[DVec3; 4]>,
}

impl Corners {
    /// Sets the new state of the carrier and returns the crossings since the previous one.
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

/// Returns the corners of the box on the ground: front left, front right, rear left, rear right.
fn corners_of(carrier: &ActorState) -> [DVec3; 4] {
    let blueprint = &town::catalogue()[carrier.blueprint as usize];
    let (half, middle) = (blueprint.half_extents_m, blueprint.center_m);
    let place = carrier.pose.affine();
    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(ahead, left)| {
        let corner = Vec3::new(middle.x + ahead * half.x, middle.y + left * half.y, 0.0);
        place.transform_point3(corner).as_dvec3()
    })
}

/// The position of a corner: in a lane, or beyond the outermost one on a side of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    at: LanePoint,
    /// 1: to the left of the outermost lane; −1: to the right of it; 0: in the lane.
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
    // If the section has just changed, its lanes are extended back to the previous position.
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

/// Returns the distance to the left of a lane's centre. Metres.
fn left_of(network: &Network, at: LanePoint, place: DVec3) -> f64 {
    let centre = network.place(at);
    (centre.rotation().inverse() * (place - centre.position)).y
}

/// Returns the spot of a position near a lane.
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

/// Returns the neighbouring lane at the same s.
fn neighbour(network: &Network, at: LanePoint, is_left: bool) -> Option<LanePoint> {
    let lane = network.lane(at.lane);
    let next = network.lane(if is_left { lane.left? } else { lane.right? });
    let ds = if lane.forward { at.along_m } else { lane.length_m - at.along_m };
    let along_m = if next.forward { ds } else { next.length_m - ds };
    Some(LanePoint { lane: next.index, along_m: along_m.clamp(0.0, next.length_m) })
}

/// Walks from spot to spot over the borders on one side. Returns whether the target was reached.
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
        // A corner from beyond the outermost lane crosses its border.
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
        // Beyond the middle of the road the lanes have the opposite direction.
        if network.lane(next.lane).forward != network.lane(at.lane).forward {
            is_left = !is_left;
        }
        at = next;
    }
    false
}

/// Appends the mark on one border of a lane.
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
