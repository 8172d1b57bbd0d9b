//! One height for every place of a junction whose roads contradict each other.

use glam::DVec3;

use crate::{
    axes::RoadAxes,
    grid::Segment,
    junction::JunctionKind,
    lane::{LaneIndex, LanePoint, LaneTypes},
    network::Network,
    placement::Placement,
};

/// Roads farther apart in height than this cross on a bridge, metres.
pub(crate) const STOREY_M: f64 = 0.6;
/// Half the width of the widest lane that is considered, metres.
pub(crate) const WIDEST_M: f64 = 8.0;

/// How a piece of the index passes a point.
pub(crate) struct Pass {
    pub(crate) s: f64,
    /// Fraction of the piece's length.
    pub(crate) share: f64,
    pub(crate) beside_m: f64,
}

/// Returns how a piece of the index passes `point`; `None` if the point lies beyond its ends.
pub(crate) fn pass_of(network: &Network, piece: &Segment, point: DVec3) -> Option<Pass> {
    let along = (piece.to - piece.from).truncate();
    let length = along.length_squared();
    if length <= 0.0 {
        return None;
    }
    let offset = (point - piece.from).truncate();
    let share = offset.dot(along) / length;
    // On the outside of a bend the sectors of the pieces leave gaps; a small overlap closes them.
    let overlap = (0.6 / length.sqrt()).min(0.1);
    if !(-overlap..=1.0 + overlap).contains(&share) {
        return None;
    }
    let beside_m = along.perp_dot(offset).abs() / length.sqrt();
    if beside_m > WIDEST_M {
        return None;
    }
    let lane = &network.lanes()[piece.lane as usize];
    let [from_s, to_s] = piece.along.map(|along_m| network.s_of(lane, along_m));
    Some(Pass { s: from_s + share * (to_s - from_s), share, beside_m })
}

/// One height for every place of a junction whose file gives its roads different ones.
///
/// Each road has a weight that grows with the distance of the place from the road's side. At the
/// side it is zero, so the surfaces of all roads coincide, and none has a step where another
/// begins. Surface and centre lines both take their heights from here.
pub(crate) struct Blend<'a> {
    network: &'a Network,
    junction: u32,
}

/// A road has its full weight this far from its side, metres.
const RIM_M: f64 = 2.0;
/// Heights that differ less than this need no blending.
const LEVEL_M: f64 = 0.004;

impl Network {
    /// Returns the pose of the lane's centre, x along the driving direction.
    ///
    /// The position lies on the surface: where roads of a junction contradict each other in
    /// height, it is the height that [`crate::surface_mesh`] has there. The angles are those of
    /// the lane as the file describes it.
    pub fn place(&self, at: LanePoint) -> Placement {
        self.place_at(at.lane, at.along_m, 0.0)
    }

    /// Returns the pose `offset_left_m` to the left of the lane's centre, seen in driving
    /// direction; see [`Network::place`].
    pub fn place_at(&self, lane: LaneIndex, along_m: f64, offset_left_m: f64) -> Placement {
        let (mut pose, rise_m) = self.lane_pose(lane, along_m, offset_left_m);
        if let Some(blend) = self.lane(lane).junction.and_then(|index| Blend::new(self, index)) {
            pose.position.z = blend.height(pose.position - DVec3::Z * rise_m) + rise_m;
        }
        pose
    }
}

impl<'a> Blend<'a> {
    /// Returns the blend of a junction; `None` if its roads do not contradict each other.
    pub(crate) fn new(network: &'a Network, junction: u32) -> Option<Blend<'a>> {
        let of_junction = &network.junctions()[junction as usize];
        if of_junction.kind != JunctionKind::Common {
            return None;
        }
        let blend = Blend { network, junction };
        let count = network.junctions().len();
        let find = || blend.contradicts(&of_junction.roads);
        network.contradictions.get(junction, count, find).then_some(blend)
    }

    /// Returns the blend of each junction that needs one.
    pub(crate) fn of_junctions(network: &'a Network) -> Vec<Option<Blend<'a>>> {
        (0..network.junctions().len() as u32).map(|index| Blend::new(network, index)).collect()
    }

    /// Returns whether roads of the junction overlap at different heights.
    fn contradicts(&self, roads: &[u32]) -> bool {
        let level = |road: &u32| {
            let road = &self.network.roads()[*road as usize];
            road.elevation.is_zero() && road.superelevation.is_zero()
        };
        if roads.iter().all(level) {
            return false;
        }
        let lanes = roads.iter().flat_map(|road| &self.network.roads()[*road as usize].sections);
        lanes.flat_map(|section| &section.lanes).any(|lane| {
            let lane = self.network.lane(*lane);
            let steps = (lane.length_m / 3.0).ceil().clamp(1.0, 1000.0) as usize;
            LaneTypes::PAVED.contains(lane.kind)
                && (0..=steps).any(|step| {
                    let along_m = lane.length_m * step as f64 / steps as f64;
                    let point = self.network.lane_pose(lane.index, along_m, 0.0).0.position;
                    (self.height(point) - point.z).abs() > LEVEL_M
                })
        })
    }

    /// Returns the height of the junction's surface at a point of one of its roads.
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        // For each road its nearest piece.
        let mut passes: Vec<(u32, f64, f64)> = Vec::new();
        self.network.grid.near(point.truncate(), WIDEST_M, |piece| {
            let lane = &self.network.lanes()[piece.lane as usize];
            if lane.junction != Some(self.junction) {
                return;
            }
            let Some(Pass { s, beside_m, .. }) = pass_of(self.network, piece, point) else {
                return;
            };
            if beside_m > f64::from(piece.outside_m) {
                return;
            }
            let away = point.distance_squared(piece.from.midpoint(piece.to));
            match passes.iter_mut().find(|pass| pass.0 == lane.road) {
                Some(pass) if pass.2 <= away => {}
                Some(pass) => *pass = (lane.road, s, away),
                None => passes.push((lane.road, s, away)),
            }
        });
        // The index visits pieces in its own order; sums must not depend on it.
        passes.sort_by_key(|pass| pass.0);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (road, s, _) in passes {
            let Some((height, inside_m, to_end_m)) = self.pass(road, s, point) else { continue };
            let beside = (inside_m.max(0.0) / RIM_M).min(1.0) + 1e-6;
            // At its end a road meets one outside the junction, so no other road may shift its
            // height.
            let weight = beside * (RIM_M / to_end_m.max(1e-6)).max(1.0);
            sum += weight * height;
            weights += weight;
        }
        if weights > 0.0 { sum / weights } else { point.z }
    }

    /// Returns the height at `point` of a road that passes it at about `s`, and the distances of
    /// the point from the road's paved sides and from its ends. `None` if the point does not lie on
    /// the road.
    fn pass(&self, road: u32, s: f64, point: DVec3) -> Option<(f64, f64, f64)> {
        let road = &self.network.roads()[road as usize];
        let mut s = s.clamp(0.0, road.length_m);
        let mut axes = RoadAxes::new(road.station(s));
        for _ in 0..2 {
            let origin = axes.point(0.0, 0.0, 0.0);
            let ahead = axes.ahead().dot(point - origin);
            let next = (s + ahead / axes.stretch(axes.left().dot(point - origin)))
                .clamp(0.0, road.length_m);
            if (next - s).abs() < 1e-3 {
                break;
            }
            s = next;
            axes = RoadAxes::new(road.station(s));
        }
        let offset = point - axes.point(0.0, 0.0, 0.0);
        if axes.ahead().dot(offset).abs() > 0.02 {
            return None;
        }
        let t = axes.left().dot(offset);
        let section = &road.sections[road.section_at(s)];
        let centre = section.lane_offset(road, s).value;
        let (mut left, mut right) = (f64::NEG_INFINITY, f64::INFINITY);
        for (position, lane) in section.lanes.iter().enumerate() {
            let lane = self.network.lane(*lane);
            if LaneTypes::PAVED.contains(lane.kind) {
                let borders = section.borders(self.network.lanes(), position, s - section.start_m);
                let ends = [borders.inner, borders.outer].map(|b| centre + lane.sign() * b.value);
                left = left.max(ends[0]).max(ends[1]);
                right = right.min(ends[0]).min(ends[1]);
            }
        }
        let inside_m = (left - t).min(t - right);
        let height = axes.point(t, 0.0, 0.0).z;
        if inside_m < -1e-3 || (height - point.z).abs() > STOREY_M {
            return None;
        }
        Some((height, inside_m, s.min(road.length_m - s)))
    }
}
