//! Commands that move an actor, and the responses to queries about its motion.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, range::within};

/// Telemetry of a vehicle at the end of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleTelemetry {
    /// Number of wheels.
    pub wheels: u32,
    /// Gear: −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Speed along the vehicle's x axis.
    pub speed_mps: f32,
    /// Steering wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// Throttle pedal, 0 to 1.
    pub throttle: f32,
    /// Brake pedal, 0 to 1.
    pub brake: f32,
    /// Engine speed, revolutions per minute.
    pub engine_rpm: f32,
    /// Aerodynamic drag force.
    pub drag_n: f32,
}

/// Telemetry of one wheel at the end of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WheelTelemetry {
    /// Friction of tyre and ground relative to the blueprint's tyre on dry asphalt.
    pub grip: f32,
    /// Slip angle, positive when the wheel slides to the left.
    pub slip_y_rad: f32,
    /// Longitudinal slip: rim speed over ground speed, minus 1.
    pub slip_x: f32,
    /// Angular velocity of the wheel, positive when it rolls forwards.
    pub spin_radps: f32,
    /// Vertical load.
    pub load_n: f32,
    /// Vertical load at rest.
    pub rest_load_n: f32,
    /// Sum of the torques of engine and brakes, positive forwards.
    pub torque_nm: f32,
    /// Longitudinal tyre force.
    pub along_n: f32,
    /// Lateral tyre force, positive to the left.
    pub across_n: f32,
    /// Steering angle of this wheel, positive to the left: the inner wheel of a curve turns further
    /// than the outer one.
    pub steer_rad: f32,
}

/// Parameters of [`crate::Command::Ackermann`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AckermannControl {
    /// The actor.
    pub actor_id: ActorId,
    /// Steering angle at the centre of the front axle, positive to the left.
    pub steer_rad: f32,
    /// Rate of change of the steering angle; 0: unlimited.
    pub steer_radps: f32,
    /// Target speed; negative: backwards.
    pub speed_mps: f32,
    /// Largest acceleration and deceleration; 0: the limits of the controller.
    pub acceleration_mps2: f32,
    /// Largest rate of change of the target acceleration; 0: unlimited.
    pub jerk_mps3: f32,
}

impl AckermannControl {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        within("steer_rad", self.steer_rad, -10.0, 10.0)?;
        within("steer_radps", self.steer_radps, -1000.0, 1000.0)?;
        within("speed_mps", self.speed_mps, -400.0, 400.0)?;
        within("acceleration_mps2", self.acceleration_mps2, -1000.0, 1000.0)?;
        within("jerk_mps3", self.jerk_mps3, -1e6, 1e6)
    }
}

/// Parameters of [`crate::Command::SetAckermann`]. Gains of the two PID controllers.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AckermannSettings {
    /// The actor.
    pub actor_id: ActorId,
    /// Speed controller (speed error to acceleration): proportional, integral, derivative.
    pub speed: [f32; 3],
    /// Acceleration controller (acceleration error to pedals): proportional, integral, derivative.
    pub acceleration: [f32; 3],
}

impl Default for AckermannSettings {
    /// The defaults of CARLA.
    fn default() -> Self {
        AckermannSettings {
            actor_id: ActorId::NONE,
            speed: [0.15, 0.0, 0.25],
            acceleration: [0.01, 0.0, 0.01],
        }
    }
}

impl AckermannSettings {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        let gains = self.speed.iter().chain(&self.acceleration);
        gains.into_iter().try_for_each(|gain| within("a gain", *gain, 0.0, 1e4))
    }
}

/// Parameters of [`crate::Command::ApplyForce`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ApplyForce {
    /// The actor.
    pub actor_id: ActorId,
    /// 0: an impulse in N s and N m s; 1: a force and a torque during the next frame, in N and N m.
    pub is_force: u32,
    /// Linear impulse or force in world space.
    pub linear: [f32; 3],
    /// Angular impulse or torque in world space.
    pub angular: [f32; 3],
    /// 1: `linear` acts at `at_m`; 0: at the centre of mass.
    pub has_point: u32,
    /// Point of application in world space.
    pub at_m: [f32; 3],
}

/// Parameters of [`crate::Command::SetGravity`] and [`crate::Command::SetCollisions`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Switch {
    /// The actor.
    pub actor_id: ActorId,
    /// 1: on; 0: off.
    pub on: u32,
}

/// Parameters of [`crate::Command::SetWeatherAffectsGrip`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetWeatherAffectsGrip {
    /// 1: wet roads have less friction; 0: roads have the friction of dry ones.
    pub on: u32,
    /// Reserved; 0.
    pub reserved: u32,
}
