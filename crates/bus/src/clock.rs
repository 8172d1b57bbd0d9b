//! The monotonic clock, the same for all processes of the machine.

use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds since some fixed moment. For stage clocks, pacing and deadlines, never for
/// anything that decides the future of the world.
pub fn now_nanos() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
