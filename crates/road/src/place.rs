//! From lane coordinates to poses.

use glam::DVec3;

use crate::{
    axes::{RoadAxes, Station},
    cubic::Jet,
    lane::{Lane, LaneIndex, LanePoint},
    network::Network,
    placement::Placement,
    road::{Road, Section},
};

/// A path beside a reference line: signed lateral distance, and how much of it stays level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lateral {
    pub(crate) t: Jet,
    pub(crate) level: Jet,
    /// Whether the surface at the path does not bank.
    pub(crate) flat: bool,
    /// Height of the surface above the road's, metres.
    pub(crate) rise_m: f64,
}

impl Network {
    /// Returns the pose `offset_left_m` to the left of the lane's centre as the file describes the
    /// lane, whatever other roads of its junction say; and the height of the lane's surface above
    /// the road's there, metres.
    pub(crate) fn lane_pose(
        &self,
        lane: LaneIndex,
        along_m: f64,
        offset_left_m: f64,
    ) -> (Placement, f64) {
        let lane = self.lane(lane);
        let road = &self.roads()[lane.road as usize];
        let s = self.s_of(lane, along_m);
        let offset_t = if lane.forward { offset_left_m } else { -offset_left_m };
        let lateral = self.lateral(road, lane, s, offset_t);
        let station = road.station(s);
        let pose = road.pose(&station, s, &lateral);
        (if lane.forward { pose } else { pose.reversed() }, lateral.rise_m)
    }

    /// Returns the lane's width in metres.
    pub fn width(&self, at: LanePoint) -> f64 {
        let lane = self.lane(at.lane);
        let borders = self.borders(lane, self.s_of(lane, at.along_m));
        borders.outer.value - borders.inner.value
    }

    /// Computes the centres of all lanes of a section at `s`, from left to right, with half their
    /// widths.
    pub(crate) fn centres(
        &self,
        road: &Road,
        section: &Section,
        axes: &RoadAxes,
        s: f64,
        centres: &mut Vec<(DVec3, f64)>,
    ) {
        centres.clear();
        let offset = section.lane_offset(road, s).value;
        let ds = s - section.start_m;
        centres.resize(section.lanes.len(), (DVec3::ZERO, 0.0));
        let (left, right) = (0..section.left, section.left..section.lanes.len());
        let mut side = |places: &mut dyn Iterator<Item = usize>, sign: f64| {
            let (mut inner, mut level) = (0.0, 0.0);
            for place in places {
                let lane = self.lane(section.lanes[place]);
                let width = lane.width_from(inner, ds);
                let t = offset + sign * (inner + 0.5 * width);
                let level_t = sign * (level + if lane.level { 0.5 * width } else { 0.0 });
                let up = road.unevenness(s, t) + lane.rise_at_centre(ds);
                centres[place] = (axes.point(t, level_t, up), 0.5 * width);
                inner += width;
                level += if lane.level { width } else { 0.0 };
            }
        };
        side(&mut left.rev(), 1.0);
        side(&mut right.into_iter(), -1.0);
    }

    /// Returns the path at the lane's centre plus `offset_t`.
    pub(crate) fn lateral(&self, road: &Road, lane: &Lane, s: f64, offset_t: f64) -> Lateral {
        let borders = self.borders(lane, s);
        let sign = lane.sign();
        let middle = (borders.inner + borders.outer).scaled(0.5 * sign);
        let section = &road.sections[lane.section as usize];
        let centre = section.lane_offset(road, s);
        let t = centre + middle + Jet::constant(offset_t);
        let mut level = borders.level.scaled(sign);
        if lane.level {
            level = level + t + (centre + borders.inner.scaled(sign)).scaled(-1.0);
        }
        let ds = s - section.start_m;
        let (inner, outer) = lane.rise(ds);
        let width = borders.outer.value - borders.inner.value;
        let share = if width > 1e-6 { 0.5 + sign * offset_t / width } else { 0.5 };
        let rise_m = inner + (outer - inner) * share.clamp(0.0, 1.0);
        Lateral { t, level, flat: lane.level, rise_m }
    }
}

impl Road {
    /// Returns the pose of a path at `lateral`, along rising s.
    pub(crate) fn pose(&self, station: &Station, s: f64, lateral: &Lateral) -> Placement {
        let axes = RoadAxes::new(*station);
        let (sin, cos) = (axes.roll_sin, axes.roll_cos);
        let roll = station.roll;
        let banked = lateral.t + lateral.level.scaled(-1.0);
        let tilt_slope = banked.slope * sin + banked.value * cos * roll.slope;
        let shove = banked.value * sin * axes.pitch_sin;
        // Horizontal distance of the path from the reference line, with its derivatives.
        let beside = Jet {
            value: banked.value * cos + lateral.level.value,
            slope: banked.slope * cos - banked.value * sin * roll.slope + lateral.level.slope,
            bend: banked.bend * cos + lateral.level.bend,
        };
        let along = 1.0 - station.curvature * beside.value + tilt_slope * axes.pitch_sin;
        let climb = station.elevation.slope + tilt_slope * axes.pitch_cos;
        let aside = beside.slope + station.curvature * shove;
        let uneven = self.unevenness(s, lateral.t.value);
        let position = axes.point(lateral.t.value, lateral.level.value, uneven + lateral.rise_m);
        // Inside the centre of a bend's circle the path runs backwards; the lane does not.
        let along = along.max(1e-3);
        let planar = along.hypot(aside);
        let pitch_rad = -(climb / planar).atan();
        let side_slope = if lateral.flat { 0.0 } else { sin + self.side_slope(s, lateral) };
        let bend = along * (station.curvature * along + beside.bend)
            + beside.slope
                * (station.curvature_slope * beside.value + 2.0 * station.curvature * beside.slope);
        Placement {
            position,
            heading_rad: station.heading_rad + aside.atan2(along),
            pitch_rad,
            roll_rad: side_slope.clamp(-1.0, 1.0).asin(),
            curvature_per_m: bend / planar.powi(3),
        }
    }

    /// Returns the slope that crossfall and shapes add to the banking.
    fn side_slope(&self, s: f64, lateral: &Lateral) -> f64 {
        if self.is_even() {
            return 0.0;
        }
        let t = lateral.t.value;
        (self.unevenness(s, t + 0.01) - self.unevenness(s, t - 0.01)) / 0.02
    }
}
