//! The axes of a road at one s: along the reference line, to its left, and up.

use glam::{DVec2, DVec3, Vec3};

use crate::cubic::Jet;

/// The reference line at one s, in world space.
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

    /// Creates the axes of a station whose heading is given as a direction.
    pub(crate) fn along(
        position: DVec2,
        ahead: DVec2,
        curvature: f64,
        elevation: Jet,
        roll: f64,
    ) -> RoadAxes {
        let (roll_sin, roll_cos) = if roll == 0.0 { (0.0, 1.0) } else { roll.sin_cos() };
        // The pitch is -atan(slope).
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

    /// Returns the point at `t`, of which `level` metres lie on lanes that do not bank, `up` metres
    /// above the road.
    ///
    /// The road banks about its own, climbing axis: of a banked metre, `roll_cos` points to the
    /// side, `roll_sin · pitch_cos` up and `roll_sin · pitch_sin` along the road.
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

    /// Returns how far `point` lies to the left of the reference line and above it, for a road that
    /// does not bank.
    pub(crate) fn beside(&self, point: DVec3) -> (f64, f64) {
        let offset = point - self.origin;
        (self.left().dot(offset), offset.z)
    }

    /// Returns the derivative of a path at `t`, scaled to `length` metres of s in which the path
    /// moves `left` and `up` metres relative to the reference line, for a road that does not bank.
    pub(crate) fn tangent(&self, t: f64, (left, up): (f64, f64), length: f64) -> Vec3 {
        let slope = -self.pitch_sin / self.pitch_cos;
        let ahead = self.ahead() * (1.0 - self.curvature * t) + DVec3::Z * slope;
        (ahead * length + self.left() * left + DVec3::Z * up).as_vec3()
    }

    /// Returns the horizontal direction to the road's left.
    pub(crate) fn left(&self) -> DVec3 {
        DVec3::new(-self.heading_sin, self.heading_cos, 0.0)
    }

    /// Returns the length of a step along the path at `t` relative to the same step of s.
    pub(crate) fn stretch(&self, t: f64) -> f64 {
        (1.0 - self.curvature * t).max(0.1)
    }

    /// Returns the horizontal direction of the road.
    pub(crate) fn ahead(&self) -> DVec3 {
        DVec3::new(self.heading_cos, self.heading_sin, 0.0)
    }
}
