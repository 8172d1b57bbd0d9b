//! Where to: curvature feed-forward along the route, and feedback on offset and heading.
//!
//! The middle of the wheelbase follows the track. On a circle of curvature κ a vehicle of
//! wheelbase L then slips sideways by β = asin(κL/2) at its middle, and its wheels are turned by
//! atan(2 tan β) (Rajamani, Vehicle Dynamics and Control, section 2.2). Feedback is critically
//! damped with a bandwidth that the delay of one frame and of the steering allows.

use glam::Vec2;

use crate::perceive::Crowd;
use crate::route::{ahead, shift_at};
use crate::rows::Rows;
use crate::tracks::Tracks;

/// Largest angle between where the feedback aims and the track.
const AIM_RAD: f32 = 0.6;
/// Heading feedback, at most.
const HEADING_GAIN: f32 = 1.1;
/// Bandwidth of the feedback at speed, radians per second.
const BANDWIDTH: f32 = 3.5;
/// Damping of the feedback.
const DAMPING: f32 = 0.9;

/// Where a vehicle is relative to where it should be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Deviation {
    /// Left of its line.
    pub(crate) left_m: f32,
    /// Turned left of its line.
    pub(crate) heading_rad: f32,
}

/// The angle of the front wheels, positive to the left, and the deviation that it cures.
pub(crate) fn steer(
    rows: &Rows,
    row: usize,
    tracks: &Tracks,
    crowd: &Crowd,
    delay_s: f32,
) -> (f32, Deviation) {
    let body = crowd.driven[row] as usize;
    let wheelbase = crowd.body[body].wheelbase_m;
    let speed = crowd.speed(body);
    let velocity = crowd.velocity[body];
    // Where the vehicle will be when this steering acts.
    let turn = crowd.yaw_rate[body] * delay_s;
    let position =
        crowd.position[body].truncate() + Vec2::from_angle(0.5 * turn).rotate(velocity) * delay_s;
    let forward = Vec2::from_angle(turn).rotate(crowd.forward[body]);
    let moved = speed.max(0.0) * delay_s;

    let (lane, hint_m) = ahead(rows, row, tracks, moved);
    let seat = tracks.project(lane, position, hint_m);
    let (wanted_left, slope) = shift_at(rows, row, moved);
    // A little farther on for the curvature, which steering follows with its own delay.
    let (lane, arc_m) = ahead(rows, row, tracks, moved + 0.1 * speed.max(0.0));
    let curvature = tracks.at(lane, arc_m).2;

    let slip = (0.5 * curvature * wheelbase).clamp(-0.6, 0.6).asin();
    let line = Vec2::from_angle(slope.atan() - slip).rotate(seat.tangent);
    let mut deviation =
        Deviation { left_m: seat.left_m - wanted_left, heading_rad: line.angle_to(forward) };
    // Turn round by way of the lane, not away from it.
    let side = deviation.left_m.signum();
    if rows.turning[row] == 1 && deviation.heading_rad * side > 2.0 {
        deviation.heading_rad -= side * std::f32::consts::TAU;
    }

    let gain = (BANDWIDTH * wheelbase / speed.abs().max(0.5)).min(HEADING_GAIN);
    let aim = deviation.left_m * gain / (4.0 * DAMPING * DAMPING * wheelbase);
    let wheels =
        (2.0 * slip.tan()).atan() - gain * (deviation.heading_rad + aim.clamp(-AIM_RAD, AIM_RAD));
    (wheels, deviation)
}
