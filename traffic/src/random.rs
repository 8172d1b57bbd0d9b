//! Named random streams: every draw is a function of (seed, actor, purpose, number of draws
//! before).
//!
//! Only the counts are stored, so that a restored planner repeats the draws, and the draws of one
//! vehicle do not affect another.

use mesh::{RandomStream, first_of};

/// The purpose of a draw. Streams of different purposes are independent.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Which lane to take at a fork.
    Turn = 1,
    /// Whether a red light is ignored.
    Light = 2,
    /// The alternative that is compared with [`Purpose::Turn`].
    TurnAlternative = 3,
    /// Whether a sign is ignored.
    Sign = 4,
    /// Whether another agent is ignored.
    Ignore = 5,
    /// Whether to make a random lane change.
    RandomLaneChange = 6,
    /// What distinguishes a driver from others.
    Driver = 7,
    /// The error of an estimated gap.
    GapError = 8,
    /// Where a walker goes.
    WalkerGoal = 9,
    /// How fast a walker is.
    WalkerPace = 10,
    /// On which side a walker walks.
    WalkerSide = 11,
    /// Whether a walker crosses streets away from crosswalks.
    WalkerCrosses = 12,
}

/// Returns the `count`-th draw of a stream, uniform over all of u64.
pub(crate) fn draw(seed: u64, actor: u32, purpose: Purpose, count: u64) -> u64 {
    stream(seed, actor, purpose, count).bits()
}

/// Returns the `count`-th draw of a stream, uniform in 0..1.
pub(crate) fn unit(seed: u64, actor: u32, purpose: Purpose, count: u64) -> f32 {
    stream(seed, actor, purpose, count).unit()
}

/// Returns the stream of (seed, actor, purpose) after `count` draws.
pub(crate) fn stream(seed: u64, actor: u32, purpose: Purpose, count: u64) -> RandomStream {
    let state = mixed(seed, u64::from(actor) << 8 | purpose as u64);
    RandomStream::from_state(state).skip(count)
}

/// Combines two seeds.
pub(crate) fn mixed(seed: u64, other: u64) -> u64 {
    first_of(seed ^ first_of(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_do_not_share_draws() {
        let base = draw(1, 7, Purpose::Turn, 0);
        assert_eq!(base, draw(1, 7, Purpose::Turn, 0));
        assert_ne!(base, draw(2, 7, Purpose::Turn, 0));
        assert_ne!(base, draw(1, 8, Purpose::Turn, 0));
        assert_ne!(base, draw(1, 7, Purpose::Light, 0));
        assert_ne!(base, draw(1, 7, Purpose::Turn, 1));
    }

    #[test]
    fn units_are_uniform() {
        let mean: f32 =
            (0..4096).map(|count| unit(3, 5, Purpose::Turn, count)).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
