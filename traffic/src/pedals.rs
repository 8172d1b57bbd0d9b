//! Throttle, brake and steering inputs from the target acceleration and steering angle.
//!
//! The planner does not know engine, gearbox and drag exactly: an approximate feed-forward is
//! corrected by an integral of the acceleration error.

const GRAVITY_MPS2: f32 = 9.81;
/// Acceleration at full throttle from standstill.
const THROTTLE_MPS2: f32 = 5.0;
/// Speed, in metres per second, at which full throttle gives half of that.
const THROTTLE_HALF_MPS: f32 = 20.0;
/// Deceleration at full brake.
const BRAKE_MPS2: f32 = 8.5;
/// Rolling resistance.
const ROLLING_MPS2: f32 = 0.15;
/// Air drag at 1 m/s.
const DRAG_PER_M: f32 = 0.00045;
/// Integral gain, per second.
const INTEGRAL: f32 = 0.8;
/// Bound of the integral, m/s².
const ACCEL_INTEGRAL_MAX: f32 = 2.5;

/// Below this speed an idling engine in gear, and what is left of the integral after accelerating,
/// push against a weak brake: a stopping vehicle brakes with at least `CREEP_BRAKE`.
const CREEP_MPS: f32 = 1.5;
/// Least brake of a vehicle that stops from below [`CREEP_MPS`].
const CREEP_BRAKE: f32 = 0.8;
/// Target acceleration from which on down a vehicle brakes: what its engine lacked before does not count.
const BRAKING_MPS2: f32 = -1.0;
/// Target acceleration below which a vehicle is stopping.
const FIRM_MPS2: f32 = -1.8;

/// Pedal positions, each 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pedals {
    pub(crate) throttle: f32,
    pub(crate) brake: f32,
}

/// Returns the pedals for a target acceleration; `accel_integral` is the integral term of the
/// vehicle.
///
/// `speed` and `measured` (acceleration) are along the direction of travel; `pitch_sin` is the sine
/// of the slope in that direction.
pub(crate) fn press(
    target: f32,
    measured: f32,
    speed: f32,
    pitch_sin: f32,
    delta_s: f32,
    accel_integral: &mut f32,
) -> Pedals {
    if speed < 0.3 && target <= 0.05 {
        *accel_integral = 0.0;
        return Pedals { throttle: 0.0, brake: 0.7 };
    }
    let firm = target < FIRM_MPS2 && speed < CREEP_MPS;
    let error = (target - measured).clamp(-2.0, 2.0);
    *accel_integral = (*accel_integral + INTEGRAL * error * delta_s)
        .clamp(-ACCEL_INTEGRAL_MAX, ACCEL_INTEGRAL_MAX);
    let resistance = ROLLING_MPS2 + DRAG_PER_M * speed * speed + GRAVITY_MPS2 * pitch_sin;
    // Anti-windup: what the engine cannot deliver is not integrated, because it would delay
    // braking.
    let full = THROTTLE_MPS2 / (1.0 + speed.max(0.0) / THROTTLE_HALF_MPS);
    *accel_integral = accel_integral.min((full - target - resistance).max(0.0));
    if target < BRAKING_MPS2 {
        // An engine weaker than the assumed one, as a cyclist is, has filled the integral.
        *accel_integral = accel_integral.min(0.0);
    }
    let push = target + *accel_integral + resistance;
    if push >= 0.0 && !firm {
        Pedals { throttle: (push / full).min(1.0), brake: 0.0 }
    } else if target > -0.3 && push > -0.4 {
        // Drag alone decelerates enough.
        Pedals::default()
    } else {
        let least = if firm { CREEP_BRAKE } else { 0.0 };
        Pedals { throttle: 0.0, brake: (-push / BRAKE_MPS2).clamp(least, 1.0) }
    }
}

/// Returns the acceleration along the direction of travel that pedals give on level ground: the
/// inverse of [`press`] without its integral.
pub(crate) fn acceleration(throttle: f32, brake: f32, speed: f32) -> f32 {
    let full = THROTTLE_MPS2 / (1.0 + speed.max(0.0) / THROTTLE_HALF_MPS);
    let resistance = ROLLING_MPS2 + DRAG_PER_M * speed * speed;
    throttle * full - brake * BRAKE_MPS2 - resistance
}

/// Returns the angle of the front wheels at a steering input: the inverse of [`steer_input`].
pub(crate) fn wheel_angle_rad(input: f32, max_steer_rad: f32, speed: f32) -> f32 {
    input * max_steer_rad * max_steer_factor(speed.abs())
}

/// Returns the steering input, −1 to 1, that turns the front wheels by `angle_rad` at a speed.
pub(crate) fn steer_input(angle_rad: f32, max_steer_rad: f32, speed: f32) -> f32 {
    (angle_rad / (max_steer_rad * max_steer_factor(speed.abs()))).clamp(-1.0, 1.0)
}

/// Returns the fraction of the steering angle that is available at a speed: the steering curve of
/// CARLA's vehicles.
fn max_steer_factor(speed: f32) -> f32 {
    let curve = [(0.0, 1.0), (5.6, 0.9), (16.7, 0.8), (33.3, 0.7)];
    for pair in curve.windows(2) {
        let ((from, high), (to, low)) = (pair[0], pair[1]);
        if speed <= to {
            return high + (low - high) * (speed - from) / (to - from);
        }
    }
    0.7
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pedals_and_steering_have_inverses() {
        for speed in [1.0, 8.0, 20.0] {
            for target in [-4.0, -1.0, 0.5, 1.5] {
                let pedals = press(target, target, speed, 0.0, 0.05, &mut 0.0);
                let got = acceleration(pedals.throttle, pedals.brake, speed);
                // A firm stop brakes harder, and resistance is not subtracted from braking.
                assert!((got - target).abs() < 0.4 || got < target, "{target} {got}");
            }
            let input = steer_input(0.2, 0.61, speed);
            assert!((wheel_angle_rad(input, 0.61, speed) - 0.2).abs() < 1e-6);
        }
    }

    #[test]
    fn unreachable_acceleration_does_not_delay_braking() {
        // A bicycle far below the limit for half a minute, and then a curve.
        let mut accel_integral = 0.0;
        for _ in 0..600 {
            press(3.4, 0.3, 10.0, 0.0, 0.05, &mut accel_integral);
        }
        let pedals = press(-3.0, 0.3, 10.0, 0.0, 0.05, &mut accel_integral);
        assert!(pedals.brake > 0.3, "{pedals:?}");
    }

    #[test]
    fn a_weak_engine_does_not_delay_braking() {
        // A cyclist reaches a constant speed with half of the pedal that the planner assumes for it.
        let mut accel_integral = 0.0;
        for _ in 0..400 {
            let pedals = press(0.3, 0.0, 4.9, 0.0, 0.05, &mut accel_integral);
            assert_eq!(pedals.brake, 0.0);
        }
        let pedals = press(-2.0, 0.0, 4.9, 0.0, 0.05, &mut accel_integral);
        assert!(pedals.brake > 0.2, "{pedals:?}");
    }

    #[test]
    fn a_vehicle_that_stops_at_walking_speed_does_not_creep() {
        // The vehicle has just accelerated uphill, which filled the integral.
        let mut accel_integral = ACCEL_INTEGRAL_MAX;
        let pedals = press(-2.0, 0.0, 0.8, 0.0, 0.05, &mut accel_integral);
        assert_eq!(pedals.throttle, 0.0);
        assert!(pedals.brake >= CREEP_BRAKE, "{pedals:?}");
    }
}
