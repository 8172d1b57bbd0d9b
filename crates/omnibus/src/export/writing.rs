//! The time that writing of containers takes, without reading and conversion.

use std::sync::atomic::{AtomicU64, Ordering};

use bus::clock;

static NANOS: AtomicU64 = AtomicU64::new(0);

/// Writes to a container, and adds the time to that of all threads.
pub(crate) fn writing<T>(write: impl FnOnce() -> T) -> T {
    let begin = clock::now_nanos();
    let written = write();
    NANOS.fetch_add(clock::now_nanos() - begin, Ordering::Relaxed);
    written
}

/// Logs the time so far. `omnibus-bench export` reads the line.
pub(crate) fn log_time() {
    log::debug!("containers were written for {} ns", NANOS.load(Ordering::Relaxed));
}
