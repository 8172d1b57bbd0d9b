//! Elevations of the channels of a lidar.

use std::fmt;

use protocol::ELEVATIONS_MAX;

/// Elevations of the channels of a lidar, the highest first, radians. Lists of more than 128 channels
/// are refused when the sensor is created.
#[derive(Clone, Copy, PartialEq)]
pub struct Elevations {
    rad: [f32; ELEVATIONS_MAX],
    count: usize,
}

impl Elevations {
    /// Returns the number of channels that were given.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns the elevations, radians; of more than 128 channels the first 128.
    #[must_use]
    pub fn rad(&self) -> &[f32] {
        &self.rad[..self.count.min(ELEVATIONS_MAX)]
    }
}

impl From<&[f32]> for Elevations {
    fn from(given: &[f32]) -> Elevations {
        let mut rad = [0.0; ELEVATIONS_MAX];
        for (stored, one) in rad.iter_mut().zip(given) {
            *stored = *one;
        }
        Elevations { rad, count: given.len() }
    }
}

impl fmt::Debug for Elevations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.rad()).finish()
    }
}
