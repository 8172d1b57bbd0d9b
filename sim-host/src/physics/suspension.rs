//! Spring, damper, bump stop: from the wheels' places in the body to their loads.

use super::{
    lanes::{Lanes, select},
    model::WheelModel,
};

/// The bump stop is this many times stiffer than the spring.
const BUMP_STOP_STIFFNESS: f32 = 8.0;
/// No suspension presses harder than this many times its load at rest.
const LOAD_FACTOR_MAX: f32 = 10.0;
/// A damper answers at most this many times the load at rest.
const DAMPER_FACTOR_MAX: f32 = 2.0;

/// Four suspensions.
#[derive(Debug)]
pub(super) struct Suspensions {
    pub rest_n: Lanes,
    spring_npm: Lanes,
    bump_nspm: Lanes,
    rebound_nspm: Lanes,
    travel_m: Lanes,
    /// How far below rest the springs are slack; negative.
    pub droop_m: Lanes,
}

impl Suspensions {
    pub(super) fn new(wheels: [&WheelModel; 4]) -> Suspensions {
        let lanes = |value: fn(&WheelModel) -> f32| Lanes::new(wheels.map(value));
        Suspensions {
            rest_n: lanes(|w| w.static_load_n),
            spring_npm: lanes(|w| w.spring_npm),
            bump_nspm: lanes(|w| w.bump_damping_nspm),
            rebound_nspm: lanes(|w| w.rebound_damping_nspm),
            travel_m: lanes(|w| w.bump_travel_m),
            droop_m: lanes(|w| -w.static_load_n / w.spring_npm),
        }
    }

    /// Force on the ground. `up_m` is how far the wheel has moved up into the body since rest, and
    /// `rate_mps` how fast it does. `shifted_n` is what the anti-roll bar and the links add.
    #[inline]
    pub(super) fn load_n(&self, up_m: Lanes, rate_mps: Lanes, shifted_n: Lanes) -> Lanes {
        let bumping = rate_mps.simd_gt(Lanes::ZERO);
        let damping = select(bumping, self.bump_nspm, self.rebound_nspm);
        let limit = self.rest_n * DAMPER_FACTOR_MAX;
        let stop =
            self.spring_npm * (up_m - self.travel_m).fast_max(Lanes::ZERO) * BUMP_STOP_STIFFNESS;
        let spring = self.rest_n + self.spring_npm * up_m + stop;
        let damper = (damping * rate_mps).fast_max(-limit).fast_min(limit);
        let load = (spring + damper + shifted_n)
            .fast_max(Lanes::ZERO)
            .fast_min(self.rest_n * LOAD_FACTOR_MAX);
        // A slack spring's damper holds nothing.
        select(spring.simd_gt(Lanes::ZERO), load, Lanes::ZERO)
    }
}
