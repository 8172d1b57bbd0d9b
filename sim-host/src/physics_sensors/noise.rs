//! Noise from (seed, simulated time, index): it does not depend on when a sensor was created, and a
//! loaded state reproduces it.

use mesh::RandomStream;

/// The random stream of a sensor at one simulated time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise(RandomStream);

impl Noise {
    /// Returns the stream of a sensor's seed at a simulated time.
    pub(super) fn at(seed: u64, sim_time_nanos: u64) -> Noise {
        Noise(RandomStream::named(seed, sim_time_nanos))
    }

    /// Draws from a normal distribution with mean 0. Takes two draws from the stream whatever
    /// `deviation` is, so that a deviation of 0 does not shift later numbers.
    pub(super) fn normal(&mut self, deviation: f32) -> f64 {
        self.0.normal(f64::from(deviation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_depends_on_seed_and_simulated_time_only() {
        let draw = |seed, nanos| {
            let mut noise = Noise::at(seed, nanos);
            [noise.normal(1.0), noise.normal(1.0)]
        };
        assert_eq!(draw(3, 50), draw(3, 50));
        assert_ne!(draw(3, 50), draw(4, 50));
        assert_ne!(draw(3, 50), draw(3, 100));
        assert_ne!(draw(3, 50)[0], draw(3, 50)[1]);
    }

    #[test]
    fn noise_is_normal_with_the_requested_deviation() {
        let drawn: Vec<f64> =
            (0..20_000).map(|i| Noise::at(1, i * 50_000_000).normal(2.0)).collect();
        let mean = drawn.iter().sum::<f64>() / 2e4;
        let deviation = (drawn.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 2e4).sqrt();
        let beyond = drawn.iter().filter(|x| x.abs() > 4.0).count() as f64 / 2e4;
        assert!(mean.abs() < 0.05 && (deviation - 2.0).abs() < 0.03, "{mean} {deviation}");
        assert!((beyond - 0.0455).abs() < 0.006, "{beyond} beyond two deviations");
    }
}
