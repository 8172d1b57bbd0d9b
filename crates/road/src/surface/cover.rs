//! Overlaps of roads: where another road covers a place.

use glam::DVec3;

use crate::{
    axes::RoadAxes,
    blend::{STOREY_M, WIDEST_M, pass_of},
    grid::Segment,
    lane::{Lane, LaneTypes},
    network::Network,
};

/// Roads nearer in height than this do not cross on a bridge, whatever bends lie between. Metres.
const SURE_M: f64 = 0.4;
/// A surface that reaches less far than this into another only touches it, metres.
const TOUCH_M: f64 = 0.02;

pub(super) struct Cover<'a> {
    network: &'a Network,
    road: u32,
}

impl<'a> Cover<'a> {
    pub(super) fn new(network: &'a Network, road: u32) -> Cover<'a> {
        Cover { network, road }
    }

    /// Returns the pieces of other roads within `reach` of `point`.
    pub(super) fn near(&self, point: DVec3, reach: f64) -> Near<'a> {
        let mut pieces = Vec::new();
        self.network.grid.near(point.truncate(), reach + WIDEST_M, |piece| {
            let offset = point.truncate() - piece.from.truncate().midpoint(piece.to.truncate());
            let length = piece.from.distance(piece.to);
            let farthest = reach + f64::from(piece.outside_m) + 0.6 * length;
            if piece.types & LaneTypes::PAVED.0 != 0
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

    /// Returns whether `point` lies on a paved lane of another road.
    pub(super) fn paved(&self, point: DVec3) -> bool {
        self.near(point, 0.0).paved(point)
    }
}

/// Paved lanes of other roads near a place.
pub(super) struct Near<'a> {
    network: &'a Network,
    pieces: Vec<Segment>,
}

impl Near<'_> {
    /// Returns whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Returns whether `point` lies on one of them.
    pub(super) fn paved(&self, point: DVec3) -> bool {
        self.pieces.iter().any(|piece| {
            let Some(pass) = pass_of(self.network, piece, point) else { return false };
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
