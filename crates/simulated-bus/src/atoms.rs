//! Atomics at whose accesses the scheduler may switch to another process, and the kernel's queue of
//! sleepers.

use std::{panic::Location, sync::atomic, time::Duration};

pub(crate) use std::sync::atomic::Ordering;

use crate::scheduler::{self, visible};

macro_rules! atomic {
    ($name:ident, $value:ty) => {
        /// A word of the control page.
        #[derive(Debug, Default)]
        #[repr(transparent)]
        pub(crate) struct $name(atomic::$name);

        #[allow(dead_code, reason = "each of the two has the methods of both")]
        impl $name {
            #[cfg(test)]
            pub(crate) fn new(value: $value) -> $name {
                $name(atomic::$name::new(value))
            }

            #[track_caller]
            pub(crate) fn load(&self, order: Ordering) -> $value {
                visible(Location::caller());
                self.0.load(order)
            }

            #[track_caller]
            pub(crate) fn store(&self, value: $value, order: Ordering) {
                if visible(Location::caller()) {
                    self.0.store(value, order);
                }
            }

            #[track_caller]
            pub(crate) fn fetch_add(&self, value: $value, order: Ordering) -> $value {
                self.change(|word| word.fetch_add(value, order), Location::caller())
            }

            #[track_caller]
            pub(crate) fn fetch_sub(&self, value: $value, order: Ordering) -> $value {
                self.change(|word| word.fetch_sub(value, order), Location::caller())
            }

            #[track_caller]
            pub(crate) fn fetch_or(&self, value: $value, order: Ordering) -> $value {
                self.change(|word| word.fetch_or(value, order), Location::caller())
            }

            #[track_caller]
            pub(crate) fn fetch_and(&self, value: $value, order: Ordering) -> $value {
                self.change(|word| word.fetch_and(value, order), Location::caller())
            }

            #[track_caller]
            pub(crate) fn compare_exchange(
                &self,
                current: $value,
                new: $value,
                success: Ordering,
                failure: Ordering,
            ) -> Result<$value, $value> {
                if !visible(Location::caller()) {
                    return Err(self.0.load(failure));
                }
                self.0.compare_exchange(current, new, success, failure)
            }

            fn change(
                &self,
                change: impl FnOnce(&atomic::$name) -> $value,
                caller: &'static Location<'static>,
            ) -> $value {
                if visible(caller) {
                    return change(&self.0);
                }
                self.0.load(Ordering::Relaxed)
            }
        }
    };
}

atomic!(AtomicU32, u32);
atomic!(AtomicU64, u64);

/// One thread runs all processes, so that their accesses are ordered anyway.
pub(crate) fn fence(_order: Ordering) {}

/// Sleeps until `word` is woken or `at_most` has passed; returns at once if `word` is not `seen`.
pub(crate) fn sleep_on(word: &AtomicU32, seen: u32, at_most: Option<Duration>) {
    if word.load(Ordering::Relaxed) == seen {
        scheduler::sleep_on(address(word), at_most.map(|time| time.as_nanos() as u64));
    }
}

/// Wakes every process that sleeps on `word`.
pub(crate) fn wake_all(word: &AtomicU32) {
    scheduler::wake_all(address(word));
}

/// Lets other processes run.
pub(crate) fn yield_core() {
    scheduler::yield_core();
}

pub(crate) use crate::clock::now_nanos;

fn address(word: &AtomicU32) -> usize {
    std::ptr::from_ref(word).addr()
}
