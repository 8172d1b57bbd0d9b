//! Whether a point of one road lies on the lanes of another.

use super::columns::PAVED;
use crate::network::Network;
use crate::place::Frame;
use glam::DVec3;

/// Roads farther apart in height than this cross on a bridge.
const STOREY_M: f64 = 0.6;
/// A surface that reaches less far than this into another only touches it.
const TOUCH_M: f64 = 0.02;

pub(super) struct Cover<'a> {
    network: &'a Network,
    road: u32,
}

impl<'a> Cover<'a> {
    pub(super) fn new(network: &'a Network, road: u32) -> Cover<'a> {
        Cover { network, road }
    }

    /// Whether `point` lies on a paved lane of another road.
    pub(super) fn paved(&self, point: DVec3) -> bool {
        let mut found = false;
        self.network.grid.near(point.truncate(), |piece| {
            if found || piece.types & PAVED.0 == 0 {
                return;
            }
            let lane = &self.network.lanes()[piece.lane as usize];
            if lane.road == self.road {
                return;
            }
            let along = (piece.to - piece.from).truncate();
            let length = along.length_squared();
            if length <= 0.0 {
                return;
            }
            let offset = (point - piece.from).truncate();
            let share = offset.dot(along) / length;
            if !(0.0..=1.0).contains(&share) {
                return;
            }
            let beside = along.perp_dot(offset) / length.sqrt();
            if beside.abs() > WIDEST_M {
                return;
            }
            let from_s = f64::from(piece.from_s);
            let s = from_s + share * (f64::from(piece.to_s) - from_s);
            let road = &self.network.roads()[lane.road as usize];
            let frame = Frame::new(road.station(s));
            let lateral = self.network.lateral(road, lane, s, 0.0);
            let middle = frame.point(lateral.t.value, lateral.level.value, 0.0);
            let borders = self.network.borders(lane, s);
            let half = 0.5 * (borders.outer.value - borders.inner.value);
            let away = frame.ahead().truncate().perp_dot((point - middle).truncate());
            found = away.abs() < half - TOUCH_M && (point.z - middle.z).abs() < STOREY_M;
        });
        found
    }
}

const WIDEST_M: f64 = 12.0;
