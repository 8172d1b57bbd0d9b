//! Where to: curvature feed-forward along the route, and feedback on offset and heading.
//!
//! A point between the axles follows the track, a metres before the rear one. On a circle of
//! curvature κ a vehicle of wheelbase L then slips sideways by β = asin(κa) at that point, and its
//! wheels are turned by atan(L/a tan β) (Rajamani, Vehicle Dynamics and Control, section 2.2).
//! Feedback is critically
//! damped with a bandwidth that the delay of one frame and of the steering allows.

use glam::Vec2;

use crate::{
    agents::Agents,
    body::Body,
    route::{ahead, shift_at},
    tracks::Tracks,
    vehicle_table::VehicleTable,
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
const EVASION_M: f32 = 0.5;
const EVASION_COUNT: u32 = 4;

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
pub(crate) fn wide_offset_left(tracks: &Tracks, lane: u32, arc_m: f32, body: &Body) -> f32 {
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
    let from_axle = body.axle_to_tracking_point_m().powi(2);
    let nose = (0.5 * body.wheelbase_m + body.front_m).powi(2);
    let swing_m =
        0.5 * bend.abs() * if bend * oncoming > 0.0 { nose - from_axle } else { from_axle };
    let spare_m = tracks.half_width_at(lane, arc_m) - body.half_width_m - swing_m;
    -oncoming * (spare_m - EDGE_M).clamp(0.0, KEEP_OFF_M)
}

/// How far left of its line a body drives that has backed out so often of what blocks it: what
/// stands at the kerb would block it again. Of who still cannot pass, the other side is tried.
fn evasion_left(tracks: &Tracks, lane: u32, reverse_count: u32) -> f32 {
    let away = if tracks.oncoming[lane as usize] < 0.0 { -1.0 } else { 1.0 };
    let side = if reverse_count > EVASION_COUNT { -away } else { away };
    side * EVASION_M * (reverse_count.min(2) as f32)
}

/// The angle of the front wheels, positive to the left, and the deviation that it cures.
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
    // Where the vehicle will be when this steering acts.
    let turn = agents.yaw_rate[agent] * delay_s;
    let position =
        agents.position[agent].truncate() + Vec2::from_angle(0.5 * turn).rotate(velocity) * delay_s;
    let forward = Vec2::from_angle(turn).rotate(agents.forward[agent]);
    let moved = speed.max(0.0) * delay_s;

    let position = position + forward * tracking_point_m;
    let (lane, hint_m) = ahead(vehicles, row, tracks, moved + tracking_point_m);
    let projection = tracks.project(lane, position, hint_m);
    let (shift_m, slope) = shift_at(vehicles, row, moved + tracking_point_m);
    let wanted_left = shift_m
        + offset_left_m
        + wide_offset_left(tracks, lane, hint_m, &agents.body[agent])
        + evasion_left(tracks, lane, vehicles.reverse_count[row]);
    // A little farther on for the curvature, which steering follows with its own delay.
    let (lane, arc_m) =
        ahead(vehicles, row, tracks, moved + tracking_point_m + 0.1 * speed.max(0.0));
    let curvature = tracks.at(lane, arc_m).2;

    let slip = (curvature * axle_m).clamp(-0.7, 0.7).asin();
    let line = Vec2::from_angle(slope.atan() - slip).rotate(projection.tangent);
    let mut deviation =
        Deviation { left_m: projection.left_m - wanted_left, heading_rad: line.angle_to(forward) };
    // Turn round by way of the lane, not away from it.
    let side = deviation.left_m.signum();
    if vehicles.u_turn[row] == 1 && deviation.heading_rad * side > 2.0 {
        deviation.heading_rad -= side * std::f32::consts::TAU;
    }

    let gain = (BANDWIDTH * wheelbase / speed.abs().max(0.5)).min(HEADING_GAIN);
    let aim = deviation.left_m * gain / (4.0 * DAMPING * DAMPING * wheelbase);
    let damped = (wheelbase / axle_m * slip.tan()).atan()
        - gain * (deviation.heading_rad + aim.clamp(-AIM_RAD, AIM_RAD));
    let held = (wheelbase * agents.body[agent].grip_mps2() / speed.powi(2).max(0.01)).atan();
    let damped = damped.clamp(-held, held);

    // Slowly through a tight corner, where the body lags behind the curve: what follows the track
    // moves along it, or back to it, and the rear axle is drawn after it.
    let exact = ((EXACT_BELOW - speed.abs() / wheelbase) / EXACT_BLEND).clamp(0.0, 1.0);
    if exact == 0.0 || vehicles.u_turn[row] == 1 {
        return (damped, deviation);
    }
    let back = (RETURN_PER_S * deviation.left_m / (speed.abs() + 1.0)).clamp(-AIM_RAD, AIM_RAD);
    let way = Vec2::from_angle(slope.atan() - back).rotate(projection.tangent);
    let turn = forward.angle_to(way).clamp(-TURN_MAX_RAD, TURN_MAX_RAD);
    let drawn = (wheelbase / axle_m * turn.tan()).atan();
    (damped + (drawn - damped) * exact, deviation)
}
