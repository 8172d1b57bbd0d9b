//! Drivers: what differs between the vehicles of one traffic.
//!
//! The parameters are those of the IDM (Treiber and Kesting, Traffic Flow Dynamics, 2013, chapter
//! 11) and of MOBIL (Kesting, Treiber and Helbing 2007). The human driver model (Treiber, Kesting
//! and Helbing, Physica A 360, 2006) adds the reaction time and the slowly varying error of the
//! estimated gap: see [`crate::reaction`]. The medians of cars are chosen such that capacity,
//! backward waves and the discharge of queues agree with the field (Highway Capacity Manual: a base
//! saturation flow of 1900 vehicles per hour and lane, a start-up lost time of about 2 s). Those of
//! other classes follow from them:
//!
//! - Trucks and buses accelerate about half as fast as cars, as in SUMO's defaults by vehicle class,
//!   and keep a longer headway: together about the two passenger-car equivalents that the Highway
//!   Capacity Manual counts for a heavy vehicle at a signal.
//! - Cyclists ride at 5 m/s with a deviation of 1 m/s: an 85th percentile of 22 km/h, and start with
//!   little acceleration (Parkin and Rotheram, Transport Policy 17, 2010).

use mesh::RandomStream;

use crate::{
    body::Class,
    random::{Purpose, stream},
};

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
    /// That time from when the leader of a queue moves, seconds.
    pub(crate) follow_start_s: f32,
    /// Politeness factor of lane changes (MOBIL's p).
    pub(crate) courtesy: f32,
    /// Highest desired speed, whatever the limit, metres per second.
    pub(crate) top_mps: f32,
    /// Standard deviation of the relative error of the estimated gap.
    pub(crate) gap_error: f32,
}

/// A distribution: median, spread, and bounds.
#[derive(Clone, Copy)]
struct Range(f32, f32, f32, f32);

impl Range {
    /// Returns the value of a normal distribution.
    fn normal(self, deviate: &mut impl FnMut() -> f32) -> f32 {
        let Range(median, deviation, low, high) = self;
        (median + deviation * deviate()).clamp(low, high)
    }

    /// Returns the value of a log-normal distribution.
    fn log_normal(self, deviate: &mut impl FnMut() -> f32) -> f32 {
        let Range(median, deviation, low, high) = self;
        (median * (deviation * deviate()).exp()).clamp(low, high)
    }
}

/// The distributions of a class. Speeds and courtesy are normal, others log-normal.
struct Ranges {
    speed_factor: Range,
    headway_s: Range,
    accel_mps2: Range,
    comfort_brake_mps2: Range,
    reaction_s: Range,
    start_s: Range,
    courtesy: Range,
    top_mps: Range,
}

/// Ratio of the time to start behind a leader that moves to that at a light.
const FOLLOW_START: f32 = 0.8;

const UNBOUNDED: Range = Range(f32::INFINITY, 0.0, f32::INFINITY, f32::INFINITY);

impl Ranges {
    const CAR: Ranges = Ranges {
        speed_factor: Range(1.0, 0.07, 0.85, 1.1),
        headway_s: Range(1.15, 0.2, 0.8, 2.2),
        accel_mps2: Range(1.85, 0.15, 1.27, 2.53),
        comfort_brake_mps2: Range(2.0, 0.15, 1.5, 2.8),
        reaction_s: Range(0.9, 0.25, 0.45, 1.5),
        start_s: Range(0.75, 0.25, 0.4, 1.5),
        courtesy: Range(0.3, 0.15, 0.0, 0.8),
        top_mps: UNBOUNDED,
    };

    const fn of(class: Class) -> Ranges {
        match class {
            Class::Car => Ranges::CAR,
            Class::Truck => Ranges {
                speed_factor: Range(0.95, 0.05, 0.8, 1.03),
                headway_s: Range(1.7, 0.2, 1.2, 2.8),
                accel_mps2: Range(0.9, 0.15, 0.7, 1.3),
                comfort_brake_mps2: Range(1.7, 0.15, 1.2, 2.3),
                start_s: Range(1.1, 0.25, 0.6, 2.0),
                ..Ranges::CAR
            },
            Class::Bus => Ranges {
                speed_factor: Range(0.95, 0.05, 0.8, 1.03),
                headway_s: Range(1.6, 0.2, 1.1, 2.6),
                accel_mps2: Range(0.9, 0.1, 0.7, 1.2),
                comfort_brake_mps2: Range(1.5, 0.1, 1.2, 1.9),
                start_s: Range(1.1, 0.25, 0.6, 2.0),
                ..Ranges::CAR
            },
            Class::Motorcycle => Ranges {
                speed_factor: Range(1.03, 0.08, 0.85, 1.2),
                headway_s: Range(1.0, 0.2, 0.7, 1.9),
                accel_mps2: Range(2.6, 0.15, 1.8, 3.5),
                comfort_brake_mps2: Range(2.2, 0.15, 1.6, 3.0),
                start_s: Range(0.7, 0.25, 0.35, 1.3),
                ..Ranges::CAR
            },
            Class::Bicycle => Ranges {
                headway_s: Range(1.0, 0.2, 0.7, 1.8),
                accel_mps2: Range(0.8, 0.2, 0.5, 1.2),
                comfort_brake_mps2: Range(1.6, 0.15, 1.2, 2.2),
                top_mps: Range(5.0, 1.0, 3.0, 7.0),
                ..Ranges::CAR
            },
        }
    }
}

impl Driver {
    /// The median driver of a car, without errors of estimation.
    pub(crate) const MEDIAN: Driver = Driver {
        speed_factor: Ranges::CAR.speed_factor.0,
        headway_s: Ranges::CAR.headway_s.0,
        accel_mps2: Ranges::CAR.accel_mps2.0,
        comfort_brake_mps2: Ranges::CAR.comfort_brake_mps2.0,
        reaction_s: Ranges::CAR.reaction_s.0,
        start_s: Ranges::CAR.start_s.0,
        follow_start_s: FOLLOW_START * Ranges::CAR.start_s.0,
        courtesy: Ranges::CAR.courtesy.0,
        top_mps: f32::INFINITY,
        gap_error: 0.0,
    };

    /// Returns the driver of a vehicle of this class. At a `spread` of 0 all of a class are equal, at
    /// 1 they differ as in the field. The draws are the same for every spread and class.
    pub(crate) fn of(class: Class, seed: u64, actor: u32, spread: f32) -> Driver {
        let mut draws = stream(seed, actor, Purpose::Driver, 0);
        let mut deviate = || spread * standard_normal(&mut draws);
        let ranges = Ranges::of(class);
        let speed_factor = ranges.speed_factor.normal(&mut deviate);
        let headway_s = ranges.headway_s.log_normal(&mut deviate);
        let accel_mps2 = ranges.accel_mps2.log_normal(&mut deviate);
        let comfort_brake_mps2 = ranges.comfort_brake_mps2.log_normal(&mut deviate);
        let reaction_s = ranges.reaction_s.log_normal(&mut deviate);
        let start_s = ranges.start_s.log_normal(&mut deviate);
        let courtesy = ranges.courtesy.normal(&mut deviate);
        let top_mps = if ranges.top_mps.0.is_finite() {
            ranges.top_mps.normal(&mut deviate)
        } else {
            f32::INFINITY
        };
        Driver {
            speed_factor,
            headway_s,
            accel_mps2,
            comfort_brake_mps2,
            reaction_s,
            start_s,
            follow_start_s: FOLLOW_START * start_s,
            courtesy,
            top_mps,
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
    pub(crate) fn update(
        &mut self,
        ids: &[u32],
        class: impl Fn(usize) -> Class,
        seed: u64,
        spread: f32,
    ) {
        let key = (seed, spread.to_bits());
        if self.key != key {
            self.ids.clear();
            self.key = key;
        }
        if self.ids == ids {
            return;
        }
        self.of.clear();
        let drivers = ids.iter().enumerate();
        self.of.extend(drivers.map(|(row, &id)| Driver::of(class(row), seed, id, spread)));
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
            let drivers = (1..4000).map(|id| property(&Driver::of(Class::Car, 3, id, spread)));
            mean_and_deviation(&drivers.collect::<Vec<_>>())
        };
        assert_eq!(Driver::of(Class::Car, 3, 8, 0.0), Driver::MEDIAN);
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
        assert_eq!(Driver::of(Class::Car, 1, 7, 1.0), Driver::of(Class::Car, 1, 7, 1.0));
        assert_ne!(Driver::of(Class::Car, 1, 7, 1.0), Driver::of(Class::Car, 2, 7, 1.0));
        assert_ne!(Driver::of(Class::Car, 1, 7, 1.0), Driver::of(Class::Car, 1, 8, 1.0));
        let mut drivers = Drivers::default();
        let car = |_: usize| Class::Car;
        drivers.update(&[2, 5], car, 1, 1.0);
        drivers.update(&[5, 9], car, 1, 1.0);
        assert_eq!(
            drivers.rows(),
            [Driver::of(Class::Car, 1, 5, 1.0), Driver::of(Class::Car, 1, 9, 1.0)]
        );
        drivers.update(&[5, 9], car, 2, 1.0);
        assert_eq!(
            drivers.rows(),
            [Driver::of(Class::Car, 2, 5, 1.0), Driver::of(Class::Car, 2, 9, 1.0)]
        );
        drivers.update(&[5, 9], car, 2, 0.0);
        assert_eq!(drivers.rows(), [Driver::MEDIAN; 2]);
    }

    #[test]
    fn drivers_of_heavy_vehicles_and_cyclists_differ_from_those_of_cars() {
        let mean = |class: Class, property: fn(&Driver) -> f32| {
            let drivers = (1..2000).map(|id| property(&Driver::of(class, 3, id, 1.0)));
            drivers.sum::<f32>() / 1999.0
        };
        for heavy in [Class::Truck, Class::Bus] {
            let accel = |class| mean(class, |driver| driver.accel_mps2);
            assert!((0.45..0.6).contains(&(accel(heavy) / accel(Class::Car))), "{heavy:?}");
            let headway = |class| mean(class, |driver| driver.headway_s);
            assert!(headway(heavy) > 1.3 * headway(Class::Car), "{heavy:?}");
            assert!(mean(heavy, |driver| driver.speed_factor) < 0.97, "{heavy:?}");
        }
        let mut tops: Vec<f32> =
            (1..2000).map(|id| Driver::of(Class::Bicycle, 3, id, 1.0).top_mps).collect();
        tops.sort_by(f32::total_cmp);
        let kmh = |part: usize| 3.6 * tops[tops.len() * part / 100];
        assert!((17.0..19.0).contains(&kmh(50)), "{} km/h", kmh(50));
        assert!((21.0..23.0).contains(&kmh(85)), "{} km/h", kmh(85));
    }
}
