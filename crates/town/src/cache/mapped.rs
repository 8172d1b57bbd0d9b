//! Parts of files as memory.
#![expect(unsafe_code, reason = "what lies in a file is used there, not copied")]

use std::fs::File;
use std::ops::Range;

use memmap2::{Mmap, MmapOptions};

/// A part of a file, where it lies.
#[derive(Debug)]
pub(super) struct Mapped {
    map: Mmap,
    part: Range<usize>,
}

impl Mapped {
    /// The part of `file` that begins at `from`; none if the file is shorter.
    pub(super) fn new(file: &File, from: u64, length: u64) -> Option<Mapped> {
        let (from, length) = (usize::try_from(from).ok()?, usize::try_from(length).ok()?);
        // SAFETY: a file of the cache is written under another name, renamed when it is whole, and
        // from then on removed at most, which leaves its memory to those who have it. Who else
        // writes into our folder breaks this, as they could break the program itself.
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
