//! Pedals and wheel of a vehicle.

use protocol::{ActorId, flag};

/// Pedals and wheel of one vehicle; the latest that was sent holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VehicleControl {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Accelerator pedal, 0 to 1.
    pub throttle: f32,
    /// Brake pedal, 0 to 1.
    pub brake: f32,
    /// Steering wheel, −1 (full right) to 1 (full left).
    pub steer: f32,
    /// Whether the handbrake is on.
    pub handbrake: bool,
    /// Whether the automatic gearbox drives backwards.
    pub reverse: bool,
    /// −1 reverse, 0 neutral, 1 and up forward; `None` shifts automatically.
    pub gear: Option<i32>,
}

impl From<VehicleControl> for protocol::VehicleControl {
    fn from(control: VehicleControl) -> protocol::VehicleControl {
        let VehicleControl { actor_id, throttle, brake, steer, handbrake, reverse, gear } = control;
        let bit = |is_set, bit| if is_set { bit } else { 0 };
        protocol::VehicleControl {
            actor_id,
            flags: bit(handbrake, flag::HANDBRAKE) | bit(reverse, flag::REVERSE),
            throttle,
            brake,
            steer,
            gear: gear.unwrap_or_default(),
            manual_gear: gear.is_some().into(),
            lamps: 0,
        }
    }
}
