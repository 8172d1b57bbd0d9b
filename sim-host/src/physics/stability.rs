//! Electronic stability control: brakes single wheels so that the vehicle turns as its driver
//! steers.
//!
//! The reference is the yaw rate of the linear bicycle model in a steady curve, `v·tan δ / (L +
//! K·v²)`, after the lag of a car and within the friction of its tyres (van Zanten, Bosch ESP
//! Systems: 5 Years of Experience, SAE 2000-01-1633; Rajamani, Vehicle Dynamics and Control, 2nd
//! ed., section 8.2). A vehicle that turns further brakes its outer front wheel, one that turns
//! less its inner rear wheel. The engine's power is reduced meanwhile.
//!
//! A rider of a two-wheeler corrects the same difference with the handlebar, as far as it goes
//! without a torque: with an unloaded rear wheel, two wheels in line are unstable in yaw above a
//! critical speed (Rajamani, ibid., section 3.3), which hard braking lowers to about 40 km/h.

use serde::{Deserialize, Serialize};

use super::{
    model::{GRAVITY_MPS2, VehicleModel, WheelModel},
    motion::Motion,
};

/// Slowest speed at which the control acts.
const ABOVE_MPS: f32 = 4.0;
/// Lag of a car's yaw rate after its steering.
pub(super) const LAG_S: f32 = 0.12;
/// Fraction of the tyres' friction that the reference uses.
const FRICTION_SHARE: f32 = 0.92;
/// Differences of yaw rate and slip angles below which the control does not act.
const YAW_FREE_RADPS: f32 = 0.07;
const SLIP_FREE_RAD: f32 = 0.07;
/// Wanted yaw acceleration per difference of yaw rate.
const YAW_GAIN_PER_S: f32 = 12.0;
/// Difference of yaw rate that counts as much as a radian of slip angle.
const SLIP_GAIN_PER_S: f32 = 2.5;
/// Fraction of the brake's torque for a vehicle that turns less than it should.
const INNER_SHARE: f32 = 0.4;
/// Difference of yaw rate at which the engine's power is cut.
const CUT_RADPS: f32 = 0.25;
/// Steering angle of a rider per difference of yaw rate.
const RIDER_GAIN_S: f32 = 0.15;
/// Largest steering angle of that correction.
const RIDER_MAX_RAD: f32 = 0.35;

/// What the control needs to know of a model.
#[derive(Debug)]
pub(super) struct StabilityModel {
    wheelbase_m: f32,
    /// Increase of the steering angle per lateral acceleration. Radian seconds squared per metre.
    understeer: f32,
    /// Peak lateral friction coefficient of the tyres.
    pub grip: f32,
    half_track_m: f32,
    radius_m: f32,
    /// Largest brake torque of a wheel that is steered, and of one that is not.
    brake_nm: [f32; 2],
    yaw_inertia_kgm2: f32,
}

impl StabilityModel {
    pub(super) fn new(model: &VehicleModel, wheelbase_m: f32) -> StabilityModel {
        // Load of an axle divided by its cornering stiffness.
        let compliance = |steered: bool| {
            let axle = || model.wheels.iter().filter(move |wheel| wheel.steered == steered);
            let load_n: f32 = axle().map(|wheel| wheel.static_load_n).sum();
            let stiffness: f32 =
                axle().map(|wheel| wheel.tyre.stiffness_y * wheel.static_load_n).sum();
            load_n / stiffness.max(1.0)
        };
        let most = |value: fn(&WheelModel) -> f32, steered: bool| {
            let wheels = model.wheels.iter().filter(|wheel| wheel.steered == steered);
            wheels.map(value).fold(0.0, f32::max)
        };
        StabilityModel {
            wheelbase_m,
            understeer: ((compliance(true) - compliance(false)) / GRAVITY_MPS2).max(0.0),
            grip: model.wheels.iter().map(|wheel| wheel.tyre.grip_y).fold(10.0, f32::min),
            half_track_m: most(|wheel| wheel.hub_m.y.abs(), false).max(0.3),
            radius_m: most(|wheel| wheel.radius_m, false).max(0.1),
            brake_nm: [true, false].map(|steered| most(|w| w.brake_torque_nm, steered)),
            yaw_inertia_kgm2: model.inertia_kgm2.z,
        }
    }
}

impl StabilityModel {
    /// Returns the yaw rate of the linear bicycle model in a steady curve, within the friction of
    /// the tyres. `friction` is a factor on it.
    pub(super) fn steady_yaw_radps(&self, steer_rad: f32, forward_mps: f32, friction: f32) -> f32 {
        let steady = forward_mps * steer_rad.tan()
            / (self.wheelbase_m + self.understeer * forward_mps * forward_mps);
        let speed = forward_mps.abs().max(0.1);
        let most = FRICTION_SHARE * self.grip * friction * GRAVITY_MPS2 / speed;
        steady.clamp(-most, most)
    }
}

/// What the control does: brake torques on the left wheel, or if negative on the right one, and the
/// fraction of the throttle that remains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Intervention {
    pub front_nm: f32,
    pub rear_nm: f32,
    pub throttle: f32,
}

impl Intervention {
    pub(super) const NONE: Intervention =
        Intervention { front_nm: 0.0, rear_nm: 0.0, throttle: 1.0 };
}

/// The state of the control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Stability {
    /// The yaw rate that the driver's steering asks for.
    reference_radps: f32,
}

impl Stability {
    /// Sets the yaw rate from which the reference continues.
    pub(super) fn set_reference(&mut self, yaw_radps: f32) {
        self.reference_radps = yaw_radps;
    }

    /// Advances the reference and returns the intervention. `friction` is a factor on the friction
    /// of the tyres.
    pub(super) fn regulate(
        &mut self,
        model: &StabilityModel,
        steer_rad: f32,
        motion: &Motion,
        friction: f32,
        dt: f32,
    ) -> Intervention {
        let Some(error) = self.advance(model, steer_rad, motion, friction, dt) else {
            return Intervention::NONE;
        };
        let velocity = motion.axes.transpose() * motion.velocity_mps;
        let yaw_radps = motion.spin_radps.dot(motion.axes.z_axis);
        let slip_rad = (velocity.y / velocity.x).atan();
        let excess =
            beyond(error, YAW_FREE_RADPS) - SLIP_GAIN_PER_S * beyond(slip_rad, SLIP_FREE_RAD);
        if excess == 0.0 {
            return Intervention::NONE;
        }
        let wanted_nm = -excess * YAW_GAIN_PER_S * model.yaw_inertia_kgm2;
        let torque_nm = wanted_nm / model.half_track_m * model.radius_m;
        let throttle = (1.0 - excess.abs() / CUT_RADPS).max(0.0);
        let [front_most, rear_most] = model.brake_nm;
        if excess * yaw_radps > 0.0 {
            let front_nm = torque_nm.clamp(-front_most, front_most);
            Intervention { front_nm, rear_nm: 0.0, throttle }
        } else {
            let rear_most = INNER_SHARE * rear_most;
            let rear_nm = torque_nm.clamp(-rear_most, rear_most);
            Intervention { front_nm: 0.0, rear_nm, throttle }
        }
    }

    /// Advances the reference and returns the steering angle by which the rider of a two-wheeler
    /// corrects the yaw rate, positive to the left. `steer_rad` is without that correction.
    pub(super) fn counter_steer(
        &mut self,
        model: &StabilityModel,
        steer_rad: f32,
        motion: &Motion,
        friction: f32,
        dt: f32,
    ) -> f32 {
        let error = self.advance(model, steer_rad, motion, friction, dt).unwrap_or(0.0);
        (-RIDER_GAIN_S * error).clamp(-RIDER_MAX_RAD, RIDER_MAX_RAD)
    }

    /// Advances the reference towards that of a steady curve and returns the difference of the yaw rate from
    /// it; `None` below the speed from which on it counts.
    fn advance(
        &mut self,
        model: &StabilityModel,
        steer_rad: f32,
        motion: &Motion,
        friction: f32,
        dt: f32,
    ) -> Option<f32> {
        let forward_mps = motion.velocity_mps.dot(motion.axes.x_axis);
        let yaw_radps = motion.spin_radps.dot(motion.axes.z_axis);
        if forward_mps < ABOVE_MPS {
            self.reference_radps = yaw_radps;
            return None;
        }
        let steady = model.steady_yaw_radps(steer_rad, forward_mps, friction);
        self.reference_radps += (steady - self.reference_radps) * dt / (LAG_S + dt);
        Some(yaw_radps - self.reference_radps)
    }
}

/// Returns the part of `value` beyond ±`free`.
fn beyond(value: f32, free: f32) -> f32 {
    value - value.clamp(-free, free)
}
