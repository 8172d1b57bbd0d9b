//! Upright boxes around all places that a body reaches during a frame.

use glam::{Mat3, Quat, Vec2, Vec3};
use rapier3d::{parry::shape::Cuboid, prelude::Pose};

use super::motion::Twist;

/// Largest acceleration that a bound allows for. Metres per second squared.
const ACCELERATION_MPS2: f32 = 15.0;

/// A box with a vertical axis, in world space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    center: Vec2,
    /// Unit vector along the first horizontal edge.
    ahead: Vec2,
    /// Half the horizontal edges.
    half: Vec2,
    /// Lowest and highest z.
    z: [f32; 2],
    /// The horizontal bounding box.
    pub low: Vec2,
    pub high: Vec2,
}

impl Bound {
    /// Returns the bound of a box with half edges `half_m` and its middle at `middle_m` in body
    /// axes, that moves at a velocity for `frame_s` seconds, with `slack_m` on every side.
    pub(super) fn swept(
        pose: &Pose,
        middle_m: Vec3,
        half_m: Vec3,
        velocity: &Twist,
        frame_s: f32,
        slack_m: f32,
    ) -> Bound {
        let axes = Mat3::from_quat(pose.rotation);
        let ahead = axes.x_axis.truncate().normalize_or(Vec2::X);
        let left = ahead.perp();
        let way = velocity.linear_mps * (0.5 * frame_s);
        let middle = pose.translation + axes * middle_m + way;
        let slack = slack_m + 0.5 * ACCELERATION_MPS2 * frame_s * frame_s;
        // Half the extent of the turned box along a unit vector.
        let extent = |along: Vec3| (axes.transpose() * along).abs().dot(half_m);
        let turned = velocity.angular_radps.z.abs() * frame_s;
        let half = Vec2::new(
            extent(ahead.extend(0.0)) + way.truncate().dot(ahead).abs() + turned * half_m.y,
            extent(left.extend(0.0)) + way.truncate().dot(left).abs() + turned * half_m.x,
        ) + slack;
        let tall = extent(Vec3::Z) + way.z.abs() + slack;
        Bound::new(middle, ahead, half, tall)
    }

    /// Returns the bound of a ball.
    pub(super) fn ball(middle_m: Vec3, radius_m: f32) -> Bound {
        Bound::new(middle_m, Vec2::X, Vec2::splat(radius_m), radius_m)
    }

    fn new(middle: Vec3, ahead: Vec2, half: Vec2, tall: f32) -> Bound {
        let center = middle.truncate();
        let reach = ahead.abs() * half.x + ahead.perp().abs() * half.y;
        let z = [middle.z - tall, middle.z + tall];
        Bound { center, ahead, half, z, low: center - reach, high: center + reach }
    }

    /// Whether two bounds overlap.
    pub(super) fn overlaps(&self, other: &Bound) -> bool {
        if self.low.y > other.high.y || other.low.y > self.high.y {
            return false;
        }
        if self.low.x > other.high.x || other.low.x > self.high.x {
            return false;
        }
        if self.z[0] > other.z[1] || other.z[0] > self.z[1] {
            return false;
        }
        !self.is_apart(other) && !other.is_apart(self)
    }

    /// Whether an edge of this rectangle separates the other from it.
    fn is_apart(&self, other: &Bound) -> bool {
        let between = other.center - self.center;
        [(self.ahead, self.half.x), (self.ahead.perp(), self.half.y)].into_iter().any(
            |(axis, half)| {
                let reach = (other.ahead.dot(axis) * other.half.x).abs()
                    + (other.ahead.perp().dot(axis) * other.half.y).abs();
                between.dot(axis).abs() > half + reach
            },
        )
    }

    /// Returns the pose and the shape of the box.
    pub(super) fn cuboid(&self) -> (Pose, Cuboid) {
        let [low, high] = self.z;
        let yaw = Quat::from_mat3(&Mat3::from_cols(
            self.ahead.extend(0.0),
            self.ahead.perp().extend(0.0),
            Vec3::Z,
        ));
        let pose = Pose::from_parts(self.center.extend(0.5 * (low + high)), yaw);
        (pose, Cuboid::new(self.half.extend(0.5 * (high - low))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn car(x: f32, y: f32, yaw_rad: f32, forward_mps: f32) -> Bound {
        let pose = Pose::from_parts(Vec3::new(x, y, 0.0), Quat::from_rotation_z(yaw_rad));
        let linear_mps = pose.rotation * Vec3::X * forward_mps;
        let velocity = Twist { linear_mps, angular_radps: Vec3::ZERO };
        Bound::swept(&pose, Vec3::Z * 0.7, Vec3::new(2.4, 0.9, 0.7), &velocity, 0.05, 0.1)
    }

    #[test]
    fn cars_in_neighbouring_lanes_do_not_overlap_in_any_direction() {
        for degrees in 0..36 {
            let yaw = degrees as f32 * 10.0_f32.to_radians();
            let beside = Vec2::from_angle(yaw).perp() * 2.5;
            let (one, other) = (car(0.0, 0.0, yaw, 15.0), car(beside.x, beside.y, yaw, -15.0));
            assert!(!one.overlaps(&other), "{degrees}");
            let ahead = Vec2::from_angle(yaw) * 5.3;
            let next = car(ahead.x, ahead.y, yaw, 15.0);
            assert!(one.overlaps(&next) && next.overlaps(&one), "{degrees}");
        }
    }

    #[test]
    fn a_bridge_is_apart_from_the_road_below() {
        let (mut above, below) = (car(0.0, 0.0, 0.0, 10.0), car(0.0, 0.0, 1.0, 10.0));
        assert!(above.overlaps(&below));
        above.z = above.z.map(|z| z + 5.0);
        assert!(!above.overlaps(&below));
    }
}
