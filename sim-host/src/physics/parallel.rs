//! The same work on every item of a slice, on several threads.
//!
//! Items do not share state, so the result does not depend on the number of threads or on which of
//! them takes an item.

use std::sync::{Mutex, PoisonError};

/// Items that a thread takes at once.
const CHUNK: usize = 16;

/// Calls `work` for every item, on at most `threads` threads of which each has at least `least`
/// items. The calling thread is one of them.
pub(super) fn for_each<T: Send>(
    items: &mut [T],
    threads: usize,
    least: usize,
    work: impl Fn(&mut T) + Sync,
) {
    let threads = threads.min(items.len() / least.max(1)).max(1);
    if threads == 1 {
        items.iter_mut().for_each(work);
        return;
    }
    let queue = Mutex::new(items.chunks_mut(CHUNK));
    let take = || {
        loop {
            let chunk = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some(chunk) = chunk else { return };
            chunk.iter_mut().for_each(&work);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            // Without another thread this one does all the work.
            let _ = std::thread::Builder::new().name("physics".into()).spawn_scoped(scope, take);
        }
        take();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_worked_on_once() {
        for threads in [1, 2, 3, 16] {
            let mut items = vec![0_u32; 1000];
            for_each(&mut items, threads, 10, |item| *item += 1);
            assert!(items.iter().all(|item| *item == 1), "{threads} threads");
        }
    }
}
