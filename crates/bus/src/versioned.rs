//! Several words that one process writes and others read whole.

use super::atoms::{AtomicU64, Ordering, fence};

/// `N` words that change together. There are two copies; the version says which one holds, so that a
/// writer that is killed in between leaves the last whole value in place.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct Versioned<const N: usize> {
    /// Counts the writes; only rises. Its lowest bit selects the copy.
    version: AtomicU64,
    copies: [[AtomicU64; N]; 2],
}

impl<const N: usize> Versioned<N> {
    /// Stores a new value. Only one process may write.
    pub(crate) fn store(&self, words: [u64; N]) {
        let next = self.version.load(Ordering::Relaxed) + 1;
        // A reader that finds one of the words below also finds the version that ended their use.
        fence(Ordering::Release);
        for (slot, word) in self.copies[(next & 1) as usize].iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
        self.version.store(next, Ordering::Release);
    }

    /// Returns the last value that was stored, never a mixture of two.
    pub(crate) fn load(&self) -> [u64; N] {
        loop {
            let version = self.version.load(Ordering::Acquire);
            let copy = &self.copies[(version & 1) as usize];
            let words = std::array::from_fn(|i| copy[i].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if self.version.load(Ordering::Relaxed) == version {
                return words;
            }
        }
    }
}

#[cfg(test)]
impl<const N: usize> Versioned<N> {
    /// All words zero.
    #[allow(dead_code, reason = "only the copy that the model checker compiles is constructed")]
    pub(crate) fn new() -> Self {
        let zeros = || std::array::from_fn(|_| AtomicU64::new(0));
        Versioned { version: AtomicU64::new(0), copies: [zeros(), zeros()] }
    }
}
