//! The monotonic clock, the same for all processes of the machine.

use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds since an arbitrary fixed time. For stage clocks, pacing and deadlines; the simulation
/// must not depend on it.
pub fn now_nanos() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
