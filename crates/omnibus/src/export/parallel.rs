//! Work on several threads whose results arrive in order.

use std::{
    collections::BTreeMap,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

use crossbeam::channel;

/// The number of threads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Threads(usize);

impl Threads {
    /// Returns this number of threads; for 0 one per core.
    pub(crate) fn new(count: usize) -> Threads {
        match count {
            0 => Threads(thread::available_parallelism().map_or(2, usize::from)),
            some => Threads(some.min(256)),
        }
    }

    /// Makes the results 0 to `count` on all threads and passes them to `take` in order. Few of them
    /// are in memory at a time. The first error in the order ends the work.
    pub(crate) fn in_order<T: Send>(
        self,
        count: usize,
        make: impl Fn(usize) -> anyhow::Result<T> + Sync,
        mut take: impl FnMut(usize, T) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let next = AtomicUsize::new(0);
        // Whoever holds a permit may claim the next index, so that no result is far ahead of others.
        let ahead = self.0 * 3;
        let (give_permit, permits) = channel::bounded(ahead);
        for _ in 0..ahead {
            give_permit.send(()).expect("the receiver lives");
        }
        let (done, results) = channel::bounded(ahead);
        thread::scope(|scope| {
            for _ in 0..self.0.min(count) {
                let (permits, done, next, make) = (permits.clone(), done.clone(), &next, &make);
                scope.spawn(move || {
                    while permits.recv().is_ok() {
                        let index = next.fetch_add(1, Ordering::Relaxed);
                        if index >= count || done.send((index, make(index))).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(done);
            // Both ends are dropped at an error, which ends the threads.
            let (give_permit, results) = (give_permit, results);
            let mut early = BTreeMap::new();
            let mut expected = 0;
            for (index, result) in &results {
                early.insert(index, result);
                while let Some(result) = early.remove(&expected) {
                    take(expected, result?)?;
                    expected += 1;
                    let _ = give_permit.send(());
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_arrive_in_order_and_few_are_ahead() {
        let threads = Threads::new(3);
        let taken = AtomicUsize::new(0);
        let make = |index: usize| {
            assert!(index <= taken.load(Ordering::SeqCst) + 9, "{index} is far ahead");
            // The first of each three is the slowest.
            (0..(3 - index % 3) * 1000).for_each(|_| std::hint::spin_loop());
            Ok(index * 2)
        };
        let mut results = Vec::new();
        let take = |index, result| {
            assert_eq!(index, results.len());
            results.push(result);
            taken.fetch_add(1, Ordering::SeqCst);
            Ok(())
        };
        threads.in_order(50, make, take).unwrap();
        assert_eq!(results, (0..50).map(|index| index * 2).collect::<Vec<_>>());
    }

    #[test]
    fn the_first_error_in_the_order_ends_the_work() {
        let make = |index: usize| match index {
            7 => Err(anyhow::anyhow!("seven")),
            8.. => Err(anyhow::anyhow!("later")),
            _ => Ok(()),
        };
        let mut taken = 0;
        let take = |_, ()| {
            taken += 1;
            Ok(())
        };
        let ended = Threads::new(4).in_order(1_000_000, make, take);
        assert_eq!((ended.unwrap_err().to_string(), taken), ("seven".to_owned(), 7));
    }
}
