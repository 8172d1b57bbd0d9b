//! Lateral control: curvature feed-forward along the route, and feedback on cross-track and heading
//! error.
//!
//! The tracking point between the axles follows the track, at distance a before the rear axle. On a
//! circle of curvature κ a vehicle of wheelbase L has the sideslip angle β = asin(κa) at that
//! point, and the steering angle atan(L/a tan β) (Rajamani, Vehicle Dynamics and Control, section
//! 2.2). The feedback is critically damped, with a bandwidth that the delay of one frame and of the
//! steering system allows.

use glam::Vec2;

use crate::{
    agents::Agents,
    body::Body,
    route::{ahead, shift_at},
    tracks::Tracks,
    vehicle_table::VehicleTable,
};

/// Largest approach angle to the track.
const AIM_RAD: f32 = 0.6;
/// Upper bound of the heading gain.
const HEADING_GAIN: f32 = 1.1;
/// Bandwidth of the feedback at speed, radians per second.
const BANDWIDTH: f32 = 3.5;
/// Damping ratio of the feedback.
const DAMPING: f32 = 0.9;
/// Speed in wheelbases per second below which the exact law for low speed takes over.
const EXACT_BELOW: f32 = 2.7;
/// Range of that speed over which the two laws are blended.
const EXACT_BLEND: f32 = 0.9;
/// Rate at which the cross-track error decays at low speed, per second.
const RETURN_PER_S: f32 = 1.5;
/// Largest angle between the heading and the direction of the tracking point.
const TURN_MAX_RAD: f32 = 1.0;

/// Largest lateral offset of a wide vehicle from the centre of its lane.
const KEEP_OFF_M: f32 = 0.25;
/// Least distance of a wide vehicle from the edge of its lane.
const EDGE_M: f32 = 0.05;

/// Lateral offset after each reversal.
const EVASION_M: f32 = 0.5;
/// Number of reversals after which the vehicle evades to the other side.
const EVASION_COUNT: u32 = 4;

/// Deviation of a vehicle from its line.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Deviation {
    /// Cross-track error, positive to the left, metres.
    pub(crate) left_m: f32,
    /// Heading error, positive to the left, radians.
    pub(crate) heading_rad: f32,
}

/// Returns the lateral offset of a vehicle from the centre of `lane`. A wide vehicle keeps away
/// from the oncoming lane, because two of them pass with little clearance. In a curve its front
/// swings out and its rear cuts in, which reduces the room for that offset.
pub(crate) fn wide_offset_left(tracks: &Tracks, lane: u32, arc_m: f32, body: &Body) -> f32 {
    let oncoming = tracks.oncoming[lane as usize];
    if !body.is_wide() || oncoming == 0.0 {
        return 0.0;
    }
    // Averaged over the length of the vehicle, because a curve begins abruptly.
    let curvature_mean = [-0.5, 0.0, 0.5, 1.0]
        .map(|part| tracks.at(lane, arc_m + part * body.length_m()).2)
        .iter()
        .sum::<f32>()
        * 0.25;
    let from_axle = body.axle_to_tracking_point_m().powi(2);
    let nose = (0.5 * body.wheelbase_m + body.front_m).powi(2);
    let swing_m = 0.5
        * curvature_mean.abs()
        * if curvature_mean * oncoming > 0.0 { nose - from_axle } else { from_axle };
    let spare_m = tracks.half_width_at(lane, arc_m) - body.half_width_m - swing_m;
    -oncoming * (spare_m - EDGE_M).clamp(0.0, KEEP_OFF_M)
}

/// Returns the lateral offset of a vehicle that has reversed: away from what was in its way, which
/// would block it again. After `EVASION_COUNT` attempts it tries the other side.
fn evasion_left(vehicles: &VehicleTable, row: usize) -> f32 {
    let (away, count) = (vehicles.evasion_side[row], vehicles.reverse_count[row]);
    let side = if count > EVASION_COUNT { -away } else { away };
    side * EVASION_M * (count.min(2) as f32)
}

/// Returns the angle of the front wheels, positive to the left, and the deviation that it corrects.
pub(crate) fn steer(
    vehicles: &VehicleTable,
    row: usize,
    tracks: &Tracks,
    agents: &Agents,
    delay_s: f32,
    offset_left_m: f32,
) -> (f32, Deviation) {
    let agent = agents.driven[row] as usize;
    let wheelbase = agents.body[agent].wheelbase_m;
    let (tracking_point_m, axle_m) =
        (agents.body[agent].tracking_point_m(), agents.body[agent].axle_to_tracking_point_m());
    let speed = agents.speed(agent);
    let velocity = agents.velocity[agent];
    // Pose of the vehicle when this steering takes effect.
    let turn = agents.yaw_rate[agent] * delay_s;
    let position =
        agents.position[agent].truncate() + Vec2::from_angle(0.5 * turn).rotate(velocity) * delay_s;
    let forward = Vec2::from_angle(turn).rotate(agents.forward[agent]);
    let moved = speed.max(0.0) * delay_s;

    let position = position + forward * tracking_point_m;
    let (lane, hint_m) = ahead(vehicles, row, tracks, moved + tracking_point_m);
    let projection = tracks.project(lane, position, hint_m);
    let (shift_m, slope) = shift_at(vehicles, row, moved + tracking_point_m);
    // Beside a prop, only the offset counts that clears it.
    let aside_m =
        if vehicles.passes_prop(row) { 0.0 } else { offset_left_m + evasion_left(vehicles, row) };
    let target_left =
        shift_m + wide_offset_left(tracks, lane, hint_m, &agents.body[agent]) + aside_m;
    // The curvature is taken a little farther on, because steering follows it with a delay.
    let (lane, arc_m) =
        ahead(vehicles, row, tracks, moved + tracking_point_m + 0.1 * speed.max(0.0));
    let curvature = tracks.at(lane, arc_m).2;

    let slip = (curvature * axle_m).clamp(-0.7, 0.7).asin();
    let line = Vec2::from_angle(slope.atan() - slip).rotate(projection.tangent);
    let mut deviation =
        Deviation { left_m: projection.left_m - target_left, heading_rad: line.angle_to(forward) };
    // A U-turn goes towards the lane and not away from it.
    let side = deviation.left_m.signum();
    if vehicles.u_turn[row] == 1 && deviation.heading_rad * side > 2.0 {
        deviation.heading_rad -= side * std::f32::consts::TAU;
    }

    let gain = (BANDWIDTH * wheelbase / speed.abs().max(0.5)).min(HEADING_GAIN);
    let aim = deviation.left_m * gain / (4.0 * DAMPING * DAMPING * wheelbase);
    let damped = (wheelbase / axle_m * slip.tan()).atan()
        - gain * (deviation.heading_rad + aim.clamp(-AIM_RAD, AIM_RAD));
    let grip_limit_rad =
        (wheelbase * agents.body[agent].grip_mps2() / speed.powi(2).max(0.01)).atan();
    let damped = damped.clamp(-grip_limit_rad, grip_limit_rad);

    // At low speed in a tight curve, where the body lags behind the curve: the tracking point moves
    // along the track or back to it, and the rear axle follows.
    let exact = ((EXACT_BELOW - speed.abs() / wheelbase) / EXACT_BLEND).clamp(0.0, 1.0);
    if exact == 0.0 || vehicles.u_turn[row] == 1 {
        return (damped, deviation);
    }
    let back = (RETURN_PER_S * deviation.left_m / (speed.abs() + 1.0)).clamp(-AIM_RAD, AIM_RAD);
    let direction = Vec2::from_angle(slope.atan() - back).rotate(projection.tangent);
    let turn = forward.angle_to(direction).clamp(-TURN_MAX_RAD, TURN_MAX_RAD);
    let exact_angle = (wheelbase / axle_m * turn.tan()).atan();
    (damped + (exact_angle - damped) * exact, deviation)
}
