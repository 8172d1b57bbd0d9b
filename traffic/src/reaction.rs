//! Reaction of drivers: a leader is perceived late and not exactly, and a start takes time.
//!
//! After the human driver model (Treiber, Kesting and Helbing, Physica A 360, 2006): a driver
//! extrapolates the gap over the reaction time, which compensates the delay of the gap, but not that
//! of the leader's acceleration; here the leader's speed is perceived through a low-pass filter with
//! the reaction time. The gap is estimated with a relative error that varies slowly (a Wiener
//! process with a correlation time of 20 s). The model's anticipation over several vehicles is that
//! over two here: drivers see the brake lights of the vehicle before their leader, which keeps waves
//! from growing as fast as the reaction time alone would let them. A leader that would require more
//! than comfortable braking, or brakes more than comfortably itself, is perceived at once and exactly,
//! and alone: its brake lights and the closing distance are unmistakable.

use crate::{
    drivers::Driver,
    leader::Leader,
    random::{Purpose, unit},
    vehicle_table::Vehicle,
};

/// Correlation time of the error of an estimated gap.
const ERROR_S: f32 = 20.0;
/// Speed from which the error has its full size; a standing vehicle makes none.
const ERROR_MPS: f32 = 5.0;
/// Fraction of the comfortable deceleration from which on a leader is perceived at once.
const ALERT: f32 = 0.7;
/// Speed below which a vehicle stands.
const STANDING_MPS: f32 = 0.2;
/// Target acceleration from which on a standing vehicle may drive.
const GO_MPS2: f32 = 0.05;
/// Gap up to which a vehicle stands in a queue behind its leader.
const QUEUE_M: f32 = 8.0;
/// A vehicle does not close up behind a standing leader by less than this.
const CREEP_M: f32 = 0.25;

/// Returns the leader of a located row and the leader of that leader, `second`, as the driver
/// perceives them. `id` is the leader's actor id; `speed` is that of the vehicle. The gap of the
/// second is the mean of its own and the leader's.
pub(crate) fn perceive(
    vehicle: &mut Vehicle,
    [leader, second]: [Leader; 2],
    id: u32,
    speed: f32,
    driver: &Driver,
    (seed, delta_s): (u64, f32),
) -> [Leader; 2] {
    if driver.gap_error > 0.0 {
        let nth = u64::from(vehicle.error_draws);
        vehicle.error_draws = vehicle.error_draws.wrapping_add(1);
        // Uniform with unit variance.
        let draw = 12f32.sqrt() * (unit(seed, vehicle.id, Purpose::GapError, nth) - 0.5);
        let step = (delta_s / ERROR_S).min(1.0);
        vehicle.gap_error += -step * vehicle.gap_error + (2.0 * step).sqrt() * draw;
    }
    if !leader.gap_m.is_finite() {
        vehicle.seen_leader = 0;
        return [leader, Leader::NONE];
    }
    let closing = (speed - leader.speed_mps).max(0.0);
    let needed_mps2 = closing * closing / (2.0 * (leader.gap_m - 1.0).max(0.1));
    // What the filter lags behind is the leader's deceleration times the reaction time.
    let brakes_hard = vehicle.seen_leader == id
        && vehicle.seen_mps - leader.speed_mps > driver.comfort_brake_mps2 * driver.reaction_s;
    let is_alert = brakes_hard || needed_mps2 > ALERT * driver.comfort_brake_mps2;
    if vehicle.seen_leader != id || is_alert {
        vehicle.seen_leader = id;
        vehicle.seen_mps = leader.speed_mps;
    }
    let part = (delta_s / driver.reaction_s).min(1.0);
    vehicle.seen_mps += part * (leader.speed_mps - vehicle.seen_mps);
    if is_alert {
        return [leader, Leader::NONE];
    }
    let share = (speed.abs() / ERROR_MPS).min(1.0);
    let error = driver.gap_error * vehicle.gap_error.clamp(-2.0, 2.0) * share;
    let gap_m = leader.gap_m * (1.0 + error);
    let mean_m = 0.5 * (gap_m + second.gap_m);
    [Leader { gap_m, speed_mps: vehicle.seen_mps, ..leader }, Leader { gap_m: mean_m, ..second }]
}

/// Returns the target acceleration of a vehicle: while it stands, not before the driver has had the
/// time to start. Behind a leader of a queue that time begins when the leader moves; `gap_m` is the
/// gap that it keeps at a standstill.
pub(crate) fn start(
    vehicle: &mut Vehicle,
    speed: f32,
    accel: f32,
    leader: &Leader,
    gap_m: f32,
    driver: &Driver,
    delta_s: f32,
) -> f32 {
    if speed.abs() > STANDING_MPS {
        vehicle.start_s = f32::INFINITY;
        return accel;
    }
    let is_behind = leader.gap_m < QUEUE_M && leader.speed_mps >= STANDING_MPS;
    let leader_stands = leader.gap_m < gap_m + CREEP_M && leader.speed_mps < STANDING_MPS;
    if leader_stands || (accel <= GO_MPS2 && !is_behind) {
        vehicle.start_s = 0.0;
        return accel.min(0.0);
    }
    if accel <= GO_MPS2 {
        // The leader moves and the gap is still too small: the driver is ready meanwhile.
        vehicle.start_s += delta_s;
        return accel;
    }
    vehicle.start_s += delta_s;
    let start_s = if is_behind { driver.follow_start_s } else { driver.start_s };
    if vehicle.start_s < start_s { 0.0 } else { accel }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(vehicle: &mut Vehicle, leader: Leader, driver: &Driver) -> Leader {
        perceive(vehicle, [leader, Leader::NONE], 7, 10.0, driver, (1, 0.05))[0]
    }

    #[test]
    fn a_leader_is_seen_late_unless_it_is_dangerous() {
        let mut vehicle = Vehicle::new(1);
        let leader = |speed_mps: f32, gap_m: f32| Leader { gap_m, speed_mps, ..Leader::NONE };
        let driver = Driver { reaction_s: 1.0, ..Driver::MEDIAN };
        assert_eq!(seen(&mut vehicle, leader(10.0, 20.0), &driver), leader(10.0, 20.0));
        for _ in 0..20 {
            seen(&mut vehicle, leader(8.0, 20.0), &driver);
        }
        let after_a_second = seen(&mut vehicle, leader(8.0, 20.0), &driver).speed_mps;
        assert!((8.6..8.8).contains(&after_a_second), "{after_a_second}");
        assert_eq!(seen(&mut vehicle, leader(1.0, 10.0), &driver), leader(1.0, 10.0));
        let mut vehicle = Vehicle::new(1);
        seen(&mut vehicle, leader(10.0, 60.0), &driver);
        assert_eq!(
            seen(&mut vehicle, leader(7.0, 60.0), &driver),
            leader(7.0, 60.0),
            "it brakes hard"
        );
    }

    #[test]
    fn the_second_leader_has_the_mean_gap_unless_the_first_is_dangerous() {
        let leader = |speed_mps: f32, gap_m: f32| Leader { gap_m, speed_mps, ..Leader::NONE };
        let both = |first: Leader, second: Leader| {
            let mut vehicle = Vehicle::new(1);
            perceive(&mut vehicle, [first, second], 7, 10.0, &Driver::MEDIAN, (1, 0.05))
        };
        let [first, second] = [leader(10.0, 20.0), leader(8.0, 12.0)];
        assert_eq!(both(first, second), [first, leader(8.0, 16.0)]);
        assert_eq!(both(leader(1.0, 10.0), second), [leader(1.0, 10.0), Leader::NONE]);
        assert_eq!(both(first, Leader::NONE)[1].gap_m, f32::INFINITY);
        assert_eq!(both(Leader::NONE, second), [Leader::NONE; 2]);
    }

    #[test]
    fn the_error_of_a_gap_has_its_deviation_and_varies_slowly() {
        let mut vehicle = Vehicle::new(1);
        let driver = Driver { gap_error: 0.1, ..Driver::MEDIAN };
        let leader = Leader { gap_m: 20.0, speed_mps: 10.0, ..Leader::NONE };
        let errors: Vec<f32> =
            (0..200_000).map(|_| seen(&mut vehicle, leader, &driver).gap_m / 20.0 - 1.0).collect();
        let deviation =
            (errors.iter().map(|error| error * error).sum::<f32>() / errors.len() as f32).sqrt();
        assert!((0.07..0.12).contains(&deviation), "{deviation}");
        let step = errors.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        assert!(step < 0.02, "{step}");
    }

    #[test]
    fn a_standing_vehicle_starts_after_its_time() {
        let mut vehicle = Vehicle::new(1);
        let driver = Driver { start_s: 1.0, ..Driver::MEDIAN };
        let mut frames = 0;
        while start(&mut vehicle, 0.0, 1.5, &Leader::NONE, 2.0, &driver, 0.05) == 0.0 {
            frames += 1;
            assert!(frames < 100);
        }
        assert!((18..=20).contains(&frames), "{frames}");
        assert_eq!(start(&mut vehicle, 3.0, 1.5, &Leader::NONE, 2.0, &driver, 0.05), 1.5);
        assert_eq!(
            start(&mut vehicle, 0.0, -1.0, &Leader::NONE, 2.0, &driver, 0.05),
            -1.0,
            "a stop"
        );
        assert_eq!(
            start(&mut vehicle, 0.0, 1.5, &Leader::NONE, 2.0, &driver, 0.05),
            0.0,
            "and a start again"
        );
    }
}
