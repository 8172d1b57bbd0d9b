//! The odometer: speeds, yaw rate and distance.

use glam::Vec3;
use protocol::{OdometryReading, OdometrySpec, Pose};

use super::noise::Noise;
use crate::physics::BodyMotion;

/// A mounted odometer.
pub(super) struct Odometry {
    spec: OdometrySpec,
    mounted: Pose,
    distance_m: f64,
}

impl Odometry {
    pub(super) fn new(spec: OdometrySpec, mounted: Pose) -> Odometry {
        Odometry { spec, mounted, distance_m: 0.0 }
    }

    /// Advances the distance by one frame.
    pub(super) fn advance(
        &mut self,
        carrier: Option<&BodyMotion>,
        wheel_speed_mps: Option<f32>,
        delta_secs: f32,
    ) {
        let wheel_speed_mps = wheel_speed_mps.unwrap_or_else(|| self.speed_mps(carrier));
        self.distance_m += f64::from(wheel_speed_mps * (1.0 + self.spec.scale_error) * delta_secs);
    }

    fn speed_mps(&self, carrier: Option<&BodyMotion>) -> f32 {
        let Some(carrier) = carrier else { return 0.0 };
        let turn = carrier.pose.rotation();
        let velocity =
            carrier.velocity_mps + carrier.spin_radps.cross(turn * self.mounted.position());
        velocity.dot(turn * self.mounted.rotation() * Vec3::X)
    }

    /// Returns the reading.
    pub(super) fn read(
        &self,
        carrier: Option<&BodyMotion>,
        wheel_speed_mps: Option<f32>,
        steer_rad: f32,
        noise: &mut Noise,
    ) -> OdometryReading {
        let speed = self.speed_mps(carrier);
        let up = carrier.map(|c| c.pose.rotation() * self.mounted.rotation() * Vec3::Z);
        let yaw_rate = carrier.zip(up).map_or(0.0, |(c, up)| c.spin_radps.dot(up));
        OdometryReading {
            speed_mps: self.with_error(speed, noise),
            wheel_speed_mps: self.with_error(wheel_speed_mps.unwrap_or(speed), noise),
            yaw_rate_radps: yaw_rate,
            steer_rad,
            distance_m: self.distance_m,
        }
    }

    fn with_error(&self, speed_mps: f32, noise: &mut Noise) -> f32 {
        let spec = &self.spec;
        let wrong = speed_mps * (1.0 + spec.scale_error) + noise.normal(spec.stddev_mps) as f32;
        if spec.step_mps > 0.0 { (wrong / spec.step_mps).round() * spec.step_mps } else { wrong }
    }
}
