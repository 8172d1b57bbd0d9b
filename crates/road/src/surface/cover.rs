//! What other roads do where a road lies.

use glam::DVec3;

use super::paved::PAVED;
use crate::{axes::RoadAxes, grid::Segment, junction::JunctionKind, lane::Lane, network::Network};

/// Roads farther apart in height than this cross on a bridge.
const STOREY_M: f64 = 0.6;
/// And those that are nearer than this do not, whatever bends there are between.
const SURE_M: f64 = 0.4;
/// A surface that reaches less far than this into another only touches it.
const TOUCH_M: f64 = 0.02;
/// A lane wider than twice this is not looked for.
const WIDEST_M: f64 = 8.0;

pub(super) struct Cover<'a> {
    network: &'a Network,
    road: u32,
}

impl<'a> Cover<'a> {
    pub(super) fn new(network: &'a Network, road: u32) -> Cover<'a> {
        Cover { network, road }
    }

    /// What may lie within `reach` of `point`.
    pub(super) fn near(&self, point: DVec3, reach: f64) -> Near<'a> {
        let mut pieces = Vec::new();
        self.network.grid.near(point.truncate(), reach + WIDEST_M, |piece| {
            let offset = point.truncate() - piece.from.truncate().midpoint(piece.to.truncate());
            let length = piece.from.distance(piece.to);
            let farthest = reach + f64::from(piece.outside_m) + 0.6 * length;
            if piece.types & PAVED.0 != 0
                && offset.length_squared() < farthest * farthest
                && self.network.lanes()[piece.lane as usize].road != self.road
                && !pieces
                    .iter()
                    .any(|other: &Segment| other.lane == piece.lane && other.along == piece.along)
            {
                pieces.push(*piece);
            }
        });
        Near { network: self.network, pieces }
    }

    /// Whether `point` lies on a paved lane of another road.
    pub(super) fn paved(&self, point: DVec3) -> bool {
        self.near(point, 0.0).paved(point)
    }
}

/// Paved lanes of other roads round a place.
pub(super) struct Near<'a> {
    network: &'a Network,
    pieces: Vec<Segment>,
}

impl Near<'_> {
    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Whether `point` lies on one of them.
    pub(super) fn paved(&self, point: DVec3) -> bool {
        self.pieces.iter().any(|piece| {
            let Some(pass) = abreast(self.network, piece, point) else { return false };
            if pass.beside_m > f64::from(piece.outside_m) {
                return false;
            }
            let surely = (0.0..=1.0).contains(&pass.share)
                && pass.beside_m < f64::from(piece.inside_m)
                && (point.z - piece.from.lerp(piece.to, pass.share).z).abs() < SURE_M;
            let lane = &self.network.lanes()[piece.lane as usize];
            surely || on_lane(self.network, lane, pass.s, point)
        })
    }
}

/// How a piece of the index passes a point.
struct Pass {
    s: f64,
    /// Of the piece's length.
    share: f64,
    beside_m: f64,
}

/// Where a piece of the index passes `point`, if it does so.
fn abreast(network: &Network, piece: &Segment, point: DVec3) -> Option<Pass> {
    let along = (piece.to - piece.from).truncate();
    let length = along.length_squared();
    if length <= 0.0 {
        return None;
    }
    let offset = (point - piece.from).truncate();
    let share = offset.dot(along) / length;
    // Beside a bend the pieces' sectors gape; a little overlap closes them.
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

fn on_lane(network: &Network, lane: &Lane, s: f64, point: DVec3) -> bool {
    let road = &network.roads()[lane.road as usize];
    let section = &road.sections[lane.section as usize];
    if s < section.start_m || s > section.start_m + section.length_m {
        return false;
    }
    let axes = RoadAxes::new(road.station(s));
    let borders = network.borders(lane, s);
    let half = 0.5 * (borders.outer.value - borders.inner.value);
    let t = section.lane_offset(road, s).value + lane.sign() * (borders.inner.value + half);
    let middle = axes.point(t, 0.0, 0.0);
    let away = axes.ahead().truncate().perp_dot((point - middle).truncate());
    away.abs() < half - TOUCH_M && (point.z - middle.z).abs() < STOREY_M
}

/// One height for every place of a junction, where the file gives its roads different ones: each
/// road counts the more the farther inside it the place lies. At a road's side its weight is
/// nothing, so the surfaces of all roads coincide, and none has a step where another begins.
pub(super) struct Blend<'a> {
    network: &'a Network,
    junction: u32,
}

/// A road counts in full this far from its rim.
const RIM_M: f64 = 2.0;
/// Heights that differ less than this need no blending.
const LEVEL_M: f64 = 0.004;

impl<'a> Blend<'a> {
    /// The blend of each junction that needs one.
    pub(super) fn of_junctions(network: &'a Network) -> Vec<Option<Blend<'a>>> {
        let of_junction = |(junction, index): (&crate::Junction, u32)| {
            let blend = Blend { network, junction: index };
            let needed =
                junction.kind == JunctionKind::Common && blend.contradicts(&junction.roads);
            needed.then_some(blend)
        };
        network.junctions().iter().zip(0..).map(of_junction).collect()
    }

    /// Whether roads of the junction lie over each other at different heights.
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
            PAVED.contains(lane.kind)
                && (0..=steps).any(|step| {
                    let along_m = lane.length_m * step as f64 / steps as f64;
                    let point = self.network.place_at(lane.index, along_m, 0.0).position;
                    (self.height(point) - point.z).abs() > LEVEL_M
                })
        })
    }

    /// The height of the junction's surface at a point of one of its roads.
    pub(super) fn height(&self, point: DVec3) -> f64 {
        // Where each road passes, by its piece that comes nearest.
        let mut passes: Vec<(u32, f64, f64)> = Vec::new();
        self.network.grid.near(point.truncate(), WIDEST_M, |piece| {
            let lane = &self.network.lanes()[piece.lane as usize];
            if lane.junction != Some(self.junction) {
                return;
            }
            let Some(Pass { s, beside_m, .. }) = abreast(self.network, piece, point) else {
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
        // The index visits in its own order; sums must not depend on it.
        passes.sort_by_key(|pass| pass.0);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (road, s, _) in passes {
            let Some((height, inside_m, to_end_m)) = self.pass(road, s, point) else { continue };
            let beside = (inside_m.max(0.0) / RIM_M).min(1.0) + 1e-6;
            // Where a road ends it meets one outside the junction, and no other road may move it.
            let weight = beside * (RIM_M / to_end_m.max(1e-6)).max(1.0);
            sum += weight * height;
            weights += weight;
        }
        if weights > 0.0 { sum / weights } else { point.z }
    }

    /// The height of a road at `point`, which it passes at about `s`, and how far the point lies
    /// from its paved sides and from its ends. None if the point does not lie on it.
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
            if PAVED.contains(lane.kind) {
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
