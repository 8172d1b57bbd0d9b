//! Named random streams: every draw is a function of (seed, actor, purpose, how many before it).
//!
//! Nothing is stored but the counts, so a restored planner draws what the lost one would have drawn,
//! and one vehicle's draws never move another's.

/// What a draw is for. Streams of different purposes are independent.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    /// Which way to go where a lane forks.
    Turn = 1,
    /// Whether this red light is ignored.
    Light = 2,
    /// The other way that is compared with the first.
    Detour = 3,
    /// Whether this sign is ignored.
    Sign = 4,
    /// Whether this other one is ignored.
    Ignore = 5,
    /// Whether to change lanes for no reason.
    Wander = 6,
}

/// The `count`-th draw of a stream, uniform over all of u64.
pub(crate) fn draw(seed: u64, actor: u32, purpose: Purpose, count: u64) -> u64 {
    let stream = mix(seed ^ mix(u64::from(actor) << 8 | purpose as u64));
    mix(stream.wrapping_add(count.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

/// The `count`-th draw of a stream, uniform in 0..1.
pub(crate) fn unit(seed: u64, actor: u32, purpose: Purpose, count: u64) -> f32 {
    (draw(seed, actor, purpose, count) >> 40) as f32 / (1u64 << 24) as f32
}

/// Another seed, of two.
pub(crate) fn mixed(seed: u64, other: u64) -> u64 {
    mix(seed ^ mix(other))
}

/// The finaliser of splitmix64 (Steele, Lea and Flood, OOPSLA 2014).
fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
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
    fn units_are_spread_evenly() {
        let mean: f32 =
            (0..4096).map(|count| unit(3, 5, Purpose::Turn, count)).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
    }
}
