//! Noise that is drawn from (seed, simulated time, which number): what a sensor says at a moment
//! does not depend on when it was made, and a state that is loaded has its noise again.

use std::f64::consts::TAU;

/// A well of one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    state: u64,
}

impl Noise {
    /// Of a sensor's seed at a moment.
    pub(super) fn at(seed: u64, sim_time_nanos: u64) -> Noise {
        Noise { state: mixed(seed ^ mixed(sim_time_nanos.wrapping_add(GOLDEN))) }
    }

    /// Above 0, up to 1.
    pub(super) fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(GOLDEN);
        ((mixed(self.state) >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// Of normal distribution, by Box's and Muller's way. Two numbers are drawn whatever
    /// `deviation` is, so that one of 0 shifts no other.
    pub(super) fn normal(&mut self, deviation: f32) -> f64 {
        let (radius, turn) = (self.uniform(), self.uniform());
        f64::from(deviation) * (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The last step of splitmix64.
fn mixed(mut z: u64) -> u64 {
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_has_its_noise_whenever_it_is_asked() {
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
    fn noise_is_normal_and_of_the_deviation_that_was_asked() {
        let drawn: Vec<f64> =
            (0..20_000).map(|i| Noise::at(1, i * 50_000_000).normal(2.0)).collect();
        let mean = drawn.iter().sum::<f64>() / 2e4;
        let deviation = (drawn.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 2e4).sqrt();
        let beyond = drawn.iter().filter(|x| x.abs() > 4.0).count() as f64 / 2e4;
        assert!(mean.abs() < 0.05 && (deviation - 2.0).abs() < 0.03, "{mean} {deviation}");
        assert!((beyond - 0.0455).abs() < 0.006, "{beyond} beyond two deviations");
    }
}
