//! The inertial measurement unit, from the substeps of physics.
//!
//! The sensor's point moves at `v + ω × r` (v and ω of the carrier, r the lever arm from its
//! origin). The specific force over a substep of length h is the change of that velocity over h
//! plus gravity upwards, in sensor axes; a reading is the mean since the last one. A teleport
//! happens between two frames and is not measured: changes of velocity count from the beginning of
//! the first substep.

use glam::{Quat, Vec3};
use protocol::{ImuReading, ImuSpec, Pose};

use super::noise::Noise;
use crate::physics::BodyMotion;

/// A mounted unit.
pub(super) struct Imu {
    spec: ImuSpec,
    /// `carrier_from_sensor`.
    mounted: Pose,
    /// The motion after the last substep.
    before: Option<Sample>,
    specific_force: Vec3,
    rotation_rad: Vec3,
    over_secs: f32,
    accelerometer_bias: Vec3,
    gyroscope_bias: Vec3,
}

#[derive(Clone, Copy)]
struct Sample {
    velocity_mps: Vec3,
    sensor_from_world: Quat,
    spin_radps: Vec3,
}

impl Imu {
    pub(super) fn new(spec: ImuSpec, mounted: Pose) -> Imu {
        Imu {
            spec,
            mounted,
            before: None,
            specific_force: Vec3::ZERO,
            rotation_rad: Vec3::ZERO,
            over_secs: 0.0,
            accelerometer_bias: Vec3::ZERO,
            gyroscope_bias: Vec3::ZERO,
        }
    }

    /// Observes the carrier after a substep of `dt` seconds; 0 before the first of a frame.
    pub(super) fn observe(&mut self, carrier: &BodyMotion, dt: f32) {
        let turn = carrier.pose.rotation();
        let arm = turn * self.mounted.position();
        let now = Sample {
            velocity_mps: carrier.velocity_mps + carrier.spin_radps.cross(arm),
            sensor_from_world: (turn * self.mounted.rotation()).inverse(),
            spin_radps: carrier.spin_radps,
        };
        let before = self.before.replace(now);
        let Some(before) = before.filter(|_| dt > 0.0) else { return };
        let change = (now.velocity_mps - before.velocity_mps) + Vec3::Z * self.gravity(dt);
        // The sensor axes rotate during the substep: the mean of both orientations.
        self.specific_force +=
            0.5 * (before.sensor_from_world * change + now.sensor_from_world * change);
        let rotation_rad =
            before.sensor_from_world * before.spin_radps + now.sensor_from_world * now.spin_radps;
        self.rotation_rad += 0.5 * dt * rotation_rad;
        self.over_secs += dt;
    }

    fn gravity(&self, dt: f32) -> f32 {
        self.spec.gravity_mps2 * dt
    }

    /// Advances the random walk of the biases by one frame.
    pub(super) fn advance(&mut self, delta_secs: f32, noise: &mut Noise) {
        let root = delta_secs.sqrt();
        for axis in 0..3 {
            self.accelerometer_bias[axis] +=
                noise.normal(self.spec.accelerometer_walk * root) as f32;
            self.gyroscope_bias[axis] += noise.normal(self.spec.gyroscope_walk * root) as f32;
        }
    }

    /// Returns the reading since the last one. A static sensor, and one on an actor without
    /// physics, measures gravity only.
    pub(super) fn read(&mut self, world_from_sensor: &Pose, noise: &mut Noise) -> ImuReading {
        let (specific_force, rate_radps) = if self.over_secs > 0.0 {
            (self.specific_force / self.over_secs, self.rotation_rad / self.over_secs)
        } else {
            let up = world_from_sensor.rotation().inverse() * Vec3::Z;
            (up * self.spec.gravity_mps2, Vec3::ZERO)
        };
        let over_secs = self.over_secs;
        (self.specific_force, self.rotation_rad, self.over_secs) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        let spec = &self.spec;
        let mut reading = ImuReading {
            accelerometer_mps2: (specific_force + self.accelerometer_bias).to_array(),
            gyroscope_radps: (rate_radps + self.gyroscope_bias).to_array(),
            compass_rad: compass(world_from_sensor),
            over_secs,
        };
        let most = spec.accelerometer_max_mps2;
        for axis in 0..3 {
            let force = &mut reading.accelerometer_mps2[axis];
            *force += noise.normal(spec.accelerometer_stddev_mps2[axis]) as f32;
            if most > 0.0 {
                *force = force.clamp(-most, most);
            }
            let rate = &mut reading.gyroscope_radps[axis];
            *rate += noise.normal(spec.gyroscope_stddev_radps[axis]) as f32;
            *rate += spec.gyroscope_bias_radps[axis];
        }
        reading
    }
}

/// Returns the heading of the sensor's x axis, clockwise from north, 0 to 2π.
pub(super) fn compass(world_from_sensor: &Pose) -> f32 {
    let ahead = world_from_sensor.rotation() * Vec3::X;
    ahead.x.atan2(ahead.y).rem_euclid(std::f32::consts::TAU)
}
