//! Drivers: what differs between the vehicles of one traffic.
//!
//! | property | median | spread at 1 | bounds |
//! |---|---|---|---|
//! | desired speed by limit | 1 | normal, 0.07 | 0.85 to 1.1 |
//! | time headway T, s | 1.15 | log-normal, 0.2 | 0.8 to 2.2 |
//! | acceleration a, m/s² | 1.9 | log-normal, 0.15 | 1.3 to 2.6 |
//! | comfortable deceleration b, m/s² | 2 | log-normal, 0.15 | 1.5 to 2.8 |
//! | reaction time, s | 0.6 | log-normal, 0.25 | 0.3 to 1.1 |
//! | time to start after a stop, s | 0.85 | log-normal, 0.25 | 0.4 to 1.6 |
//! | courtesy in lane changes p | 0.3 | normal, 0.15 | 0 to 0.8 |
//!
//! The parameters are those of the IDM (Treiber and Kesting, Traffic Flow Dynamics, 2013, chapter
//! 11) and of MOBIL (Kesting, Treiber and Helbing 2007). The human driver model (Treiber, Kesting
//! and Helbing, Physica A 360, 2006) adds the reaction time and the slowly varying error of the
//! estimated gap: see [`crate::reaction`]. The medians are chosen such that capacity, backward waves
//! and the discharge of queues agree with the field (Highway Capacity Manual: a base saturation flow
//! of 1900 vehicles per hour and lane, a start-up lost time of about 2 s).

use mesh::RandomStream;

use crate::random::{Purpose, stream};

/// What distinguishes one driver from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Driver {
    /// Desired speed as a fraction of the speed limit.
    pub(crate) speed_factor: f32,
    /// Desired time headway (IDM parameter T), seconds.
    pub(crate) headway_s: f32,
    /// Maximum acceleration (IDM parameter a).
    pub(crate) accel_mps2: f32,
    /// Comfortable deceleration (IDM parameter b).
    pub(crate) comfort_brake_mps2: f32,
    /// Delay with which a change of the leader's speed is noticed, seconds.
    pub(crate) reaction_s: f32,
    /// Time at standstill from when the vehicle may drive until it does, seconds.
    pub(crate) start_s: f32,
    /// Politeness factor of lane changes (MOBIL's p).
    pub(crate) courtesy: f32,
    /// Standard deviation of the relative error of the estimated gap.
    pub(crate) gap_error: f32,
}

impl Driver {
    /// The median driver, without errors of estimation.
    pub(crate) const MEDIAN: Driver = Driver {
        speed_factor: 1.0,
        headway_s: 1.15,
        accel_mps2: 1.9,
        comfort_brake_mps2: 2.0,
        reaction_s: 0.6,
        start_s: 0.85,
        courtesy: 0.3,
        gap_error: 0.0,
    };

    /// Returns the driver of a vehicle. At a `spread` of 0 all are equal, at 1 they differ as in the
    /// field. The draws are the same for every spread.
    pub(crate) fn of(seed: u64, actor: u32, spread: f32) -> Driver {
        let mut draws = stream(seed, actor, Purpose::Driver, 0);
        let mut deviate = |deviation: f32| spread * deviation * standard_normal(&mut draws);
        let median = Driver::MEDIAN;
        Driver {
            speed_factor: (median.speed_factor + deviate(0.07)).clamp(0.85, 1.1),
            headway_s: (median.headway_s * deviate(0.2).exp()).clamp(0.8, 2.2),
            accel_mps2: (median.accel_mps2 * deviate(0.15).exp()).clamp(1.3, 2.6),
            comfort_brake_mps2: (median.comfort_brake_mps2 * deviate(0.15).exp()).clamp(1.5, 2.8),
            reaction_s: (median.reaction_s * deviate(0.25).exp()).clamp(0.3, 1.1),
            start_s: (median.start_s * deviate(0.25).exp()).clamp(0.4, 1.6),
            courtesy: (median.courtesy + deviate(0.15)).clamp(0.0, 0.8),
            gap_error: GAP_ERROR * spread.min(2.0),
        }
    }
}

/// Relative error of the estimated gap (V_s of the human driver model).
const GAP_ERROR: f32 = 0.1;

/// Draws a normal number, cut off at two deviations.
fn standard_normal(draws: &mut RandomStream) -> f32 {
    (draws.normal(1.0) as f32).clamp(-2.0, 2.0)
}

/// The drivers of all rows; drawn when a vehicle appears or a setting changes.
#[derive(Default)]
pub(crate) struct Drivers {
    ids: Vec<u32>,
    of: Vec<Driver>,
    /// Seed and bits of the spread.
    key: (u64, u32),
}

impl Drivers {
    /// Sets the drivers of vehicles, by row.
    pub(crate) fn update(&mut self, ids: &[u32], seed: u64, spread: f32) {
        let key = (seed, spread.to_bits());
        if self.key != key {
            self.ids.clear();
            self.key = key;
        }
        if self.ids == ids {
            return;
        }
        self.of.clear();
        self.of.extend(ids.iter().map(|&id| Driver::of(seed, id, spread)));
        self.ids.clear();
        self.ids.extend_from_slice(ids);
    }

    /// Returns the drivers by row.
    pub(crate) fn rows(&self) -> &[Driver] {
        &self.of
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drivers_differ_by_the_spread_and_are_the_median_one_without_it() {
        let mean_and_deviation = |values: &[f32]| {
            let count = values.len() as f32;
            let mean = values.iter().sum::<f32>() / count;
            let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / count;
            (mean, square.sqrt())
        };
        let of = |spread: f32, property: fn(&Driver) -> f32| {
            let drivers = (1..4000).map(|id| property(&Driver::of(3, id, spread)));
            mean_and_deviation(&drivers.collect::<Vec<_>>())
        };
        assert_eq!(Driver::of(3, 8, 0.0), Driver::MEDIAN);
        for spread in [0.5, 1.0] {
            let (speed, speed_deviation) = of(spread, |driver| driver.speed_factor);
            assert!((speed - 1.0).abs() < 0.01, "{speed}");
            assert!((speed_deviation - 0.065 * spread).abs() < 0.008, "{speed_deviation}");
            let (headway, deviation) = of(spread, |driver| driver.headway_s.ln());
            assert!((headway - Driver::MEDIAN.headway_s.ln()).abs() < 0.01, "{headway}");
            assert!((deviation - 0.19 * spread).abs() < 0.02, "{deviation}");
        }
    }

    #[test]
    fn a_driver_depends_on_seed_and_vehicle_alone() {
        assert_eq!(Driver::of(1, 7, 1.0), Driver::of(1, 7, 1.0));
        assert_ne!(Driver::of(1, 7, 1.0), Driver::of(2, 7, 1.0));
        assert_ne!(Driver::of(1, 7, 1.0), Driver::of(1, 8, 1.0));
        let mut drivers = Drivers::default();
        drivers.update(&[2, 5], 1, 1.0);
        drivers.update(&[5, 9], 1, 1.0);
        assert_eq!(drivers.rows(), [Driver::of(1, 5, 1.0), Driver::of(1, 9, 1.0)]);
        drivers.update(&[5, 9], 2, 1.0);
        assert_eq!(drivers.rows(), [Driver::of(2, 5, 1.0), Driver::of(2, 9, 1.0)]);
        drivers.update(&[5, 9], 2, 0.0);
        assert_eq!(drivers.rows(), [Driver::MEDIAN; 2]);
    }
}
