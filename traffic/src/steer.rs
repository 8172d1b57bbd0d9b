//! Where to: curvature feed-forward along the route, and feedback on offset and heading.
//!
//! A point between the axles follows the track, a metres before the rear one. On a circle of
//! curvature κ a vehicle of wheelbase L then slips sideways by β = asin(κa) at that point, and its
//! wheels are turned by atan(L/a tan β) (Rajamani, Vehicle Dynamics and Control, section 2.2).
//! Feedback is critically
//! damped with a bandwidth that the delay of one frame and of the steering allows.

use glam::Vec2;

use crate::{
    agents::Crowd,
    body::Body,
    route::{ahead, shift_at},
    rows::Rows,
    tracks::Tracks,
};

/// Largest angle between where the feedback aims and the track.
const AIM_RAD: f32 = 0.6;
/// Heading feedback, at most.
const HEADING_GAIN: f32 = 1.1;
/// Bandwidth of the feedback at speed, radians per second.
const BANDWIDTH: f32 = 3.5;
/// Damping of the feedback.
const DAMPING: f32 = 0.9;
/// Below this speed in wheelbases per second, and over how much of a change, the exact law for slow
/// driving takes over.
const EXACT_BELOW: f32 = 2.7;
const EXACT_BLEND: f32 = 0.9;
/// How fast it returns to the track, as a share of the offset per second.
const RETURN_PER_S: f32 = 1.5;
/// The most that it turns from where the body points.
const TURN_MAX_RAD: f32 = 1.0;

/// What is wide keeps so far off the middle of its lane, at most, and stays so far from its edge.
const KEEP_OFF_M: f32 = 0.25;
const EDGE_M: f32 = 0.05;

/// How far who has backed out keeps off what blocked him, each time; and how often on one side.
const EVADE_M: f32 = 0.5;
const EVADE_TIMES: u32 = 4;

/// Where a vehicle is relative to where it should be.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Deviation {
    /// Left of its line.
    pub(crate) left_m: f32,
    /// Turned left of its line.
    pub(crate) heading_rad: f32,
}

/// How far left of the middle of `lane` a body drives: what is wide keeps away from the lane that is
/// driven the other way, because two of them leave each other no more than a hand's breadth. In a
/// bend its nose swings out and its tail cuts in, and it has so much less to spare.
pub(crate) fn keeps_left(tracks: &Tracks, lane: u32, arc_m: f32, body: &Body) -> f32 {
    let oncoming = tracks.oncoming[lane as usize];
    if !body.is_wide() || oncoming == 0.0 {
        return 0.0;
    }
    // Over the length of the body, for a bend begins at once.
    let bend = [-0.5, 0.0, 0.5, 1.0]
        .map(|part| tracks.at(lane, arc_m + part * body.length_m()).2)
        .iter()
        .sum::<f32>()
        * 0.25;
    let from_axle = body.axle_to_lead_m().powi(2);
    let nose = (0.5 * body.wheelbase_m + body.front_m).powi(2);
    let swing_m =
        0.5 * bend.abs() * if bend * oncoming > 0.0 { nose - from_axle } else { from_axle };
    let spare_m = tracks.half_width_at(lane, arc_m) - body.half_width_m - swing_m;
    -oncoming * (spare_m - EDGE_M).clamp(0.0, KEEP_OFF_M)
}

/// How far left of its line a body drives that has backed out so often of what blocks it: what
/// stands at the kerb would block it again. Of who still cannot pass, the other side is tried.
fn evades_left(tracks: &Tracks, lane: u32, reverses: u32) -> f32 {
    let away = if tracks.oncoming[lane as usize] < 0.0 { -1.0 } else { 1.0 };
    let side = if reverses > EVADE_TIMES { -away } else { away };
    side * EVADE_M * (reverses.min(2) as f32)
}

/// The angle of the front wheels, positive to the left, and the deviation that it cures.
pub(crate) fn steer(
    rows: &Rows,
    row: usize,
    tracks: &Tracks,
    crowd: &Crowd,
    delay_s: f32,
    offset_left_m: f32,
) -> (f32, Deviation) {
    let body = crowd.driven[row] as usize;
    let wheelbase = crowd.body[body].wheelbase_m;
    let (lead_m, axle_m) = (crowd.body[body].lead_m(), crowd.body[body].axle_to_lead_m());
    let speed = crowd.speed(body);
    let velocity = crowd.velocity[body];
    // Where the vehicle will be when this steering acts.
    let turn = crowd.yaw_rate[body] * delay_s;
    let position =
        crowd.position[body].truncate() + Vec2::from_angle(0.5 * turn).rotate(velocity) * delay_s;
    let forward = Vec2::from_angle(turn).rotate(crowd.forward[body]);
    let moved = speed.max(0.0) * delay_s;

    let position = position + forward * lead_m;
    let (lane, hint_m) = ahead(rows, row, tracks, moved + lead_m);
    let seat = tracks.project(lane, position, hint_m);
    let (shift_m, slope) = shift_at(rows, row, moved + lead_m);
    let wanted_left = shift_m
        + offset_left_m
        + keeps_left(tracks, lane, hint_m, &crowd.body[body])
        + evades_left(tracks, lane, rows.reverses[row]);
    // A little farther on for the curvature, which steering follows with its own delay.
    let (lane, arc_m) = ahead(rows, row, tracks, moved + lead_m + 0.1 * speed.max(0.0));
    let curvature = tracks.at(lane, arc_m).2;

    let slip = (curvature * axle_m).clamp(-0.7, 0.7).asin();
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
    let damped = (wheelbase / axle_m * slip.tan()).atan()
        - gain * (deviation.heading_rad + aim.clamp(-AIM_RAD, AIM_RAD));
    let held = (wheelbase * crowd.body[body].grip_mps2() / speed.powi(2).max(0.01)).atan();
    let damped = damped.clamp(-held, held);

    // Slowly through a tight corner, where the body lags behind the curve: what follows the track
    // moves along it, or back to it, and the rear axle is drawn after it.
    let exact = ((EXACT_BELOW - speed.abs() / wheelbase) / EXACT_BLEND).clamp(0.0, 1.0);
    if exact == 0.0 || rows.turning[row] == 1 {
        return (damped, deviation);
    }
    let back = (RETURN_PER_S * deviation.left_m / (speed.abs() + 1.0)).clamp(-AIM_RAD, AIM_RAD);
    let way = Vec2::from_angle(slope.atan() - back).rotate(seat.tangent);
    let turn = forward.angle_to(way).clamp(-TURN_MAX_RAD, TURN_MAX_RAD);
    let drawn = (wheelbase / axle_m * turn.tan()).atan();
    (damped + (drawn - damped) * exact, deviation)
}
