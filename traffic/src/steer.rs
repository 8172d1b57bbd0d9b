//! Lateral control: feed-forward of the curvature of the route and of lane changes, and feedback on
//! cross-track and heading error.
//!
//! The tracking point between the axles follows the track, at distance a before the rear axle. On a
//! circle of curvature κ a vehicle of wheelbase L has the sideslip angle β = asin(κa) at that
//! point, and the steering angle atan(L/a tan β) (Rajamani, Vehicle Dynamics and Control, section
//! 2.2). At speed the tyres' slip angles are added: β is less by that of the rear tyres, and the steering
//! angle is more by the difference between the front and the rear tyres (ibid., section 3.1: understeer).
//! The feedback is critically damped, with a bandwidth that the delay of one frame and of the
//! steering system allows.

use glam::Vec2;

use crate::{
    agents::Agents,
    body::{Body, Class},
    route::{ahead, shift_at},
    tracks::Tracks,
    vehicle_table::Vehicle,
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

/// Speed from which the direction of motion counts for the limits of steering.
const SLIDE_MPS: f32 = 5.0;
/// Largest lateral acceleration for which tyre slip is compensated.
const LATERAL_MAX_MPS2: f32 = 5.0;

/// Largest lateral offset of a wide vehicle from the centre of its lane.
const KEEP_OFF_M: f32 = 0.25;
/// Least distance of a wide vehicle from the edge of its lane.
const EDGE_M: f32 = 0.05;

/// Distance of a bicycle from the edge of its lane.
const RIDE_M: f32 = 0.6;
/// Its largest distance from the centre of its lane.
const RIDE_MAX_M: f32 = 1.2;

/// Largest angle of the front wheels in reverse.
const BACK_MAX_RAD: f32 = 0.6;
/// Distance over which a vehicle returns to its lane in reverse. Metres.
const BACK_RETURN_M: f32 = 5.0;
/// Lateral offset after each reversal.
const EVASION_M: f32 = 0.5;
/// Number of reversals after which the vehicle evades to the other side.
pub(crate) const EVASION_COUNT: u32 = 4;

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
    if !body.is_wide() {
        return 0.0;
    }
    let oncoming = tracks.oncoming[lane as usize];
    if oncoming == 0.0 {
        return 0.0;
    }
    // Averaged over the length of the vehicle, because a curve begins abruptly.
    let curvature_mean = [-0.5, 0.0, 0.5, 1.0]
        .map(|part| tracks.curvature_at(lane, arc_m + part * body.length_m()))
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

/// Returns the lateral offset of a bicycle from the centre of `lane`: cyclists ride near the edge, away
/// from the oncoming lane.
fn ride_offset_left(tracks: &Tracks, lane: u32, arc_m: f32, body: &Body) -> f32 {
    if body.class != Class::Bicycle {
        return 0.0;
    }
    let edge = if tracks.oncoming[lane as usize] < 0.0 { 1.0 } else { -1.0 };
    edge * (tracks.half_width_at(lane, arc_m) - body.half_width_m - RIDE_M).clamp(0.0, RIDE_MAX_M)
}

/// Returns the lateral offset of a vehicle that has reversed: away from what was in its way, which
/// would block it again. After `EVASION_COUNT` attempts it tries the other side; attempts before a vehicle that comes
/// are counted up to there only.
pub(crate) fn evasion_left(vehicle: &Vehicle) -> f32 {
    let (away, count) = (vehicle.evasion_side, vehicle.reverse_count);
    let side = if count > EVASION_COUNT { -away } else { away };
    side * EVASION_M * (count.min(2) as f32)
}

/// Returns the angle of the front wheels in reverse of a vehicle that would steer by `wheels` forwards for
/// this deviation. It follows the bend of its lane back. For one that comes towards it, it stays on its
/// lane; else it turns the body as it would forwards, which gains angle to pass what is in its way. In
/// a junction it gains angle for its turn: it does not go back to the lane that it came from.
pub(crate) fn back_rad(
    vehicle: &Vehicle,
    tracks: &Tracks,
    body: &Body,
    (wheels, deviation): (f32, &Deviation),
    is_for_oncoming: bool,
) -> f32 {
    let lane = vehicle.route.lane();
    let in_zone = tracks.in_zone(lane);
    let bend_per_m = if in_zone { 0.0 } else { tracks.curvature_at(lane, vehicle.arc_m) };
    let bend_rad = (body.wheelbase_m * bend_per_m).atan();
    let back_rad = if is_for_oncoming && !in_zone {
        let left_m = deviation.left_m + evasion_left(vehicle);
        let aim_rad = (left_m / BACK_RETURN_M).clamp(-AIM_RAD, AIM_RAD);
        bend_rad + HEADING_GAIN * (deviation.heading_rad - aim_rad)
    } else {
        2.0 * bend_rad - wheels
    };
    back_rad.clamp(-BACK_MAX_RAD, BACK_MAX_RAD)
}

/// Returns the angle of the front wheels, positive to the left, and the deviation that it corrects.
pub(crate) fn steer(
    vehicle: &Vehicle,
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
    let (lane, hint_m) = ahead(vehicle, tracks, moved + tracking_point_m);
    let projection = tracks.project(lane, position, hint_m);
    let shift = shift_at(vehicle, moved + tracking_point_m);
    // Beside a prop, only the offset counts that clears it.
    let aside_m = if vehicle.passes_prop() { 0.0 } else { offset_left_m + evasion_left(vehicle) };
    let ride_m = if offset_left_m == 0.0 && !vehicle.passes_prop() {
        ride_offset_left(tracks, lane, hint_m, &agents.body[agent])
    } else {
        0.0
    };
    let target_left = shift.left_m
        + wide_offset_left(tracks, lane, hint_m, &agents.body[agent])
        + aside_m
        + ride_m;
    // The curvature is taken a little farther on, because steering follows it with a delay.
    let farther_m = moved + tracking_point_m + 0.1 * speed.max(0.0);
    let (lane, arc_m) = ahead(vehicle, tracks, farther_m);
    let curvature = tracks.curvature_at(lane, arc_m) + shift_at(vehicle, farther_m).bend_per_m;

    let kinematic_slip = (curvature * axle_m).clamp(-0.7, 0.7).asin();
    let lateral_mps2 = (curvature * speed * speed).clamp(-LATERAL_MAX_MPS2, LATERAL_MAX_MPS2);
    let [front_slip, rear_slip] = agents.body[agent].slip_radps2pm().map(|of| of * lateral_mps2);
    // The rear tyres run outwards by their slip angle, so that the body points inwards.
    let slip = kinematic_slip - rear_slip;
    let slope_rad = if shift.slope == 0.0 { 0.0 } else { shift.slope.atan() };
    let line = Vec2::from_angle(slope_rad - slip).rotate(projection.tangent);
    let mut deviation =
        Deviation { left_m: projection.left_m - target_left, heading_rad: line.angle_to(forward) };
    // A U-turn goes towards the lane and not away from it.
    let side = deviation.left_m.signum();
    if vehicle.u_turn == 1 && deviation.heading_rad * side > 2.0 {
        deviation.heading_rad -= side * std::f32::consts::TAU;
    }

    let gain = (BANDWIDTH * wheelbase / speed.abs().max(0.5)).min(HEADING_GAIN);
    let aim = deviation.left_m * gain / (4.0 * DAMPING * DAMPING * wheelbase);
    let damped = (wheelbase / axle_m * kinematic_slip.tan()).atan() + front_slip
        - rear_slip
        - gain * (deviation.heading_rad + aim.clamp(-AIM_RAD, AIM_RAD));
    let grip_limit = wheelbase * agents.body[agent].grip_mps2() / speed.powi(2).max(0.01);
    // The arctangent of x > 0 is more than x / (1 + x).
    let damped = if damped.abs() < 0.99 * grip_limit / (1.0 + grip_limit) {
        damped
    } else {
        // A vehicle that slides may steer as far as its front tyres roll, and beyond by their slip angle.
        let across_mps = agents.forward[agent].perp_dot(velocity);
        let rolls_rad =
            (across_mps + 0.5 * wheelbase * agents.yaw_rate[agent]) / speed.abs().max(SLIDE_MPS);
        let slip_rad = agents.body[agent].slip_radps2pm()[0] * agents.body[agent].grip_mps2();
        let most = (rolls_rad + slip_rad).max(grip_limit.atan());
        damped.clamp((rolls_rad - slip_rad).min(-grip_limit.atan()), most)
    };

    // At low speed in a tight curve, where the body lags behind the curve: the tracking point moves
    // along the track or back to it, and the rear axle follows.
    let exact = ((EXACT_BELOW - speed.abs() / wheelbase) / EXACT_BLEND).clamp(0.0, 1.0);
    if exact == 0.0 || vehicle.u_turn == 1 {
        return (damped, deviation);
    }
    let back = (RETURN_PER_S * deviation.left_m / (speed.abs() + 1.0)).clamp(-AIM_RAD, AIM_RAD);
    let direction = Vec2::from_angle(slope_rad - back).rotate(projection.tangent);
    let turn = forward.angle_to(direction).clamp(-TURN_MAX_RAD, TURN_MAX_RAD);
    let exact_angle = (wheelbase / axle_m * turn.tan()).atan();
    (damped + (exact_angle - damped) * exact, deviation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{body::CAR, tests::maps, vehicle_table::Route};

    /// Returns how far a car is from its lane after 10 m in reverse, which begins this far from it and steers
    /// forwards by this more than the bend requires.
    fn left_after_reverse_m(left_m: f32, more_rad: f32, is_for_oncoming: bool) -> f32 {
        let tracks = Tracks::new(&maps::loop_road(35.0, 0.0));
        let lane = (0..tracks.count() as u32).find(|&lane| tracks.has(lane)).expect("a track");
        let mut vehicle =
            Vehicle { route: Route::from_lane(lane, 0), arc_m: 50.0, ..Vehicle::new(1) };
        let (at, mut forward, bend_per_m) = tracks.at(lane, vehicle.arc_m);
        assert!(bend_per_m > 0.02, "it turns left");
        let wheels = (CAR.wheelbase_m * bend_per_m).atan() + more_rad;
        let (mut rear, step_m) = (at.truncate() + forward.perp() * left_m, 0.1);
        for _ in 0..100 {
            let place = tracks.project(lane, rear, vehicle.arc_m);
            vehicle.arc_m = place.arc_m;
            let heading_rad = place.tangent.angle_to(forward);
            let deviation = Deviation { left_m: place.left_m, heading_rad };
            let steered = (wheels, &deviation);
            let back_rad = back_rad(&vehicle, &tracks, &CAR, steered, is_for_oncoming);
            rear -= forward * step_m;
            let turn_rad = -step_m * back_rad.tan() / CAR.wheelbase_m;
            forward = Vec2::from_angle(turn_rad).rotate(forward);
        }
        tracks.project(lane, rear, vehicle.arc_m).left_m
    }

    #[test]
    fn a_vehicle_follows_its_bend_in_reverse() {
        let left_m = left_after_reverse_m(0.0, 0.0, false);
        assert!(left_m.abs() < 0.1, "{left_m} m to the left");
        // One that has to turn left turns left in reverse too: its rear goes to the right.
        let [left, right] = [0.2, -0.2].map(|more| left_after_reverse_m(0.0, more, false));
        assert!(left < -1.0 && right > 1.0, "{left} {right} m");
    }

    #[test]
    fn a_vehicle_that_goes_back_for_an_oncoming_one_returns_to_its_lane() {
        for left_m in [-0.8, 0.0, 0.8] {
            let after_m = left_after_reverse_m(left_m, -0.3, true);
            assert!(after_m.abs() < 0.3, "{after_m} m from its lane");
        }
    }
}
