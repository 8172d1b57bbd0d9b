use glam::Vec3;
use protocol::{SensorSpec, lidar_flag};

use crate::rain::{PUFFS_MAX, Puff, nearest};

/// Share of its light that a clump of spray returns: ∫ π β exp(−2ατ) dr of a deep cloud of droplets is π / 2S, with
/// the lidar ratio S = α / β = 18.8 sr of water (E. O'Connor, A. Illingworth and R. Hogan, *A Technique for
/// Autocalibration of Cloud Lidar*, 2004).
pub(crate) const CLUMP_REFLECTIVITY: f32 = 0.083_55;

/// Halvings of the way on which a clump lies: 120 m to less than a tenth of a millimetre.
const HALVINGS: u32 = 21;

/// Spray behind vehicles, as a lidar sees it.
///
/// Spray is torn into clumps, so that a pulse is either returned by one or passes between them, as in the measurements
/// of S. Walz et al., *A Benchmark for Spray from Nearby Cutting Vehicles*, 2021. Clumps are a Poisson process along
/// the beam whose mean is the optical depth of the cloud that cameras see; the first of them returns an echo, and what
/// lies behind is attenuated by the mean of the cloud on both ways.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Spray {
    pub(crate) puffs: [Puff; PUFFS_MAX],
    pub(crate) count: u32,
}

impl Spray {
    /// Returns the spray before a lidar at `origin`, of all puffs of a world.
    pub(crate) fn of(spec: &SensorSpec, puffs: &[Puff], origin: Vec3) -> Spray {
        if !spec.lidar.has(lidar_flag::WEATHER) {
            return Spray::default();
        }
        let (puffs, count) = nearest(puffs, origin);
        Spray { puffs, count }
    }

    /// Returns the optical depth along a beam up to `distance_m`.
    #[inline(always)]
    pub(crate) fn optical_depth(&self, [origin, direction]: [Vec3; 2], distance_m: f32) -> f32 {
        let mut sum = 0.0;
        for puff in &self.puffs[..self.count as usize] {
            sum += puff.optical_depth(origin, direction, distance_m);
        }
        sum
    }

    /// Returns the distance of the first clump nearer than `nearest_m`, from a random word for each puff.
    #[inline(always)]
    pub(crate) fn first_clump(
        &self,
        [origin, direction]: [Vec3; 2],
        nearest_m: f32,
        word: impl Fn(u32) -> u32,
    ) -> Option<f32> {
        let mut first = None;
        let mut end_m = nearest_m;
        for (number, puff) in self.puffs[..self.count as usize].iter().enumerate() {
            let depth = -(((word(number as u32) >> 8) as f32 + 0.5) * (1.0 / 16_777_216.0)).ln();
            if puff.optical_depth(origin, direction, end_m) <= depth {
                continue;
            }
            let (mut low_m, mut high_m) = (0.0, end_m);
            for _ in 0..HALVINGS {
                let middle_m = 0.5 * (low_m + high_m);
                if puff.optical_depth(origin, direction, middle_m) <= depth {
                    low_m = middle_m;
                } else {
                    high_m = middle_m;
                }
            }
            end_m = high_m;
            first = Some(high_m);
        }
        first
    }
}
