//! Poses on a road.

use glam::{DQuat, DVec3, EulerRot};

/// A pose on a road. World space: right-handed, z up, metres and radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placement {
    /// Position in metres.
    pub position: DVec3,
    /// Angle about z, from x towards y.
    pub heading_rad: f64,
    /// Angle about the left-pointing y: positive looks down.
    pub pitch_rad: f64,
    /// Angle about the forward-pointing x: positive lifts the left side.
    pub roll_rad: f64,
    /// Curvature of the path in driving direction, seen from above; positive turns left.
    pub curvature_per_m: f64,
}

impl Placement {
    /// Returns `world_from_lane`: x along the lane, y to its left, z up from its surface.
    pub fn rotation(&self) -> DQuat {
        DQuat::from_euler(EulerRot::ZYX, self.heading_rad, self.pitch_rad, self.roll_rad)
    }

    /// Returns the point `forward`, `left` and `up` metres from this pose.
    pub fn point(&self, forward: f64, left: f64, up: f64) -> DVec3 {
        self.position + self.rotation() * DVec3::new(forward, left, up)
    }
}

impl Placement {
    /// Returns the same position with the opposite direction.
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

/// Returns the equivalent angle between -π and π.
pub(crate) fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}
