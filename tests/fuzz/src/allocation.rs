//! The bytes that a program allocates: a measure of work that is the same in every run.
#![expect(unsafe_code, reason = "a global allocator that counts forwards to the system's")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    sync::atomic::{AtomicU64, Ordering},
};

/// The system's allocator with a count of bytes. A program that measures work installs it.
pub struct CountingAllocator;

/// The largest request for memory; a larger one would end the process without its input.
const REQUEST_MAX: usize = 1 << 34;

/// Bytes that all threads have allocated so far.
static ALLOCATED: AtomicU64 = AtomicU64::new(0);

/// Returns the bytes that all threads have allocated so far; 0 without the counting allocator.
pub(crate) fn allocated() -> u64 {
    ALLOCATED.load(Ordering::Relaxed)
}

fn count(bytes: usize) {
    if bytes > REQUEST_MAX {
        crate::running::abandon(&format!("it asks for {bytes} bytes at once"));
    }
    ALLOCATED.fetch_add(bytes as u64, Ordering::Relaxed);
}

// SAFETY: every call is forwarded unchanged to the system's allocator; counting does not allocate.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as in `alloc`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size);
        // SAFETY: as in `alloc`; the pointer came from the same allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as in `realloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}
