//! When the sensors of a bundle measure.

use bytemuck::{Pod, Zeroable};

use crate::{SensorSpec, SnapshotHeader, outcome::Answer};

/// Simulated time at which a bundle was created: the response of the outcomes of
/// [`crate::Command::CreateBundle`] and of the bundle's sensors.
///
/// Keyframes repeat these outcomes, so that a renderer which starts late measures at the same
/// frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct BundleReceipt {
    /// Simulated time of the newest frame before the bundle existed.
    pub created_nanos: u64,
    /// Simulated time that the bundle's first frame will have, unless a later command changes the
    /// time step. Every period is counted from here.
    pub first_nanos: u64,
}

impl Answer for BundleReceipt {}

impl BundleReceipt {
    /// Returns the receipt of a bundle that `first_nanos` is the first frame of.
    pub fn new(first_nanos: u64, delta_nanos: u64) -> BundleReceipt {
        BundleReceipt { created_nanos: first_nanos.saturating_sub(delta_nanos), first_nanos }
    }

    /// Returns whether a sensor of the bundle measures at a frame: at the bundle's first frame, and
    /// at every frame within which simulated time reaches a whole number of periods since then.
    ///
    /// The rule has no memory and is exact, so that it does not drift with any time step. It holds
    /// before the first frame, too, since a saved state may set simulated time back.
    pub fn is_due(&self, spec: &SensorSpec, header: &SnapshotHeader) -> bool {
        if spec.period_nanos == 0 {
            return true;
        }
        let now = i128::from(header.stamp.sim_time_nanos);
        let before = now - i128::from(header.delta_nanos);
        let created = i128::from(self.created_nanos);
        if (before..now).contains(&created) {
            return true;
        }
        let periods = |nanos: i128| {
            (nanos - i128::from(self.first_nanos)).div_euclid(i128::from(spec.period_nanos))
        };
        periods(now) != periods(before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Stamp;

    const MS: u64 = 1_000_000;

    /// The frames of `frames` at which a sensor with this period is due; frame n ends at n times
    /// 50 ms.
    fn due(receipt: BundleReceipt, period_ms: u64, frames: std::ops::Range<u64>) -> Vec<u64> {
        let spec = SensorSpec { period_nanos: period_ms * MS, ..SensorSpec::default() };
        let is_due = |frame: &u64| {
            let stamp = Stamp { sim_time_nanos: frame * 50 * MS, ..Stamp::default() };
            let header = SnapshotHeader { stamp, delta_nanos: 50 * MS, ..Default::default() };
            receipt.is_due(&spec, &header)
        };
        frames.filter(is_due).collect()
    }

    fn first_frame(frame: u64) -> BundleReceipt {
        BundleReceipt::new(frame * 50 * MS, 50 * MS)
    }

    #[test]
    fn a_sensor_measures_at_its_first_frame_and_then_every_period() {
        for first in [1, 7, 20, 33] {
            assert_eq!(
                due(first_frame(first), 1000, first..first + 60),
                [first, first + 20, first + 40]
            );
        }
        assert_eq!(due(first_frame(3), 0, 3..7), [3, 4, 5, 6]);
        assert_eq!(due(first_frame(3), 10, 3..7), [3, 4, 5, 6]);
    }

    #[test]
    fn a_period_that_is_no_multiple_of_the_delta_does_not_drift() {
        let frames = due(first_frame(5), 70, 5..33);
        assert_eq!(frames.len(), 20);
        assert_eq!(frames[..5], [5, 7, 8, 10, 11]);
    }

    #[test]
    fn a_smaller_time_step_after_the_creation_delays_nothing() {
        let receipt = first_frame(3);
        let spec = SensorSpec { period_nanos: 1000 * MS, ..SensorSpec::default() };
        let stamp = Stamp { sim_time_nanos: 110 * MS, ..Stamp::default() };
        let header = SnapshotHeader { stamp, delta_nanos: 10 * MS, ..Default::default() };
        assert!(receipt.is_due(&spec, &header));
    }

    #[test]
    fn a_sensor_measures_at_its_period_when_time_was_set_back_before_its_creation() {
        assert_eq!(due(first_frame(100), 200, 1..17), [4, 8, 12, 16]);
    }
}
