//! Random streams: splitmix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
//! generators", OOPSLA 2014). The same seed gives the same numbers on every machine.

use std::f64::consts::TAU;

/// The increment of splitmix64's state: 2⁶⁴ divided by the golden ratio, made odd.
pub const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// Returns `z` scrambled by splitmix64's finaliser, a bijection. 0 gives 0.
#[inline]
pub const fn mix64(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns the first 64 bits of the stream with this state: [`mix64`] of the state after one
/// increment. A hash of one word in which 0 is no fixed point.
#[inline]
pub const fn first_of(state: u64) -> u64 {
    mix64(state.wrapping_add(GOLDEN_GAMMA))
}

/// A stream of random numbers. Not for secrets.
///
/// Streams differ by where they begin:
///
/// | constructor | begins at | for |
/// |---|---|---|
/// | [`RandomStream::from_state`] | the state itself | plain splitmix64 with a seed |
/// | [`RandomStream::named`] | a mix of seed and name | one stream for each purpose, actor or moment |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomStream {
    state: u64,
}

impl RandomStream {
    /// Creates the stream whose state is `state`: the seed of plain splitmix64.
    #[inline]
    pub const fn from_state(state: u64) -> RandomStream {
        RandomStream { state }
    }

    /// Creates the stream that `seed` and `name` select, where `name` says what the numbers are
    /// for: a purpose, an actor, a time in nanoseconds. Different names give independent streams.
    #[inline]
    pub const fn named(seed: u64, name: u64) -> RandomStream {
        RandomStream { state: mix64(seed ^ first_of(name)) }
    }

    /// Returns the stream after `count` more draws, without drawing them.
    #[inline]
    pub const fn skip(self, count: u64) -> RandomStream {
        RandomStream { state: self.state.wrapping_add(count.wrapping_mul(GOLDEN_GAMMA)) }
    }

    /// Draws 64 bits.
    #[inline]
    pub const fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN_GAMMA);
        mix64(self.state)
    }

    /// Draws a number in [0, 1), a multiple of 2⁻²⁴.
    #[inline]
    pub const fn unit(&mut self) -> f32 {
        unit_of(self.bits())
    }

    /// Draws a number in (0, 1], a multiple of 2⁻⁵³. Its logarithm is finite.
    #[inline]
    pub const fn positive_unit(&mut self) -> f64 {
        ((self.bits() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// Draws a number in [low, high).
    #[inline]
    pub const fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Draws an integer in `0..count` by the high half of a product (Lemire, "Fast random integer
    /// generation in an interval", 2019, without the rejection step); 0 if `count` is 0.
    #[inline]
    pub const fn below(&mut self, count: usize) -> usize {
        ((self.bits() as u128 * count as u128) >> 64) as usize
    }

    /// Draws an integer in `0..count` by a remainder.
    ///
    /// # Panics
    ///
    /// Panics if `count` is 0.
    #[inline]
    pub const fn remainder(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// Draws one of `choices`, by a remainder.
    ///
    /// # Panics
    ///
    /// Panics if there are none.
    #[inline]
    pub const fn pick<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.remainder(choices.len())]
    }

    /// Draws one of `choices` as [`RandomStream::below`] does.
    ///
    /// # Panics
    ///
    /// Panics if there are none.
    #[inline]
    pub const fn choose<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        &choices[self.below(choices.len())]
    }

    /// Draws `true` with this probability.
    #[inline]
    pub const fn chance(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// Draws from a normal distribution with mean 0 by the method of Box and Muller.
    ///
    /// Takes two draws from the stream whatever `deviation` is, so that a deviation of 0 does not
    /// shift later numbers.
    #[inline]
    pub fn normal(&mut self, deviation: f64) -> f64 {
        let (radius, turn) = (self.positive_unit(), self.positive_unit());
        deviation * (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
    }
}

/// Returns the number in [0, 1) that the upper 24 bits of a draw stand for.
#[inline]
const fn unit_of(bits: u64) -> f32 {
    (bits >> 40) as f32 / (1u64 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first outputs of the reference implementation for the seed 1234567.
    #[test]
    fn the_stream_is_splitmix64() {
        let mut stream = RandomStream::from_state(1_234_567);
        assert_eq!(
            [stream.bits(), stream.bits(), stream.bits()],
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]
        );
    }

    #[test]
    fn skipping_equals_drawing() {
        let mut drawn = RandomStream::named(5, 6);
        let skipped = drawn.skip(3);
        for _ in 0..3 {
            drawn.bits();
        }
        assert_eq!(drawn, skipped);
    }

    #[test]
    fn streams_of_different_names_or_seeds_differ() {
        let first = |seed, name| RandomStream::named(seed, name).bits();
        assert_eq!(first(1, 7), first(1, 7));
        assert_ne!(first(1, 7), first(2, 7));
        assert_ne!(first(1, 7), first(1, 8));
    }

    #[test]
    fn draws_stay_in_their_intervals_and_fill_them_evenly() {
        let mut stream = RandomStream::named(3, 5);
        let (mut unit, mut positive, mut squares) = (0.0, 0.0, 0.0);
        for _ in 0..4096 {
            let draw = stream.unit();
            assert!((0.0..1.0).contains(&draw));
            unit += f64::from(draw) / 4096.0;
            let draw = stream.positive_unit();
            assert!(draw > 0.0 && draw <= 1.0);
            positive += draw / 4096.0;
            assert!(stream.below(7) < 7 && stream.remainder(7) < 7);
            squares += stream.normal(2.0).powi(2) / 4096.0;
        }
        assert!((unit - 0.5).abs() < 0.02 && (positive - 0.5).abs() < 0.02, "{unit} {positive}");
        assert!((squares - 4.0).abs() < 0.3, "{squares}");
        assert_eq!(stream.below(0), 0);
    }
}
