//! Poses on a road.

use glam::{DQuat, DVec3, EulerRot};

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
