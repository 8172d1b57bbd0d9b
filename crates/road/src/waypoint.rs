//! Queries about a waypoint: its id, the markings beside it, the rest of its lane.

use crate::{
    lane::{Lane, LanePoint, LaneTypes},
    mark::{RoadMark, mark_at},
    network::Network,
};

/// The markings on either side of a point in driving direction; `None` where the file does not
/// describe that border.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SideMarks<'a> {
    /// On the border to the left.
    pub left: Option<&'a RoadMark>,
    /// On the border to the right.
    pub right: Option<&'a RoadMark>,
    /// Whether the left one may be crossed from here, whatever lies beyond it.
    pub left_change: bool,
    /// Whether the right one may be crossed from here, whatever lies beyond it.
    pub right_change: bool,
}

impl Network {
    /// Returns points on all lanes of `types`, every `every_m` metres of each road's s from its
    /// start: CARLA's `generate_waypoints`. Sorted by road, s, section and falling lane id.
    pub fn waypoints(&self, every_m: f64, types: LaneTypes) -> Vec<LanePoint> {
        let mut points = Vec::new();
        if !(every_m.is_finite() && every_m > 0.0) {
            return points;
        }
        let every_m = every_m.max(self.total_m() / WAYPOINTS_MAX);
        for road in self.roads() {
            // CARLA's own summation, so that rounding decides the same way where a step meets a
            // road's end.
            let mut s = FIRST_M;
            while s < road.length_m - FIRST_M {
                // Sections without length begin where the next one does.
                let upto = &road.sections[..=road.section_at(s)];
                let start_m = upto.last().map_or(0.0, |section| section.start_m);
                let first = upto.partition_point(|section| section.start_m < start_m);
                for section in &upto[first..] {
                    for lane in section.lanes.iter().map(|lane| self.lane(*lane)) {
                        if types.contains(lane.kind) {
                            points.push(self.point_at_s(lane, s));
                        }
                    }
                }
                s += every_m;
            }
        }
        points
    }

    /// Returns the markings beside a point.
    pub fn marks(&self, at: LanePoint) -> SideMarks<'_> {
        let lane = self.lane(at.lane);
        let section = &self.roads()[lane.road as usize].sections[lane.section as usize];
        let ds = self.s_of(lane, at.along_m) - section.start_m;
        let inner_id = lane.id - lane.id.signum();
        let inner_lane =
            section.lanes.iter().map(|lane| self.lane(*lane)).find(|l| l.id == inner_id);
        let inner = match inner_lane {
            Some(inner) => mark_at(&inner.marks, ds),
            None if inner_id == 0 => mark_at(&section.marks, ds),
            None => None,
        };
        let outer = mark_at(&lane.marks, ds);
        let beyond = if inner_id == 0 { -lane.id } else { inner_id };
        let inner_change = inner.is_none_or(|mark| mark.allows(lane.id, beyond));
        let outer_change =
            outer.is_none_or(|mark| mark.allows(lane.id, lane.id + lane.id.signum()));
        if lane.outer_is_right() {
            SideMarks {
                left: inner,
                right: outer,
                left_change: inner_change,
                right_change: outer_change,
            }
        } else {
            SideMarks {
                left: outer,
                right: inner,
                left_change: outer_change,
                right_change: inner_change,
            }
        }
    }

    /// Returns the speed limit at a point: its lane's own or its road's. Metres per second.
    pub fn speed_limit(&self, at: LanePoint) -> Option<f64> {
        let lane = self.lane(at.lane);
        let road = &self.roads()[lane.road as usize];
        let s = self.s_of(lane, at.along_m);
        let own = lane.speed_limit_at(s - road.sections[lane.section as usize].start_m);
        own.or_else(|| road.type_at(s).and_then(|kind| kind.limit_mps))
    }

    /// Returns the points every `every_m` metres ahead as long as there is one branch and it stays
    /// on the road, and its last point: CARLA's `next_until_lane_end`.
    pub fn advance_to_end(&self, at: LanePoint, every_m: f64) -> Vec<LanePoint> {
        self.along_road(at, every_m, true)
    }

    /// Returns the points every `every_m` metres behind as long as there is one branch and it stays
    /// on the road, and its first point: CARLA's `previous_until_lane_start`.
    pub fn retreat_to_start(&self, at: LanePoint, every_m: f64) -> Vec<LanePoint> {
        self.along_road(at, every_m, false)
    }

    fn along_road(&self, at: LanePoint, every_m: f64, ahead: bool) -> Vec<LanePoint> {
        let mut points = Vec::new();
        if !(every_m.is_finite() && every_m > 0.0) {
            return points;
        }
        let every_m = every_m.max(self.total_m() / WAYPOINTS_MAX);
        let road = self.lane(at.lane).road;
        let mut here = at;
        // Each lane of the road is passed at most once.
        let mut most = self.roads()[road as usize].length_m / every_m + 1.0;
        while most >= 0.0 {
            let found =
                if ahead { self.advance(here, every_m) } else { self.retreat(here, every_m) };
            let [next] = found.as_slice() else { break };
            if self.lane(next.lane).road != road {
                break;
            }
            here = *next;
            points.push(here);
            most -= 1.0;
        }
        let end = self.end_on_road(here, ahead);
        if points.last().is_none_or(|last| *last != end) {
            points.push(end);
        }
        points
    }

    /// Returns where the lanes from here leave the road or first fork.
    fn end_on_road(&self, from: LanePoint, ahead: bool) -> LanePoint {
        let mut lane = self.lane(from.lane);
        for _ in 0..self.roads()[lane.road as usize].sections.len() {
            let on = if ahead { &lane.successors } else { &lane.predecessors };
            let [next] = on.as_slice() else { break };
            let next = self.lane(*next);
            if next.road != lane.road || next.section == lane.section {
                break;
            }
            lane = next;
        }
        LanePoint { lane: lane.index, along_m: if ahead { lane.length_m } else { 0.0 } }
    }

    /// Returns CARLA's id of a waypoint, the same within half a centimetre of s: its hash of road,
    /// section, lane and s. Roads whose id is not a number count by their index in the file.
    pub fn waypoint_id(&self, at: LanePoint) -> u64 {
        let (road, section, lane, s) = self.road_space(at);
        let road = road.id.parse::<u32>().unwrap_or_else(|_| self.lane(at.lane).road);
        let half_centimetres = (s * 200.0 + 1e-7).floor() as f32;
        let parts = [
            u64::from(road),
            section as u64,
            i64::from(lane) as u64,
            u64::from(half_centimetres.to_bits()),
        ];
        parts
            .into_iter()
            .fold(0, |seed: u64, part| hash_mix(seed.wrapping_add(0x9e37_79b9).wrapping_add(part)))
    }

    /// Returns the total length of all roads, metres of s.
    fn total_m(&self) -> f64 {
        self.roads().iter().map(|road| road.length_m).sum()
    }
}

/// Upper bound of waypoints on one map; a smaller spacing is increased.
const WAYPOINTS_MAX: f64 = 2e7;
/// Distance of CARLA's first waypoint from a road's start, metres.
const FIRST_M: f64 = 10.0 * f64::EPSILON;

/// `boost::hash_detail::hash_mix` of Boost 1.81 and later.
fn hash_mix(mut x: u64) -> u64 {
    const FACTOR: u64 = 0x0e98_46af_9b1a_615d;
    x ^= x >> 32;
    x = x.wrapping_mul(FACTOR);
    x ^= x >> 32;
    x = x.wrapping_mul(FACTOR);
    x ^ (x >> 28)
}

impl Lane {
    /// Returns whether the border away from the reference line lies to the right in driving
    /// direction.
    fn outer_is_right(&self) -> bool {
        self.forward == (self.id < 0)
    }
}
