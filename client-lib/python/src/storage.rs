//! Where a measurement or a snapshot lies: in shared memory, or in a copy of its own.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

/// Counts what is held in shared memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct HeldCount(Arc<AtomicUsize>);

/// One thing that is held, until dropped.
#[derive(Debug)]
pub(crate) struct Held(Arc<AtomicUsize>);

impl HeldCount {
    pub(crate) fn get(&self) -> usize {
        self.0.load(Ordering::Acquire)
    }

    pub(crate) fn hold(&self) -> Held {
        self.0.fetch_add(1, Ordering::AcqRel);
        Held(Arc::clone(&self.0))
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// A copy of bytes, aligned to 64 bytes as those in shared memory.
pub(crate) struct Copied {
    blocks: Vec<protocol::Block>,
    len: usize,
}

impl Copied {
    pub(crate) fn new(bytes: &[u8]) -> Copied {
        let block = size_of::<protocol::Block>();
        let mut blocks = Vec::with_capacity(bytes.len().div_ceil(block));
        for part in bytes.chunks(block) {
            let mut whole = [0; 64];
            whole[..part.len()].copy_from_slice(part);
            blocks.push(protocol::Block(whole));
        }
        Copied { blocks, len: bytes.len() }
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.blocks)[..self.len]
    }
}
