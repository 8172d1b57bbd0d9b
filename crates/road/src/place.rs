//! From lane coordinates to poses.

use crate::cubic::Jet;
use crate::lane::{Lane, LaneIndex, LanePoint};
use crate::network::Network;
use crate::road::{Borders, Road, Section, Station};
use glam::{DQuat, DVec2, DVec3, EulerRot, Vec3};

/// A pose on the road. World space: right-handed, z up, metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Where.
    pub position: DVec3,
    /// About z, from x towards y.
    pub heading_rad: f64,
    /// About the left-pointing y: positive looks down.
    pub pitch_rad: f64,
    /// About the forward-pointing x: positive lifts the left side.
    pub roll_rad: f64,
    /// Of the path in driving direction, seen from above; positive turns left.
    pub curvature_per_m: f64,
}

impl Placement {
    /// `world_from_lane`: x along the lane, y to its left, z up from its surface.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_euler(EulerRot::ZYX, self.heading_rad, self.pitch_rad, self.roll_rad)
    }

    /// The point `forward`, `left` and `up` of here.
    pub fn point(&self, forward: f64, left: f64, up: f64) -> DVec3 {
        self.position + self.rotation() * DVec3::new(forward, left, up)
    }
}

/// A path beside a reference line: signed lateral distance, and how much of it stays level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lateral {
    pub(crate) t: Jet,
    pub(crate) level: Jet,
    /// The surface at the path does not bank.
    pub(crate) flat: bool,
    /// How far the surface stands above the road's.
    pub(crate) rise_m: f64,
}

impl Network {
    /// The pose of the lane's centre, x along the driving direction.
    pub fn place(&self, at: LanePoint) -> Placement {
        self.place_at(at.lane, at.along_m, 0.0)
    }

    /// The pose `offset_left_m` to the left of the lane's centre, seen in driving direction.
    pub fn place_at(&self, lane: LaneIndex, along_m: f64, offset_left_m: f64) -> Placement {
        let lane = self.lane(lane);
        let road = &self.roads()[lane.road as usize];
        let s = self.s_of(lane, along_m);
        let offset_t = if lane.forward { offset_left_m } else { -offset_left_m };
        let lateral = self.lateral(road, lane, s, offset_t);
        let station = road.station(s);
        let pose = road.pose(&station, s, &lateral);
        if lane.forward { pose } else { pose.reversed() }
    }

    /// The lane's width in metres.
    pub fn width(&self, at: LanePoint) -> f64 {
        let lane = self.lane(at.lane);
        let borders = self.borders(lane, self.s_of(lane, at.along_m));
        borders.outer.value - borders.inner.value
    }

    /// The centres of all lanes of a section at `s`, from left to right, with half their widths.
    pub(crate) fn centres(
        &self,
        road: &Road,
        section: &Section,
        frame: &Frame,
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
                let width = lane.reach(inner, ds);
                let t = offset + sign * (inner + 0.5 * width);
                let level_t = sign * (level + if lane.level { 0.5 * width } else { 0.0 });
                let up = road.unevenness(s, t) + lane.rise_at_centre(ds);
                centres[place] = (frame.point(t, level_t, up), 0.5 * width);
                inner += width;
                level += if lane.level { width } else { 0.0 };
            }
        };
        side(&mut left.rev(), 1.0);
        side(&mut right.into_iter(), -1.0);
    }

    /// The road's s at `along_m`, kept inside the lane.
    pub(crate) fn s_of(&self, lane: &Lane, along_m: f64) -> f64 {
        let start = self.roads()[lane.road as usize].sections[lane.section as usize].start_m;
        let along = along_m.clamp(0.0, lane.length_m);
        if lane.forward { start + along } else { start + lane.length_m - along }
    }

    pub(crate) fn borders(&self, lane: &Lane, s: f64) -> Borders {
        let section = &self.roads()[lane.road as usize].sections[lane.section as usize];
        let position = (lane.index.0 - section.lanes[0].0) as usize;
        section.borders(self.lanes(), position, s - section.start_m)
    }

    /// The path at the lane's centre plus `offset_t`.
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
    /// The pose along rising s of a path at `lateral`.
    pub(crate) fn pose(&self, station: &Station, s: f64, lateral: &Lateral) -> Placement {
        let frame = Frame::new(*station);
        let (sin, cos) = (frame.roll_sin, frame.roll_cos);
        let roll = station.roll;
        let banked = lateral.t + lateral.level.scaled(-1.0);
        let tilt_slope = banked.slope * sin + banked.value * cos * roll.slope;
        let shove = banked.value * sin * frame.pitch_sin;
        // How far the path lies from the reference line seen from above, and how that changes.
        let beside = Jet {
            value: banked.value * cos + lateral.level.value,
            slope: banked.slope * cos - banked.value * sin * roll.slope + lateral.level.slope,
            bend: banked.bend * cos + lateral.level.bend,
        };
        let along = 1.0 - station.curvature * beside.value + tilt_slope * frame.pitch_sin;
        let climb = station.elevation.slope + tilt_slope * frame.pitch_cos;
        let aside = beside.slope + station.curvature * shove;
        let uneven = self.unevenness(s, lateral.t.value);
        let position = frame.point(lateral.t.value, lateral.level.value, uneven + lateral.rise_m);
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

    /// What crossfall and shapes add to the banking.
    fn side_slope(&self, s: f64, lateral: &Lateral) -> f64 {
        if self.is_even() {
            return 0.0;
        }
        let t = lateral.t.value;
        (self.unevenness(s, t + 0.01) - self.unevenness(s, t - 0.01)) / 0.02
    }
}

/// A station with the sines and cosines of its angles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Frame {
    origin: DVec3,
    curvature: f64,
    heading_sin: f64,
    heading_cos: f64,
    roll_sin: f64,
    roll_cos: f64,
    pitch_sin: f64,
    pitch_cos: f64,
}

impl Frame {
    pub(crate) fn new(station: Station) -> Frame {
        let position = DVec2::new(station.x, station.y);
        let (sin, cos) = station.heading_rad.sin_cos();
        let (elevation, roll) = (station.elevation, station.roll.value);
        Frame::along(position, DVec2::new(cos, sin), station.curvature, elevation, roll)
    }

    /// A station whose heading is known by its direction.
    pub(crate) fn along(
        position: DVec2,
        ahead: DVec2,
        curvature: f64,
        elevation: Jet,
        roll: f64,
    ) -> Frame {
        let (roll_sin, roll_cos) = if roll == 0.0 { (0.0, 1.0) } else { roll.sin_cos() };
        // Of the pitch -atan(slope).
        let slope = elevation.slope;
        let pitch_cos = 1.0 / (1.0 + slope * slope).sqrt();
        Frame {
            origin: position.extend(elevation.value),
            curvature,
            heading_sin: ahead.y,
            heading_cos: ahead.x,
            roll_sin,
            roll_cos,
            pitch_sin: -slope * pitch_cos,
            pitch_cos,
        }
    }

    /// The point at `t`, of which `level` metres lie on lanes that do not bank, `up` above the
    /// road. The road banks about its own, climbing axis: of a banked metre, `roll_cos` shows to
    /// the side, `roll_sin · pitch_cos` up and `roll_sin · pitch_sin` along.
    pub(crate) fn point(&self, t: f64, level: f64, up: f64) -> DVec3 {
        let banked = t - level;
        let beside = banked * self.roll_cos + level;
        let tilt = banked * self.roll_sin;
        let shove = tilt * self.pitch_sin;
        DVec3::new(
            self.origin.x - self.heading_sin * beside + self.heading_cos * shove,
            self.origin.y + self.heading_cos * beside + self.heading_sin * shove,
            self.origin.z + tilt * self.pitch_cos + up,
        )
    }

    /// How far to the left of and above the reference line a point lies, where nothing banks.
    pub(crate) fn beside(&self, point: DVec3) -> (f64, f64) {
        let offset = point - self.origin;
        (self.left().dot(offset), offset.z)
    }

    /// How a path at `t` runs in `length` metres of s, in which it goes so far to the left and up
    /// from the reference line, where nothing banks.
    pub(crate) fn tangent(&self, t: f64, (left, up): (f64, f64), length: f64) -> Vec3 {
        let slope = -self.pitch_sin / self.pitch_cos;
        let ahead = self.ahead() * (1.0 - self.curvature * t) + DVec3::Z * slope;
        (ahead * length + self.left() * left + DVec3::Z * up).as_vec3()
    }

    /// The direction to the road's left, level.
    pub(crate) fn left(&self) -> DVec3 {
        DVec3::new(-self.heading_sin, self.heading_cos, 0.0)
    }

    /// How much longer a step along the path at `t` is than the same step of s.
    pub(crate) fn stretch(&self, t: f64) -> f64 {
        (1.0 - self.curvature * t).max(0.1)
    }

    /// The direction of the road, level.
    pub(crate) fn ahead(&self) -> DVec3 {
        DVec3::new(self.heading_cos, self.heading_sin, 0.0)
    }
}

impl Placement {
    /// The same place looking the other way.
    pub(crate) fn reversed(self) -> Placement {
        Placement {
            position: self.position,
            heading_rad: wrapped(self.heading_rad + std::f64::consts::PI),
            pitch_rad: -self.pitch_rad,
            roll_rad: -self.roll_rad,
            curvature_per_m: -self.curvature_per_m,
        }
    }
}

/// The same angle from -π to π.
pub(crate) fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}
