//! Longitudinal control: the intelligent driver model (IDM) behind a leader, and the speed that
//! curves, speed limits and stop lines allow.

use crate::{
    constraint::JunctionConstraint, drivers::Driver, leader::Leader, tracks::Tracks,
    vehicle_table::Vehicle,
};

/// Deceleration for a lower speed limit or a curve ahead.
const ANTICIPATION_BRAKE_MPS2: f32 = 2.5;
/// Comfortable deceleration before a stop line, whoever drives.
const STOP_BRAKE_MPS2: f32 = 2.0;
/// Deceleration to a lower desired speed without anything ahead.
const SLOW_DOWN_MPS2: f32 = 3.0;
/// Rate at which a vehicle approaches a lower desired speed.
pub(crate) const SLOW_DOWN_PER_S: f32 = 1.5;
/// Exponent of the free acceleration (IDM parameter δ).
const FREE_EXPONENT: i32 = 4;
/// Weight of the second vehicle ahead beside the first: 1/4 to 1.
const SECOND_WEIGHT: f32 = 0.2;
/// Speed from which the second vehicle ahead has its full weight.
const ANTICIPATION_MPS: f32 = 5.0;
/// Maximum deceleration.
pub(crate) const BRAKE_MAX_MPS2: f32 = 7.0;
/// Distance from a stop line to the virtual standing leader behind it.
const LINE_GAP_M: f32 = 0.6;
/// What a lane that tapers leaves beside a vehicle that stops at its end.
const TAPER_SPARE_M: f32 = 0.15;
/// Longest taper that is searched, in metres.
const TAPER_MAX_M: u32 = 60;
/// Desired speed up to which a vehicle is to stand.
pub(crate) const STANDSTILL_MPS: f32 = 0.1;

/// Returns the IDM acceleration behind a leader, metres per second squared (Treiber, Hennecke and
/// Helbing 2000, in the form in which free acceleration and interaction do not add up). `min_gap_m`
/// is the gap kept at standstill (s0).
pub(crate) fn idm(speed: f32, leader_mps: f32, gap_m: f32, min_gap_m: f32, driver: &Driver) -> f32 {
    let closing = speed - leader_mps;
    let braking = speed * closing / (2.0 * (driver.accel_mps2 * driver.comfort_brake_mps2).sqrt());
    let desired_gap = min_gap_m + (speed * driver.headway_s + braking).max(0.0);
    let gap = gap_m.max(0.05);
    let interaction = driver.accel_mps2 * (1.0 - (desired_gap / gap) * (desired_gap / gap));
    // The model overreacts to a small gap that opens; a vehicle that can stop in time may close up.
    interaction.max(-BRAKE_MAX_MPS2)
}

/// Returns the acceleration on a free road towards `desired`, metres per second; it is never positive
/// where `desired` is a standstill.
pub(crate) fn free_accel(speed: f32, desired: f32, driver: &Driver) -> f32 {
    if speed <= desired && desired > STANDSTILL_MPS {
        let part = speed / desired;
        driver.accel_mps2 * (1.0 - part.powi(FREE_EXPONENT))
    } else {
        (-SLOW_DOWN_PER_S * (speed - desired)).max(-SLOW_DOWN_MPS2)
    }
}

/// How a vehicle's target speed follows from the speed limit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SpeedPolicy {
    /// Below the speed limit by this fraction; a negative fraction is above it.
    Reduced(f32),
    /// This part of the speed limit, up to a speed in metres per second.
    Own { factor: f32, top_mps: f32 },
    /// This speed in metres per second, whatever the limit is.
    Fixed(f32),
}

impl SpeedPolicy {
    /// Returns the target speed at a speed limit.
    fn at(self, limit_mps: f32) -> f32 {
        match self {
            SpeedPolicy::Reduced(fraction) => limit_mps * (1.0 - fraction).max(0.0),
            SpeedPolicy::Own { factor, top_mps } => {
                (limit_mps * (1.0 - (1.0 - factor)).max(0.0)).min(top_mps)
            }
            SpeedPolicy::Fixed(mps) => mps,
        }
    }
}

/// Returns the speed that curves and speed limits ahead allow, metres per second.
pub(crate) fn desired_speed(
    vehicle: &Vehicle,
    tracks: &Tracks,
    speed: f32,
    policy: SpeedPolicy,
    curve_speed_factor: f32,
) -> f32 {
    let lanes = vehicle.route.lanes();
    let mut desired = policy.at(tracks.limit_mps[lanes[0] as usize]);
    // Looks ahead by the response time of the pedals.
    let lookahead = vehicle.arc_m.max(0.0) + 0.4 * speed.max(0.0);
    let length = tracks.length(lanes[0]);
    if lookahead < length {
        desired = desired.min(tracks.curve_speed_at(lanes[0], lookahead) * curve_speed_factor);
    }
    let mut begins = length - vehicle.arc_m;
    let horizon = speed * speed / (2.0 * ANTICIPATION_BRAKE_MPS2) + speed + 10.0;
    for &lane in &lanes[1..] {
        if begins > horizon {
            return desired;
        }
        let limit = policy.at(tracks.limit_mps[lane as usize]);
        let over = (begins - 0.4 * speed).max(0.0);
        let inside = (0.4 * speed - begins).max(0.0);
        if inside < tracks.length(lane) {
            let top = limit.min(tracks.curve_speed_at(lane, inside) * curve_speed_factor);
            desired = desired.min((top * top + 2.0 * ANTICIPATION_BRAKE_MPS2 * over).sqrt());
        }
        begins += tracks.length(lane);
    }
    desired
}

/// Returns the distance from the front bumper to the end of the known route, or infinity if it is
/// farther than `within_m`.
pub(crate) fn route_end(vehicle: &Vehicle, tracks: &Tracks, front_m: f32, within_m: f32) -> f32 {
    let lanes = vehicle.route.lanes();
    let before = lanes.len().saturating_sub(1);
    let far_m = within_m + vehicle.arc_m + front_m + 1.0;
    let mut length = 0.0;
    for &lane in &lanes[..before] {
        length += tracks.length(lane);
        if length > far_m {
            return f32::INFINITY;
        }
    }
    let end_m = length + tracks.usable_m[vehicle.route.last() as usize] - vehicle.arc_m - front_m;
    if end_m > within_m { f32::INFINITY } else { end_m }
}

/// Returns how far before the end of `lane` a vehicle of this width stops so that vehicles on the lane
/// beside pass: it is longer than others where the lane tapers. 0 on lanes that continue.
pub(crate) fn taper_m(tracks: &Tracks, lane: u32, half_width_m: f32) -> f32 {
    if !tracks.next(lane).is_empty() {
        return 0.0;
    }
    let (end_m, need_m) = (tracks.usable_m[lane as usize], half_width_m + TAPER_SPARE_M);
    let is_wide = |back_m: &f32| tracks.half_width_at(lane, end_m - back_m) >= need_m;
    (0..TAPER_MAX_M).map(|back_m| back_m as f32).find(is_wide).unwrap_or(0.0)
}

/// Returns the acceleration behind a leader and the vehicle before it, with the mean gap of both:
/// the human driver model with anticipation over two vehicles, in which the n-th weighs 1/n²
/// (Treiber, Kesting and Helbing 2006, equations 11 and 12).
fn follow(speed: f32, [leader, second]: &[Leader; 2], gap_m: f32, driver: &Driver) -> f32 {
    let behind = |leader: &Leader| idm(speed, leader.speed_mps, leader.gap_m, gap_m, driver);
    let first = behind(leader);
    if !second.gap_m.is_finite() {
        return first;
    }
    // Vehicles that creep in a queue close up to their leader alone.
    let weight = SECOND_WEIGHT * (speed / ANTICIPATION_MPS).min(1.0);
    first + weight * (behind(second) - first)
}

/// Returns the acceleration that speed, leaders, junction and stop line together allow. `leaders` are
/// the leader and that of the leader, as [`crate::reaction::perceive`] returns them.
pub(crate) fn accelerate(
    speed: f32,
    desired: f32,
    leaders: &[Leader; 2],
    constraint: &JunctionConstraint,
    gap_m: f32,
    driver: &Driver,
) -> f32 {
    let mut accel = free_accel(speed, desired, driver);
    if leaders[0].gap_m.is_finite() {
        accel = accel.min(follow(speed, leaders, gap_m, driver));
    }
    if constraint.merge_leader_m.is_finite() {
        accel = accel.min(idm(
            speed,
            constraint.merge_leader_mps,
            constraint.merge_leader_m,
            gap_m,
            driver,
        ));
    }
    if constraint.stop_m.is_finite() {
        accel = accel.min(stop(speed, constraint.stop_m));
    }
    accel
}

/// Returns the deceleration that stops the vehicle at a line without braking earlier than needed.
fn stop(speed: f32, line_m: f32) -> f32 {
    let gap = line_m + LINE_GAP_M;
    if line_m < 0.3 {
        return if speed > 0.2 {
            -STOP_BRAKE_MPS2.max(speed * speed / 0.6).min(BRAKE_MAX_MPS2)
        } else {
            -0.5
        };
    }
    // Constant deceleration from here to the line once that is close to the comfortable one.
    let needed = speed * speed / (2.0 * line_m);
    if needed > STOP_BRAKE_MPS2 * 0.85 {
        return -needed.min(BRAKE_MAX_MPS2);
    }
    idm(speed, 0.0, gap + 0.5 * speed, LINE_GAP_M, &Driver::MEDIAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::GAP_M;

    #[test]
    fn the_model_keeps_its_equilibrium_gap() {
        let speed = 10.0;
        let at_rest = GAP_M + speed * Driver::MEDIAN.headway_s;
        assert!(idm(speed, speed, at_rest, GAP_M, &Driver::MEDIAN).abs() < 1e-4);
        assert!(idm(speed, speed, at_rest + 1.0, GAP_M, &Driver::MEDIAN) > 0.0);
        assert!(idm(speed, speed, at_rest - 1.0, GAP_M, &Driver::MEDIAN) < 0.0);
    }

    #[test]
    fn the_vehicle_before_the_leader_counts_a_fifth_and_less_at_low_speed() {
        let at = |gap_m: f32, speed_mps: f32| Leader { gap_m, speed_mps, ..Leader::NONE };
        let behind =
            |speed: f32, leaders: [Leader; 2]| follow(speed, &leaders, GAP_M, &Driver::MEDIAN);
        let rest_m = GAP_M + 10.0 * Driver::MEDIAN.headway_s;
        let leader = at(rest_m, 10.0);
        assert!(behind(10.0, [leader, leader]).abs() < 1e-4, "a platoon at its equilibrium");
        let alone = behind(10.0, [leader, Leader::NONE]);
        assert_eq!(alone, idm(10.0, 10.0, rest_m, GAP_M, &Driver::MEDIAN));
        let slower = at(rest_m, 8.0);
        let of_slower = idm(10.0, 8.0, rest_m, GAP_M, &Driver::MEDIAN);
        assert!((behind(10.0, [leader, slower]) - (0.8 * alone + 0.2 * of_slower)).abs() < 1e-4);
        assert_eq!(
            behind(0.0, [at(3.0, 0.0), at(9.0, 4.0)]),
            behind(0.0, [at(3.0, 0.0), Leader::NONE])
        );
    }

    #[test]
    fn a_vehicle_that_is_to_stand_never_accelerates() {
        for speed in [0.0, 0.01, 1.0, 20.0] {
            for desired in [0.0, STANDSTILL_MPS] {
                let accel = free_accel(speed, desired, &Driver::MEDIAN);
                assert!(accel <= 0.0 || speed < desired, "{accel} at {speed} towards {desired}");
                assert!(accel < 0.2, "{accel} at {speed} towards {desired}");
            }
        }
        assert_eq!(free_accel(0.0, 0.0, &Driver::MEDIAN), 0.0);
        assert_eq!(free_accel(0.0, 5.0, &Driver::MEDIAN), Driver::MEDIAN.accel_mps2);
    }

    #[test]
    fn a_follower_never_hits_a_leader_that_brakes_hard() {
        for leader_brakes in [2.0, 4.0, 6.0] {
            let (mut x, mut v, mut leader_x, mut leader_v) = (0.0f32, 15.0f32, 25.0f32, 15.0f32);
            for _ in 0..400 {
                let a = idm(v, leader_v, leader_x - x, GAP_M, &Driver::MEDIAN).min(free_accel(
                    v,
                    15.0,
                    &Driver::MEDIAN,
                ));
                v = (v + 0.05 * a).max(0.0);
                x += 0.05 * v;
                leader_v = (leader_v - 0.05 * leader_brakes).max(0.0);
                leader_x += 0.05 * leader_v;
                assert!(leader_x - x > 0.5, "gap {} at {leader_brakes}", leader_x - x);
            }
            assert!(v < 0.3);
        }
    }

    #[test]
    fn a_vehicle_stops_at_its_line_and_not_far_before() {
        for begin in [5.0f32, 10.0, 15.0, 25.0] {
            let (mut line, mut v) = (begin * begin / 3.0 + 10.0, begin);
            for _ in 0..1200 {
                let a = stop(v, line).min(free_accel(v, begin, &Driver::MEDIAN));
                v = (v + 0.05 * a).max(0.0);
                line -= 0.05 * v;
            }
            assert!((-0.1..1.5).contains(&line), "{line} m before the line, from {begin} m/s");
            assert!(v < 0.1);
        }
    }
}
