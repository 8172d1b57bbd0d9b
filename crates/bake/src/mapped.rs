//! Parts of files as memory.
#![expect(unsafe_code, reason = "a baked network is used in the mapped file instead of a copy")]

use std::{fs::File, ops::Range};

use memmap2::{Mmap, MmapOptions};

/// A part of a file, mapped into memory.
#[derive(Debug)]
pub(crate) struct Mapped {
    map: Mmap,
    part: Range<usize>,
}

impl Mapped {
    /// Maps `length` bytes of `file` from the byte `from` on; `None` if the file is shorter.
    pub(crate) fn new(file: &File, from: u64, length: u64) -> Option<Mapped> {
        let (from, length) = (usize::try_from(from).ok()?, usize::try_from(length).ok()?);
        // SAFETY: a file of the cache is written under a temporary name and renamed when it is
        // whole. From then on it is never written, only removed, and a removed file stays valid
        // for existing mappings. A program that writes into the cache folder of the same user
        // could break this, as it could break this program's executable.
        let map = unsafe { MmapOptions::new().populate().map(file) }.ok()?;
        let part = from..from.checked_add(length)?;
        (part.end <= map.len()).then_some(Mapped { map, part })
    }
}

impl AsRef<[u8]> for Mapped {
    fn as_ref(&self) -> &[u8] {
        &self.map[self.part.clone()]
    }
}
