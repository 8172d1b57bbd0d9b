//! How to wait for a number in shared memory: spin a little, then sleep in the kernel.
//!
//! The one danger is the lost wake-up: a waiter looks, sees nothing, goes to sleep, and the
//! writer, who looked for sleepers a moment earlier, does not wake it. Both sides therefore write
//! their own word first, then pass a sequentially consistent fence, then read the other's:
//!
//! ```text
//!   waiter                         writer
//!   sleepers += 1                  value = new; word += 1
//!   fence(SeqCst)                  fence(SeqCst)
//!   read word, read value          read sleepers
//!   sleep while word is the same   wake if there are any
//! ```
//!
//! Of two fences one comes first; the side behind the later one sees the other's write. All other
//! accesses need only release and acquire. `loom_tests` runs this very file through every order.
//!
//! A process that is killed asleep leaves `sleepers` one too high: that costs a system call per
//! write and nothing else.

use std::time::Duration;

use super::atoms::{
    AtomicU32, AtomicU64, Ordering, fence, now_nanos, sleep_on, wake_all, yield_core,
};

/// Looks between two yields: more of them keep the core from who is waited for.
const LOOKS: u32 = 2;

/// How long a waiter looks before it sleeps. It yields the core between looks: with fewer cores
/// than processes, spinning without yielding is worse than sleeping at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strategy {
    /// Nanoseconds of looking.
    pub spin_nanos: u64,
}

impl Strategy {
    /// A dedicated machine: 1 ms.
    pub const LATENCY: Strategy = Strategy { spin_nanos: 1_000_000 };
    /// The default: 50 µs.
    pub const BALANCED: Strategy = Strategy { spin_nanos: 50_000 };
    /// Many instances on one machine: not at all.
    pub const BATCH: Strategy = Strategy { spin_nanos: 0 };

    /// By its name on the command line.
    pub fn by_name(name: &str) -> Option<Strategy> {
        match name {
            "latency" => Some(Strategy::LATENCY),
            "balanced" => Some(Strategy::BALANCED),
            "batch" => Some(Strategy::BATCH),
            _ => None,
        }
    }
}

/// A number that one process raises and many wait for.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct SequenceEvent {
    value: AtomicU64,
    word: AtomicU32,
    sleepers: AtomicU32,
}

impl SequenceEvent {
    /// Where it stands.
    pub fn get(&self) -> u64 {
        self.value.load(Ordering::Acquire)
    }

    /// Raises the number and wakes who waits for it. Only its owner may call this. What was
    /// written before is visible to who sees the new number.
    pub fn raise(&self, value: u64) {
        self.value.store(value, Ordering::Release);
        self.notify_all();
    }

    /// Wakes every sleeper to look around, without raising anything.
    pub fn notify_all(&self) {
        self.word.fetch_add(1, Ordering::Release);
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 {
            wake_all(&self.word);
        }
    }

    /// Returns when the number has reached `value` (true), when `give_up` says so after somebody
    /// roused us, or when `deadline_nanos` of the monotonic clock has passed (both false).
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

    /// Returns the first answer that `look` gives, asked whenever the number is raised or somebody
    /// rouses; `None` when the deadline has passed.
    pub fn listen<T>(
        &self,
        strategy: Strategy,
        deadline_nanos: Option<u64>,
        look: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        wait_on(&self.word, &self.sleepers, strategy, deadline_nanos, look)
    }
}

/// What many ring and one waits for.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct Notify {
    word: AtomicU32,
    sleepers: AtomicU32,
}

impl Notify {
    /// Makes the listener look, if it sleeps. What was written before is visible to it.
    pub fn ring(&self) {
        self.word.fetch_add(1, Ordering::Release);
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 {
            wake_all(&self.word);
        }
    }

    /// Like [`Notify::ring`], but a listener that sleeps is left asleep while `is_due` says no.
    /// `is_due` reads words that the other ringers write; whoever of them comes last sees all.
    pub fn notify_if(&self, is_due: impl Fn() -> bool) {
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) > 0 && is_due() {
            self.word.fetch_add(1, Ordering::Release);
            wake_all(&self.word);
        }
    }

    /// How often it was rung: a listener that remembers the count sees any ring since.
    pub fn count(&self) -> u32 {
        self.word.load(Ordering::Acquire)
    }

    /// Returns the first answer that `look` gives, or `None` when the deadline has passed.
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
    if strategy.spin_nanos > 0 {
        let begun = now_nanos();
        loop {
            for _ in 0..LOOKS {
                if let Some(answer) = look() {
                    return Some(answer);
                }
                std::hint::spin_loop();
            }
            yield_core();
            let now = now_nanos();
            if now - begun > strategy.spin_nanos {
                break;
            }
            if deadline_nanos.is_some_and(|deadline| now >= deadline) {
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
