//! Spring, damper, bump stop: from the wheel's place in the body to its load.

use super::model::WheelModel;

/// The bump stop is this many times stiffer than the spring.
const BUMP_STOP_STIFFNESS: f32 = 8.0;
/// No suspension presses harder than this many times its load at rest.
const LOAD_FACTOR_MAX: f32 = 10.0;
/// A damper answers at most this many times the load at rest.
const DAMPER_FACTOR_MAX: f32 = 2.0;

/// Force on the ground. `up_m` is how far the wheel has moved up into the body since rest, and
/// `rate_mps` how fast it does. `shifted_n` is what the anti-roll bar and the links add.
#[inline]
pub(super) fn load_n(wheel: &WheelModel, up_m: f32, rate_mps: f32, shifted_n: f32) -> f32 {
    let rest = wheel.static_load_n;
    let damping = if rate_mps > 0.0 { wheel.bump_damping_nspm } else { wheel.rebound_damping_nspm };
    let limit = DAMPER_FACTOR_MAX * rest;
    let stop = BUMP_STOP_STIFFNESS * wheel.spring_npm * (up_m - wheel.bump_travel_m).max(0.0);
    let spring = rest + wheel.spring_npm * up_m;
    if spring + stop <= 0.0 {
        return 0.0;
    }
    let load = spring + stop + (damping * rate_mps).clamp(-limit, limit) + shifted_n;
    load.clamp(0.0, LOAD_FACTOR_MAX * rest)
}
