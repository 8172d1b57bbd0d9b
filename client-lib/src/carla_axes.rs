//! CARLA's axes: left-handed, x forward, y right, z up; degrees; the only module of this library
//! that speaks them.
//!
//! CARLA turns by yaw about z (clockwise seen from above), pitch (nose up positive) and roll
//! (right side down positive), in Unreal's order.

use glam::{EulerRot, Quat, Vec3};
use protocol::Pose;

/// A pose as CARLA writes it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CarlaTransform {
    /// Metres: x, y to the right, z.
    pub location_m: [f32; 3],
    /// Degrees, nose up positive.
    pub pitch_deg: f32,
    /// Degrees, clockwise seen from above.
    pub yaw_deg: f32,
    /// Degrees, right side down positive.
    pub roll_deg: f32,
}

impl CarlaTransform {
    /// In our axes.
    pub fn to_pose(self) -> Pose {
        let [x, y, z] = self.location_m;
        let turn = Quat::from_euler(
            EulerRot::ZYX,
            -self.yaw_deg.to_radians(),
            -self.pitch_deg.to_radians(),
            self.roll_deg.to_radians(),
        );
        Pose::new(Vec3::new(x, -y, z), turn)
    }

    /// From our axes.
    pub fn from_pose(pose: &Pose) -> CarlaTransform {
        let [x, y, z] = pose.position_m;
        let (yaw, pitch, roll) = pose.rotation().to_euler(EulerRot::ZYX);
        CarlaTransform {
            location_m: [x, -y, z],
            pitch_deg: -pitch.to_degrees(),
            yaw_deg: -yaw.to_degrees(),
            roll_deg: roll.to_degrees(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_positive_yaw_turns_to_the_right_and_a_positive_pitch_lifts_the_nose() {
        let right = CarlaTransform { yaw_deg: 90.0, ..CarlaTransform::default() }.to_pose();
        assert!((right.rotation() * Vec3::X).abs_diff_eq(Vec3::NEG_Y, 1e-6));
        let up = CarlaTransform { pitch_deg: 90.0, ..CarlaTransform::default() }.to_pose();
        assert!((up.rotation() * Vec3::X).abs_diff_eq(Vec3::Z, 1e-6));
        let roll = CarlaTransform { roll_deg: 90.0, ..CarlaTransform::default() }.to_pose();
        assert!((roll.rotation() * Vec3::NEG_Y).abs_diff_eq(Vec3::NEG_Z, 1e-6));
    }

    #[test]
    fn there_and_back_is_the_same() {
        let there = CarlaTransform {
            location_m: [1.0, 2.0, 3.0],
            pitch_deg: 10.0,
            yaw_deg: -70.0,
            roll_deg: 5.0,
        };
        let back = CarlaTransform::from_pose(&there.to_pose());
        assert_eq!(back.location_m, there.location_m);
        for (a, b) in [
            (back.pitch_deg, there.pitch_deg),
            (back.yaw_deg, there.yaw_deg),
            (back.roll_deg, there.roll_deg),
        ] {
            assert!((a - b).abs() < 1e-4, "{a} is not {b}");
        }
    }
}
