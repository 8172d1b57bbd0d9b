//! Throttle, brake and wheel from the acceleration and the steering angle that are wanted.
//!
//! The vehicle has an engine, a gearbox and drag that this room does not know exactly: a rough
//! feed-forward does most, and an integral over the error of acceleration does the rest.

const GRAVITY_MPS2: f32 = 9.81;
/// Acceleration at full throttle from standstill, and how it falls with speed.
const THROTTLE_MPS2: f32 = 5.0;
const THROTTLE_FALL_S: f32 = 20.0;
/// Deceleration at full brake.
const BRAKE_MPS2: f32 = 8.5;
/// Rolling resistance, and air drag at 1 m/s.
const ROLLING_MPS2: f32 = 0.15;
const DRAG_PER_M: f32 = 0.00045;
/// Integral gain, per second.
const INTEGRAL: f32 = 0.8;
/// Bound of the integral, m/s².
const ACCEL_INTEGRAL_MAX: f32 = 2.5;

/// Below this speed an engine that idles in gear pushes against weak brakes, and what is left of the
/// integral from speeding up does too: who means to stop presses them no less than so much.
const CREEP_MPS: f32 = 1.5;
const CREEP_BRAKE: f32 = 0.8;
/// Who wants to slow down like this means to stop.
const FIRM_MPS2: f32 = -1.8;

/// Pedals, each 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pedals {
    pub(crate) throttle: f32,
    pub(crate) brake: f32,
}

/// Pedals for a wanted acceleration; `effort` is the vehicle's integral.
///
/// `speed` and `measured` (acceleration) are along the direction in which it wants to go; `climb`
/// is the sine of the slope in that direction.
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
    // What the engine cannot give is not saved up: it would have to be unlearnt before braking.
    let full = THROTTLE_MPS2 / (1.0 + speed.max(0.0) / THROTTLE_FALL_S);
    *accel_integral = accel_integral.min((full - target - resistance).max(0.0));
    let push = target + *accel_integral + resistance;
    if push >= 0.0 && !firm {
        Pedals { throttle: (push / full).min(1.0), brake: 0.0 }
    } else if target > -0.3 && push > -0.4 {
        // Rolling is brake enough.
        Pedals::default()
    } else {
        let least = if firm { CREEP_BRAKE } else { 0.0 };
        Pedals { throttle: 0.0, brake: (-push / BRAKE_MPS2).clamp(least, 1.0) }
    }
}

/// The wheel, −1 to 1, that turns the front wheels by `angle_rad`, at a speed.
pub(crate) fn steer_input(angle_rad: f32, max_steer_rad: f32, speed: f32) -> f32 {
    (angle_rad / (max_steer_rad * max_steer_factor(speed.abs()))).clamp(-1.0, 1.0)
}

/// How much of the lock is left at speed: the steering curve of CARLA's vehicles.
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
    fn who_cannot_speed_up_as_he_would_like_to_brakes_at_once() {
        // A bicycle far below the limit, for half a minute, and then a curve.
        let mut accel_integral = 0.0;
        for _ in 0..600 {
            press(3.4, 0.3, 10.0, 0.0, 0.05, &mut accel_integral);
        }
        let pedals = press(-3.0, 0.3, 10.0, 0.0, 0.05, &mut accel_integral);
        assert!(pedals.brake > 0.3, "{pedals:?}");
    }

    #[test]
    fn who_stops_at_a_walk_does_not_creep_on() {
        // It has just sped up against a hill, as the integral remembers.
        let mut accel_integral = ACCEL_INTEGRAL_MAX;
        let pedals = press(-2.0, 0.0, 0.8, 0.0, 0.05, &mut accel_integral);
        assert_eq!(pedals.throttle, 0.0);
        assert!(pedals.brake >= CREEP_BRAKE, "{pedals:?}");
    }
}
