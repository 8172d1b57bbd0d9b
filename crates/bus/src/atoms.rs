//! The atomics and system calls that waiting is built from; loom replaces them with its own.

use std::time::Duration;

pub(crate) use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

use rustix::thread::futex;

/// Sleeps until `word` is woken or `at_most` has passed; returns at once if `word` is not `seen`.
pub(crate) fn sleep_on(word: &AtomicU32, seen: u32, at_most: Option<Duration>) {
    let timeout = at_most.map(|d| rustix::fs::Timespec {
        tv_sec: d.as_secs() as i64,
        tv_nsec: d.subsec_nanos().into(),
    });
    // The caller looks again, whatever the reason for the return.
    let _ = futex::wait(word, futex::Flags::empty(), seen, timeout.as_ref());
}

/// Wakes every thread that sleeps on `word`.
pub(crate) fn wake_all(word: &AtomicU32) {
    let _ = futex::wake(word, futex::Flags::empty(), i32::MAX as u32);
}

/// Yields the core to another thread.
pub(crate) fn yield_core() {
    rustix::thread::sched_yield();
}

pub(crate) use crate::clock::now_nanos;
