//! Work that several threads share. The results come back in the order of the parts.

use std::{
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// More threads would wait for each other.
const THREADS_MAX: usize = 8;

pub(crate) fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from).min(THREADS_MAX)
}

/// Calls `work` for every part, each on its own thread.
pub(crate) fn each<P: Sync, R: Send>(
    parts: &[P],
    name: &str,
    work: impl Fn(&P) -> R + Sync,
) -> Vec<R> {
    share(parts, parts.len(), name, work)
}

/// Calls `work` for every part on `threads` threads. A thread that has finished a part takes the
/// next one.
pub(crate) fn share<P: Sync, R: Send>(
    parts: &[P],
    threads: usize,
    name: &str,
    work: impl Fn(&P) -> R + Sync,
) -> Vec<R> {
    let threads = threads.min(parts.len());
    if threads < 2 {
        return parts.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<R>>> = parts.iter().map(|_| Mutex::new(None)).collect();
    let run = || {
        while let Some(at) =
            Some(next.fetch_add(1, Ordering::Relaxed)).filter(|at| *at < parts.len())
        {
            let result = work(&parts[at]);
            if let Ok(mut place) = done[at].lock() {
                *place = Some(result);
            }
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads {
            // If a thread cannot be created, the others do its work.
            let _ = thread::Builder::new().name(name.to_owned()).spawn_scoped(scope, run);
        }
        run();
    });
    let result = |(place, part): (Mutex<Option<R>>, &P)| {
        place.into_inner().ok().flatten().unwrap_or_else(|| work(part))
    };
    done.into_iter().zip(parts).map(result).collect()
}
