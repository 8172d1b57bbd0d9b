//! The axes of a road at one s: along the reference line, to its left, and up.

use glam::{DVec2, DVec3, Vec3};

use crate::cubic::Jet;

/// The reference line at one s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Station {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) heading_rad: f64,
    pub(crate) curvature: f64,
    pub(crate) curvature_slope: f64,
    pub(crate) elevation: Jet,
    pub(crate) roll: Jet,
}

/// A station with the sines and cosines of its angles.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RoadAxes {
    origin: DVec3,
    curvature: f64,
    heading_sin: f64,
    heading_cos: f64,
    pub(crate) roll_sin: f64,
    pub(crate) roll_cos: f64,
    pub(crate) pitch_sin: f64,
    pub(crate) pitch_cos: f64,
}

impl RoadAxes {
    pub(crate) fn new(station: Station) -> RoadAxes {
        let position = DVec2::new(station.x, station.y);
        let (sin, cos) = station.heading_rad.sin_cos();
        let (elevation, roll) = (station.elevation, station.roll.value);
        RoadAxes::along(position, DVec2::new(cos, sin), station.curvature, elevation, roll)
    }

    /// A station whose heading is known by its direction.
    pub(crate) fn along(
        position: DVec2,
        ahead: DVec2,
        curvature: f64,
        elevation: Jet,
        roll: f64,
    ) -> RoadAxes {
        let (roll_sin, roll_cos) = if roll == 0.0 { (0.0, 1.0) } else { roll.sin_cos() };
        // Of the pitch -atan(slope).
        let slope = elevation.slope;
        let pitch_cos = 1.0 / (1.0 + slope * slope).sqrt();
        RoadAxes {
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
