//! Checks `wait.rs` and `versioned.rs`, and the protocol that keeps the journal complete, in every
//! interleaving, compiled against loom's atomics.

use loom::thread;
use std::sync::Arc;

mod atoms {
    use std::{cell::RefCell, time::Duration};

    pub(super) use loom::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

    // The kernel's queue of sleepers, which reads the word again under its lock.
    loom::thread_local! {
        static QUEUE: RefCell<Option<std::sync::Arc<Kernel>>> = RefCell::new(None);
    }

    pub(super) struct Kernel {
        lock: loom::sync::Mutex<()>,
        changed: loom::sync::Condvar,
    }

    impl Kernel {
        pub(super) fn new() -> std::sync::Arc<Kernel> {
            std::sync::Arc::new(Kernel {
                lock: loom::sync::Mutex::new(()),
                changed: loom::sync::Condvar::new(),
            })
        }
    }

    pub(super) fn enter(kernel: std::sync::Arc<Kernel>) {
        QUEUE.with(|queue| *queue.borrow_mut() = Some(kernel));
    }

    fn kernel() -> std::sync::Arc<Kernel> {
        QUEUE.with(|queue| queue.borrow().clone().expect("the thread entered the kernel"))
    }

    pub(super) fn sleep_on(word: &AtomicU32, seen: u32, _at_most: Option<Duration>) {
        let kernel = kernel();
        let guard = kernel.lock.lock().unwrap();
        if word.load(Ordering::Relaxed) == seen {
            drop(kernel.changed.wait(guard).unwrap());
        }
    }

    pub(super) fn wake_all(_word: &AtomicU32) {
        let kernel = kernel();
        let _guard = kernel.lock.lock().unwrap();
        kernel.changed.notify_all();
    }

    pub(super) fn yield_core() {
        loom::thread::yield_now();
    }

    pub(super) fn now_nanos() -> u64 {
        0
    }
}

#[path = "wait.rs"]
#[expect(
    dead_code,
    unreachable_pub,
    clippy::duplicate_mod,
    reason = "the model uses a part of the file, with other atomics"
)]
mod wait;

use wait::{Notify, SequenceEvent, Strategy};

#[path = "versioned.rs"]
#[expect(clippy::duplicate_mod, reason = "the same file with other atomics")]
mod versioned;

use versioned::Versioned;

/// Explores every interleaving with at most three preemptions; known lost-wake-up bugs need one or two.
fn check(scenario: impl Fn() + Sync + Send + 'static) {
    let mut model = loom::model::Builder::new();
    model.preemption_bound = Some(3);
    model.check(scenario);
}

#[test]
fn a_waiter_for_a_sequence_number_is_never_left_asleep() {
    check(|| {
        let kernel = atoms::Kernel::new();
        let gate = Arc::new(SequenceEvent::default());
        let waiter = {
            let (kernel, gate) = (kernel.clone(), gate.clone());
            thread::spawn(move || {
                atoms::enter(kernel);
                assert!(gate.wait(1, Strategy::BATCH, None, || false));
            })
        };
        atoms::enter(kernel);
        gate.raise(1);
        waiter.join().unwrap();
    });
}

#[test]
fn the_last_of_two_arrivals_wakes_the_host() {
    use loom::sync::atomic::{AtomicU64, Ordering};
    check(|| {
        let kernel = atoms::Kernel::new();
        let bell = Arc::new(Notify::default());
        let acks = Arc::new([AtomicU64::new(0), AtomicU64::new(0)]);
        let all = |acks: &[AtomicU64; 2]| acks.iter().all(|a| a.load(Ordering::Acquire) >= 1);
        let arrivals: Vec<_> = (0..2)
            .map(|i| {
                let (kernel, bell, acks) = (kernel.clone(), bell.clone(), acks.clone());
                thread::spawn(move || {
                    atoms::enter(kernel);
                    acks[i].store(1, Ordering::Release);
                    bell.notify_if(|| all(&acks));
                })
            })
            .collect();
        atoms::enter(kernel);
        let done = bell.listen(Strategy::BATCH, None, || all(&acks).then_some(()));
        assert!(done.is_some());
        for arrival in arrivals {
            arrival.join().unwrap();
        }
    });
}

#[test]
fn writes_before_a_raise_are_visible_after_the_wait() {
    use loom::sync::atomic::{AtomicU64, Ordering};
    check(|| {
        let kernel = atoms::Kernel::new();
        let gate = Arc::new(SequenceEvent::default());
        let data = Arc::new(AtomicU64::new(0));
        let writer = {
            let (kernel, gate, data) = (kernel.clone(), gate.clone(), data.clone());
            thread::spawn(move || {
                atoms::enter(kernel);
                data.store(7, Ordering::Relaxed);
                gate.raise(1);
            })
        };
        atoms::enter(kernel);
        assert!(gate.wait(1, Strategy::BATCH, None, || false));
        assert_eq!(data.load(Ordering::Relaxed), 7);
        writer.join().unwrap();
    });
}

#[test]
fn settings_are_read_whole_while_they_are_written() {
    check(|| {
        let settings = Arc::new(Versioned::<2>::new());
        let writer = {
            let settings = settings.clone();
            thread::spawn(move || {
                settings.store([1, 1]);
                settings.store([2, 2]);
            })
        };
        let [first, second] = settings.load();
        assert_eq!(first, second);
        writer.join().unwrap();
        assert_eq!(settings.load(), [2, 2]);
    });
}

/// `Shell::send_journal` and `Participant::receive_journal` with a channel of one part: the host keeps
/// back what the stage has no room for, and the stage waits until it has everything.
#[test]
fn a_stage_receives_every_part_of_a_journal_that_is_longer_than_its_channel() {
    use loom::sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    };
    use std::collections::VecDeque;

    const DEPTH: u64 = 1;
    const PARTS: u64 = 2;

    #[derive(Default)]
    struct Bus {
        channel: Mutex<VecDeque<u64>>,
        journal_read: AtomicU64,
        host: Notify,
        complete: SequenceEvent,
    }

    /// Receives what is there, and returns the serial after it.
    fn receive(bus: &Bus, mut next: u64) -> u64 {
        while let Some(part) = bus.channel.lock().unwrap().pop_front() {
            assert_eq!(part, next, "a part was lost");
            next = part + 1;
        }
        next
    }

    check(|| {
        let kernel = atoms::Kernel::new();
        let bus = Arc::new(Bus::default());
        let stage = {
            let (kernel, bus) = (kernel.clone(), bus.clone());
            thread::spawn(move || {
                atoms::enter(kernel);
                let mut next = 0;
                loop {
                    next = receive(&bus, next);
                    bus.journal_read.store(next, Ordering::Release);
                    if next == PARTS {
                        return;
                    }
                    bus.host.notify();
                    let seen = next;
                    bus.complete.listen(Strategy::BATCH, None, || {
                        next = receive(&bus, seen);
                        (next != seen).then_some(())
                    });
                }
            })
        };
        atoms::enter(kernel);
        let mut sent = 0;
        while sent < PARTS {
            let has_room = || sent - bus.journal_read.load(Ordering::Acquire) < DEPTH;
            bus.host.listen(Strategy::BATCH, None, || has_room().then_some(()));
            // An overflow would drop the oldest part.
            let mut channel = bus.channel.lock().unwrap();
            if channel.len() as u64 == DEPTH {
                channel.pop_front();
            }
            channel.push_back(sent);
            drop(channel);
            sent += 1;
            bus.complete.notify_all();
        }
        stage.join().unwrap();
    });
}
