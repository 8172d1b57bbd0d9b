//! CARLA's axes: left-handed, x forward, y right, z up; degrees; the only module of this library
//! that speaks them.
//!
//! CARLA turns by yaw about z (clockwise seen from above), pitch (nose up positive) and roll
//! (right side down positive), in Unreal's order.

use glam::{DQuat, EulerRot, Vec3};
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
        let radians = |degrees: f32| f64::from(degrees).to_radians();
        let turn = DQuat::from_euler(
            EulerRot::ZYX,
            -radians(self.yaw_deg),
            -radians(self.pitch_deg),
            radians(self.roll_deg),
        );
        Pose::new(Vec3::new(x, -y, z), turn.as_quat())
    }

    /// From our axes. Angles are greater than −180° and at most 180°, as those of Unreal.
    pub fn from_pose(pose: &Pose) -> CarlaTransform {
        let [x, y, z] = pose.position_m;
        let turn = pose.rotation().as_dquat().normalize();
        let (yaw, pitch, roll) = turn.to_euler(EulerRot::ZYX);
        CarlaTransform {
            location_m: [x, -y, z],
            pitch_deg: degrees(-pitch),
            yaw_deg: degrees(-yaw),
            roll_deg: degrees(roll),
        }
    }
}

/// Converts an angle from −π to π to degrees: greater than −180 and at most 180, never −0.
pub fn degrees(radians: f64) -> f32 {
    let degrees = radians.to_degrees() as f32 + 0.0;
    if degrees <= -180.0 { degrees + 360.0 } else { degrees }
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

    #[test]
    fn right_angles_are_read_as_they_were_set() {
        for yaw_deg in [-90.0, 0.0, 45.0, 90.0, 135.0, 180.0] {
            let back = CarlaTransform::from_pose(
                &CarlaTransform { yaw_deg, ..CarlaTransform::default() }.to_pose(),
            );
            assert_eq!(back.yaw_deg, yaw_deg);
            assert!(back.pitch_deg.is_sign_positive() && back.roll_deg.is_sign_positive());
        }
        let west = CarlaTransform { yaw_deg: -180.0, ..CarlaTransform::default() };
        assert_eq!(CarlaTransform::from_pose(&west.to_pose()).yaw_deg, 180.0);
        let down = CarlaTransform { pitch_deg: -90.0, ..CarlaTransform::default() };
        let back = CarlaTransform::from_pose(&down.to_pose());
        assert!((back.pitch_deg + 90.0).abs() < 0.05, "{back:?}");
    }
}
