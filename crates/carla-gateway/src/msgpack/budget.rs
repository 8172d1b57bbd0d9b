//! How much memory a request may take.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use crate::msgpack::value::Value;

/// The memory that every request may take, and the unit in which a larger one takes more. Bytes.
const UNIT: usize = 1 << 20;

/// The memory that the large requests of all connections share.
#[derive(Debug)]
pub struct Pool {
    /// Units that no request has taken.
    units: AtomicUsize,
}

impl Pool {
    /// Creates a pool of so many MiB.
    pub fn of_mib(mib: usize) -> Pool {
        Pool { units: AtomicUsize::new(mib) }
    }

    fn take(&self) -> bool {
        let less = |units: usize| units.checked_sub(1);
        self.units.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_ok()
    }
}

/// How much of one request is kept in memory. What it has taken from a pool is given back when it
/// is dropped.
#[derive(Debug)]
pub struct Budget {
    /// Something was discarded.
    pub is_exceeded: bool,
    /// The number of values that may still be kept.
    values: usize,
    /// The number of bytes of text that may still be kept.
    bytes: usize,
    pub(super) read: u64,
    /// Bytes that are kept.
    kept: usize,
    /// Units that were taken from the pool.
    taken: usize,
    pool: Option<Arc<Pool>>,
}

impl Budget {
    /// Creates a budget for one request.
    pub fn new(values: usize, bytes: usize) -> Budget {
        Budget { is_exceeded: false, values, bytes, read: 0, kept: 0, taken: 0, pool: None }
    }

    /// Creates a budget that takes from this pool what it needs beyond a MiB.
    pub fn of_pool(values: usize, bytes: usize, pool: &Arc<Pool>) -> Budget {
        Budget { pool: Some(Arc::clone(pool)), ..Budget::new(values, bytes) }
    }

    /// Returns whether another value may be kept.
    pub(super) fn keep_value(&mut self) -> bool {
        let is_kept = self.values > 0 && self.keep(size_of::<Value>());
        if is_kept {
            self.values -= 1;
        }
        self.is_exceeded |= !is_kept;
        is_kept
    }

    /// Returns whether so many bytes of text may be kept.
    pub(super) fn keep_bytes(&mut self, len: usize) -> bool {
        let is_kept = len <= self.bytes && self.keep(len);
        if is_kept {
            self.bytes -= len;
        }
        self.is_exceeded |= !is_kept;
        is_kept
    }

    fn keep(&mut self, bytes: usize) -> bool {
        let Some(pool) = &self.pool else { return true };
        while self.kept + bytes > (1 + self.taken) * UNIT {
            if !pool.take() {
                return false;
            }
            self.taken += 1;
        }
        self.kept += bytes;
        true
    }
}

impl Drop for Budget {
    fn drop(&mut self) {
        if let Some(pool) = &self.pool {
            pool.units.fetch_add(self.taken, Ordering::Relaxed);
        }
    }
}
