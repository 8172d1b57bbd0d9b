//! The Ackermann controller: two cascaded PID controllers from a target speed and steering angle to
//! the pedals, as in CARLA.
//!
//! ```text
//! target speed ──▶ PID ──▶ target acceleration ──▶ PID ──▶ pedals
//! ```
//!
//! Both are incremental: each output is added to the previous one. They run once per substep, as
//! CARLA's run once per frame of the same length; a longer substep counts for more.

use protocol::{AckermannControl, AckermannSettings};
use serde::{Deserialize, Serialize};

use super::pedals::Pedals;

/// Cycle time for which the gains are defined. Seconds.
const CYCLE_S: f32 = 0.01;
/// Below this speed a vehicle with target speed 0 is held by its brakes.
const STANDING_MPS: f32 = 0.1;
const ACCELERATION_MAX_MPS2: f32 = 3.0;
const DECELERATION_MAX_MPS2: f32 = 8.0;
/// Gain of the low-pass filter of the measured acceleration, per substep.
const FILTER_GAIN: f32 = 0.2;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Pid {
    gains: [f32; 3],
    integral: f32,
    last: Option<f32>,
}

impl Pid {
    fn run(&mut self, target: f32, measured: f32, dt: f32) -> f32 {
        let [p, i, d] = self.gains;
        let error = target - measured;
        self.integral = (self.integral + i * error * dt).clamp(-1.0, 1.0);
        let rate = (measured - self.last.unwrap_or(measured)) / dt;
        self.last = Some(measured);
        (p * error + self.integral - d * rate).clamp(-1.0, 1.0)
    }

    fn reset(&mut self) {
        *self = Pid { gains: self.gains, ..Pid::default() };
    }
}

/// The target that the last command set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Target {
    steer_rad: f32,
    steer_radps: f32,
    speed_mps: f32,
    acceleration_mps2: f32,
    jerk_mps3: f32,
}

/// The cascaded speed controller of one vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Ackermann {
    /// The target; `None` while the controller is inactive.
    target: Option<Target>,
    speed: Pid,
    acceleration: Pid,
    speed_mps: f32,
    acceleration_mps2: f32,
    target_mps2: f32,
    /// Throttle from 0 to 1, or brake from −1 to 0.
    pedal: f32,
    steer_rad: f32,
}

impl Ackermann {
    pub(super) fn new() -> Ackermann {
        let mut new = Ackermann {
            target: None,
            speed: Pid::default(),
            acceleration: Pid::default(),
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            target_mps2: 0.0,
            pedal: 0.0,
            steer_rad: 0.0,
        };
        new.set(&AckermannSettings::default());
        new
    }

    pub(super) fn set(&mut self, settings: &AckermannSettings) {
        self.speed.gains = settings.speed;
        self.acceleration.gains = settings.acceleration;
    }

    pub(super) fn settings(&self) -> AckermannSettings {
        let (speed, acceleration) = (self.speed.gains, self.acceleration.gains);
        AckermannSettings { speed, acceleration, ..AckermannSettings::default() }
    }

    /// Sets a new target. The filters start from the vehicle's own `speed_mps` and `steer_rad`.
    pub(super) fn set_target(
        &mut self,
        control: &AckermannControl,
        speed_mps: f32,
        steer_rad: f32,
    ) {
        if self.target.is_none() {
            self.reset();
            (self.speed_mps, self.acceleration_mps2) = (speed_mps, 0.0);
            self.steer_rad = steer_rad;
        }
        self.target = Some(Target {
            steer_rad: control.steer_rad,
            steer_radps: control.steer_radps.abs(),
            speed_mps: control.speed_mps,
            acceleration_mps2: control.acceleration_mps2.abs(),
            jerk_mps3: control.jerk_mps3.abs(),
        });
    }

    /// Deactivates the controller.
    pub(super) fn release(&mut self) {
        self.target = None;
    }

    fn reset(&mut self) {
        self.speed.reset();
        self.acceleration.reset();
        (self.target_mps2, self.pedal) = (0.0, 0.0);
    }

    /// Sets the pedals; called once per substep. `steer_max_rad` is the steering limit at this
    /// speed.
    pub(super) fn drive(
        &mut self,
        pedals: &mut Pedals,
        forward_mps: f32,
        steer_max_rad: f32,
        dt: f32,
    ) {
        let Some(target) = self.target else { return };
        let newest_mps2 = (forward_mps - self.speed_mps) / dt;
        self.acceleration_mps2 += FILTER_GAIN * (newest_mps2 - self.acceleration_mps2);
        self.speed_mps = forward_mps;

        let change = target.steer_rad - self.steer_rad;
        let limit_step = if target.steer_radps < 1e-3 { f32::MAX } else { target.steer_radps * dt };
        self.steer_rad += change.clamp(-limit_step, limit_step);
        pedals.steer = (self.steer_rad / steer_max_rad.max(1e-3)).clamp(-1.0, 1.0);
        pedals.handbrake = false;
        pedals.manual = None;

        let is_standing = forward_mps.abs() < STANDING_MPS;
        if is_standing && target.speed_mps.abs() < STANDING_MPS {
            self.reset();
            (pedals.throttle, pedals.brake, pedals.reverse) = (0.0, 1.0, false);
            return;
        }
        // A change of direction requires a stop.
        if is_standing && pedals.reverse != (target.speed_mps < 0.0) {
            self.reset();
            pedals.reverse = target.speed_mps < 0.0;
        }
        let direction = if pedals.reverse { -1.0 } else { 1.0 };
        let speed_mps = forward_mps * direction;
        let target_mps = (target.speed_mps * direction).max(0.0);

        let cycles = dt / CYCLE_S;
        let limit =
            if target.acceleration_mps2 > 0.0 { target.acceleration_mps2 } else { f32::MAX };
        let increment = self.speed.run(target_mps, speed_mps, dt) * cycles;
        let limit_step = if target.jerk_mps3 > 0.0 { target.jerk_mps3 * dt } else { f32::MAX };
        self.target_mps2 = (self.target_mps2 + increment.clamp(-limit_step, limit_step))
            .clamp(-limit.min(DECELERATION_MAX_MPS2), limit.min(ACCELERATION_MAX_MPS2));
        let measured = self.acceleration_mps2 * direction;
        let increment = self.acceleration.run(self.target_mps2, measured, dt) * cycles;
        self.pedal = (self.pedal + increment).clamp(-1.0, 1.0);
        pedals.throttle = self.pedal.max(0.0);
        pedals.brake = (-self.pedal).max(0.0);
    }
}
