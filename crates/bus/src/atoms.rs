//! The atomics and the two system calls that waiting is built from. Loom has its own of each.

use std::time::Duration;

pub(crate) use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

use rustix::thread::futex;

/// Sleeps until somebody wakes `word`, unless it is no longer `seen`, or until the time is over.
pub(crate) fn sleep_on(word: &AtomicU32, seen: u32, at_most: Option<Duration>) {
    let timeout = at_most.map(|d| rustix::fs::Timespec {
        tv_sec: d.as_secs() as i64,
        tv_nsec: d.subsec_nanos().into(),
    });
    // Every way to return means the same to the caller: look again.
    let _ = futex::wait(word, futex::Flags::empty(), seen, timeout.as_ref());
}

/// Wakes everybody who sleeps on `word`.
pub(crate) fn wake_all(word: &AtomicU32) {
    let _ = futex::wake(word, futex::Flags::empty(), i32::MAX as u32);
}

/// Lets another process run on this core.
pub(crate) fn yield_core() {
    rustix::thread::sched_yield();
}

pub(crate) use crate::clock::now_nanos;
