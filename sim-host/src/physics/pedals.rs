//! The driver's controls of a vehicle.

use protocol::{VehicleControl, flag};
use serde::{Deserialize, Serialize};

/// The controls of a vehicle, in their ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Pedals {
    pub throttle: f32,
    pub brake: f32,
    pub steer: f32,
    pub handbrake: bool,
    pub reverse: bool,
    pub manual: Option<i32>,
}

impl Pedals {
    /// Clamps the controls to their ranges; NaN becomes 0.
    pub(super) fn new(control: &VehicleControl) -> Pedals {
        let cut = |value: f32, low: f32| if value.is_nan() { 0.0 } else { value.clamp(low, 1.0) };
        Pedals {
            throttle: cut(control.throttle, 0.0),
            brake: cut(control.brake, 0.0),
            steer: cut(control.steer, -1.0),
            handbrake: control.flags & flag::HANDBRAKE != 0,
            reverse: control.flags & flag::REVERSE != 0,
            manual: (control.manual_gear != 0).then_some(control.gear),
        }
    }
}
