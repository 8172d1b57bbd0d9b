//! How to wait for a number in shared memory: spin a little, then sleep in the kernel.
//!
//! The danger is the lost wake-up: a waiter reads the old value and goes to sleep, and the writer, which
//! checked for sleepers just before, does not wake it. Both sides therefore write their own word first,
//! then execute a sequentially consistent fence, then read the word of the other side:
//!
//! ```text
//!   waiter                         writer
//!   sleepers += 1                  value = new; word += 1
//!   fence(SeqCst)                  fence(SeqCst)
//!   read word, read value          read sleepers
//!   sleep while word is the same   wake if there are any
//! ```
//!
//! Of the two fences one comes first, and the side of the later one sees the other side's write. All
//! other accesses need only release and acquire. `loom_tests` checks this file in every interleaving.
//!
//! A process that is killed while it sleeps leaves `sleepers` one too high, which costs one system call
//! per write.

use std::time::Duration;

use super::atoms::{
    AtomicU32, AtomicU64, Ordering, fence, now_nanos, sleep_on, wake_all, yield_core,
};

/// Reads between two yields; more would keep the core from the process that is waited for.
const LOOKS: u32 = 2;

/// How long a waiter spins before it sleeps. It yields the core while it spins: with fewer cores than
/// processes, spinning without yielding is worse than sleeping at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strategy {
    /// Spinning time in nanoseconds.
    pub spin_nanos: u64,
}

impl Strategy {
    /// For a dedicated machine: spins for 1 ms.
    pub const LATENCY: Strategy = Strategy { spin_nanos: 1_000_000 };
    /// The default: spins for 50 µs.
    pub const BALANCED: Strategy = Strategy { spin_nanos: 50_000 };
    /// For many instances on one machine: does not spin.
    pub const BATCH: Strategy = Strategy { spin_nanos: 0 };

    /// The strategy of this name: `latency`, `balanced` or `batch`.
    pub fn by_name(name: &str) -> Option<Strategy> {
        match name {
            "latency" => Some(Strategy::LATENCY),
            "balanced" => Some(Strategy::BALANCED),
            "batch" => Some(Strategy::BATCH),
            _ => None,
        }
    }
}

/// A yield that takes longer gave the core to a thread that computes. Nanoseconds.
const LONG_YIELD_NANOS: u64 = 100_000;

/// The time for which a waiter spins.
///
/// A waiter that yields to a thread that computes, one of the renderer for instance, gets the core back
/// after that thread's time slice of several milliseconds; a sleeping waiter is woken at once. So
/// spinning ends with the first long yield.
#[derive(Debug)]
pub struct Spin {
    until_nanos: u64,
    now_nanos: u64,
}

impl Spin {
    /// Begins to spin; `None` if the waiter is to sleep at once.
    pub fn begin(strategy: Strategy) -> Option<Spin> {
        if strategy.spin_nanos == 0 {
            return None;
        }
        let now_nanos = now_nanos();
        Some(Spin { until_nanos: now_nanos + strategy.spin_nanos, now_nanos })
    }

    /// Yields the core. Returns whether spinning goes on.
    pub fn goes_on(&mut self) -> bool {
        yield_core();
        let before = std::mem::replace(&mut self.now_nanos, now_nanos());
        self.now_nanos <= self.until_nanos && self.now_nanos - before <= LONG_YIELD_NANOS
    }
}

/// A sequence number that one process raises and others wait for.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct SequenceEvent {
    value: AtomicU64,
    word: AtomicU32,
    sleepers: AtomicU32,
}

impl SequenceEvent {
    /// The current number.
    pub fn get(&self) -> u64 {
        self.value.load(Ordering::Acquire)
    }

    /// Raises the number and wakes the waiters. Only the owner may call this. Writes before the call are
    /// visible to a process that reads the new number.
    pub fn raise(&self, value: u64) {
        self.value.store(value, Ordering::Release);
        self.notify_all();
    }

    /// Wakes every waiter without raising the number.
    pub fn notify_all(&self) {
        self.word.fetch_add(1, Ordering::Release);
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 {
            wake_all(&self.word);
        }
    }

    /// The number of raises and other wake-ups; a waiter compares it with an earlier count.
    pub fn count(&self) -> u32 {
        self.word.load(Ordering::Acquire)
    }

    /// Waits for the number to reach `value` and returns true. Returns false when `give_up` returns true
    /// after a wake-up, or when `deadline_nanos` of the monotonic clock has passed.
    pub fn wait(
        &self,
        value: u64,
        strategy: Strategy,
        deadline_nanos: Option<u64>,
        give_up: impl Fn() -> bool,
    ) -> bool {
        wait_on(&self.word, &self.sleepers, strategy, deadline_nanos, || {
            if self.get() >= value {
                Some(true)
            } else if give_up() {
                Some(false)
            } else {
                None
            }
        })
        .unwrap_or(false)
    }

    /// Returns the first value that `look` returns; `look` is called after each raise and wake-up. `None`
    /// when the deadline has passed.
    pub fn listen<T>(
        &self,
        strategy: Strategy,
        deadline_nanos: Option<u64>,
        look: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        wait_on(&self.word, &self.sleepers, strategy, deadline_nanos, look)
    }
}

/// A notification that many processes send and one waits for.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct Notify {
    word: AtomicU32,
    sleepers: AtomicU32,
}

impl Notify {
    /// Wakes the listener if it sleeps. Writes before the call are visible to it.
    pub fn notify(&self) {
        self.word.fetch_add(1, Ordering::Release);
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 {
            wake_all(&self.word);
        }
    }

    /// Like [`Notify::notify`], but wakes a sleeping listener only if `is_due` returns true. `is_due` reads
    /// words that the other notifiers write; the last of them sees all writes.
    pub fn notify_if(&self, is_due: impl Fn() -> bool) {
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 && is_due() {
            self.word.fetch_add(1, Ordering::Release);
            wake_all(&self.word);
        }
    }

    /// The number of notifications; a listener compares it with an earlier count.
    pub fn count(&self) -> u32 {
        self.word.load(Ordering::Acquire)
    }

    /// Returns the first value that `look` returns, or `None` when the deadline has passed.
    pub fn listen<T>(
        &self,
        strategy: Strategy,
        deadline_nanos: Option<u64>,
        look: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        wait_on(&self.word, &self.sleepers, strategy, deadline_nanos, look)
    }
}

fn wait_on<T>(
    word: &AtomicU32,
    sleepers: &AtomicU32,
    strategy: Strategy,
    deadline_nanos: Option<u64>,
    mut look: impl FnMut() -> Option<T>,
) -> Option<T> {
    if let Some(answer) = look() {
        return Some(answer);
    }
    if let Some(mut spin) = Spin::begin(strategy) {
        loop {
            for _ in 0..LOOKS {
                if let Some(answer) = look() {
                    return Some(answer);
                }
                std::hint::spin_loop();
            }
            if !spin.goes_on() {
                break;
            }
            if deadline_nanos.is_some_and(|deadline| spin.now_nanos >= deadline) {
                return look();
            }
        }
    }
    sleepers.fetch_add(1, Ordering::Relaxed);
    fence(Ordering::SeqCst);
    let answer = loop {
        let seen = word.load(Ordering::Acquire);
        if let Some(answer) = look() {
            break Some(answer);
        }
        let at_most = match deadline_nanos {
            None => None,
            Some(deadline) => match deadline.checked_sub(now_nanos()) {
                None | Some(0) => break look(),
                Some(left) => Some(Duration::from_nanos(left)),
            },
        };
        sleep_on(word, seen, at_most);
    };
    sleepers.fetch_sub(1, Ordering::Relaxed);
    answer
}
