//! Commands about how an actor moves, and questions about how it does.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, vehicle::within};

/// See [`crate::Command::Ask`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Ask {
    /// Of whom.
    pub actor_id: ActorId,
    /// One of [`part`].
    pub part: u32,
    /// Which wheel.
    pub index: u32,
    /// Zero.
    pub reserved: u32,
}

/// Values of [`Ask::part`], and what is answered.
pub mod part {
    /// [`crate::VehicleBody`].
    pub const BODY: u32 = 1;
    /// [`crate::VehicleEngine`].
    pub const ENGINE: u32 = 2;
    /// [`crate::VehicleGearbox`].
    pub const GEARBOX: u32 = 3;
    /// [`crate::VehicleSteering`].
    pub const STEERING: u32 = 4;
    /// [`crate::VehicleWheel`].
    pub const WHEEL: u32 = 5;
    /// [`crate::VehicleTelemetry`].
    pub const TELEMETRY: u32 = 6;
    /// [`crate::WheelTelemetry`].
    pub const WHEEL_TELEMETRY: u32 = 7;
    /// [`crate::AckermannSettings`].
    pub const ACKERMANN: u32 = 8;
    /// [`crate::SetBones`]: the given pose, six bones from the one that is asked for on.
    pub const BONES: u32 = 9;
    /// [`crate::BlendPose`].
    pub const BLEND: u32 = 10;
}

/// How a vehicle drives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleTelemetry {
    /// How many wheels it has.
    pub wheels: u32,
    /// −1 reverse, 0 neutral, 1 and up forward.
    pub gear: i32,
    /// Forwards.
    pub speed_mps: f32,
    /// The wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// Pedal, 0 to 1.
    pub throttle: f32,
    /// Pedal, 0 to 1.
    pub brake: f32,
    /// Engine speed, revolutions per minute.
    pub engine_rpm: f32,
    /// What the air holds it back with.
    pub drag_n: f32,
}

/// What one wheel feels, at the end of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WheelTelemetry {
    /// Grip of tyre and ground, as a multiple of the blueprint's own tyre's on dry asphalt.
    pub grip: f32,
    /// Slip angle, positive where the wheel slides to the left.
    pub slip_y_rad: f32,
    /// Rim speed over ground speed, less 1; positive when it spins.
    pub slip_x: f32,
    /// Of the wheel, positive forwards.
    pub spin_radps: f32,
    /// On the ground.
    pub load_n: f32,
    /// On the ground at rest.
    pub rest_load_n: f32,
    /// Of engine and brakes together, positive forwards.
    pub torque_nm: f32,
    /// The tyre's force along the wheel's heading.
    pub along_n: f32,
    /// The tyre's force to the wheel's left.
    pub across_n: f32,
}

/// See [`crate::Command::Ackermann`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AckermannControl {
    /// Who.
    pub actor_id: ActorId,
    /// In the middle of the front axle, positive to the left.
    pub steer_rad: f32,
    /// How fast the wheels turn there; 0: at once.
    pub steer_radps: f32,
    /// Negative: backwards.
    pub speed_mps: f32,
    /// The most acceleration and deceleration; 0: the controller's own limits.
    pub acceleration_mps2: f32,
    /// How fast the wanted acceleration changes at most; 0: at once.
    pub jerk_mps3: f32,
}

impl AckermannControl {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        within("steer_rad", self.steer_rad, -10.0, 10.0)?;
        within("steer_radps", self.steer_radps, -1000.0, 1000.0)?;
        within("speed_mps", self.speed_mps, -400.0, 400.0)?;
        within("acceleration_mps2", self.acceleration_mps2, -1000.0, 1000.0)?;
        within("jerk_mps3", self.jerk_mps3, -1e6, 1e6)
    }
}

/// See [`crate::Command::SetAckermann`]. Gains of the two controllers.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct AckermannSettings {
    /// Whose.
    pub actor_id: ActorId,
    /// From speed to acceleration: proportional, integral, derivative.
    pub speed: [f32; 3],
    /// From acceleration to pedals.
    pub acceleration: [f32; 3],
}

impl Default for AckermannSettings {
    /// CARLA's.
    fn default() -> Self {
        AckermannSettings {
            actor_id: ActorId::NONE,
            speed: [0.15, 0.0, 0.25],
            acceleration: [0.01, 0.0, 0.01],
        }
    }
}

impl AckermannSettings {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        let gains = self.speed.iter().chain(&self.acceleration);
        gains.into_iter().try_for_each(|gain| within("a gain", *gain, 0.0, 1e4))
    }
}

/// See [`crate::Command::ApplyForce`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ApplyForce {
    /// Whom.
    pub actor_id: ActorId,
    /// 0: an impulse, newton seconds and newton metre seconds; 1: a force and a torque for the
    /// next frame, newtons and newton metres.
    pub lasts: u32,
    /// In world space.
    pub linear: [f32; 3],
    /// In world space.
    pub angular: [f32; 3],
    /// 1: `linear` acts at `at_m`; 0: at the centre of mass.
    pub has_point: u32,
    /// In world space.
    pub at_m: [f32; 3],
}

/// See [`crate::Command::SetGravity`], [`crate::Command::SetCollisions`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Switch {
    /// Whose.
    pub actor_id: ActorId,
    /// 1: it has it; 0: not.
    pub on: u32,
}

/// See [`crate::Command::SetWeatherAffectsGrip`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SetWeatherAffectsGrip {
    /// 1: wet roads are slippery; 0: roads grip as if they were dry.
    pub on: u32,
    /// Zero.
    pub reserved: u32,
}
