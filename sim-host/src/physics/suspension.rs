//! Suspensions: spring, damper and bump stop, from wheel travel to wheel load.

use super::{
    lanes::{Lanes, select},
    model::WheelModel,
};

/// Stiffness of the bump stop as a multiple of the spring's.
const BUMP_STOP_STIFFNESS: f32 = 8.0;
/// Largest wheel load as a multiple of the static load.
const LOAD_FACTOR_MAX: f32 = 10.0;
/// Largest damper force as a multiple of the static load.
const DAMPER_FACTOR_MAX: f32 = 2.0;

/// The suspensions of up to four wheels.
#[derive(Debug)]
pub(super) struct Suspensions {
    /// Load of the spring with the hub in its place.
    pub rest_n: Lanes,
    spring_npm: Lanes,
    bump_nspm: Lanes,
    rebound_nspm: Lanes,
    travel_m: Lanes,
    /// Travel at which the springs are slack; negative, measured from the hub's place.
    pub droop_m: Lanes,
}

impl Suspensions {
    pub(super) fn new(wheels: [&WheelModel; 4]) -> Suspensions {
        let lanes = |value: fn(&WheelModel) -> f32| Lanes::new(wheels.map(value));
        Suspensions {
            rest_n: lanes(|w| w.static_load_n - w.spring_npm * w.stance_m),
            spring_npm: lanes(|w| w.spring_npm),
            bump_nspm: lanes(|w| w.bump_damping_nspm),
            rebound_nspm: lanes(|w| w.rebound_damping_nspm),
            travel_m: lanes(|w| w.bump_travel_m),
            droop_m: lanes(|w| w.stance_m - w.static_load_n / w.spring_npm),
        }
    }

    /// Returns the wheel load. `up_m` is the compression from the hub's place, `rate_mps` its rate, and
    /// `shifted_n` the load that the anti-roll bar and the links add.
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
        // The damper of a slack spring carries no load.
        select(spring.simd_gt(Lanes::ZERO), load, Lanes::ZERO)
    }
}
