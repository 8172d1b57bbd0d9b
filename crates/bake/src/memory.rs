//! Parts of files as memory: mapped, or read into arrays.
#![expect(
    unsafe_code,
    reason = "a baked network is used in the mapped file; arrays are read into fresh memory"
)]

use std::{
    fs::File,
    mem::MaybeUninit,
    ops::Range,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use bytemuck::Pod;
use memmap2::{Mmap, MmapOptions};
use rustix::{
    io::pread,
    mm::{Advice, madvise},
};

use crate::checksum::Checksum;

/// Bytes that one thread reads at a time. The checksum of a part is that of the checksums of its
/// blocks, so that threads share the work.
const BLOCK: usize = 4 << 20;
/// Bytes of a block that are read at a time for its checksum alone: they stay in the processor.
const STRETCH: usize = 64 << 10;
/// The most threads that read one part: more do not read faster.
const THREADS_MAX: usize = 8;
/// The size of the kernel's large pages.
const LARGE_PAGE: usize = 2 << 20;

/// Returns the checksum of a part.
pub(crate) fn part_sum(part: &[u8]) -> [u64; 2] {
    sum_of_blocks(&part.chunks(BLOCK).map(Checksum::of).collect::<Vec<_>>())
}

fn sum_of_blocks(sums: &[[u64; 2]]) -> [u64; 2] {
    Checksum::of(bytemuck::cast_slice(sums))
}

/// Reads `count` values of `T` from the byte `from` on, in several threads. Returns them with the
/// checksum of their bytes; `None` if the file is shorter or cannot be read.
pub(crate) fn read_values<T: Pod>(
    file: &File,
    from: u64,
    count: usize,
) -> Option<(Vec<T>, [u64; 2])> {
    let mut values = Vec::<T>::with_capacity(count);
    let room = &mut values.spare_capacity_mut()[..count];
    let length = size_of_val(room);
    // SAFETY: the same bytes; they may be uninitialised as before, and any byte is valid in them.
    let room = unsafe { std::slice::from_raw_parts_mut(room.as_mut_ptr().cast(), length) };
    use_large_pages(room);
    let blocks = room.chunks_mut(BLOCK);
    let mut sums = vec![[0; 2]; blocks.len()];
    let threads = thread::available_parallelism().map_or(1, |n| n.get());
    let threads = threads.min(THREADS_MAX).min(blocks.len());
    let work = Mutex::new((from..).step_by(BLOCK).zip(blocks.zip(&mut sums)));
    let has_failed = AtomicBool::new(false);
    let read = || {
        loop {
            let Some((at, (block, sum))) = work.lock().expect("no panic").next() else { break };
            match read_block(file, at, block) {
                Some(bytes) => *sum = Checksum::of(bytes),
                None => has_failed.store(true, Ordering::Relaxed),
            }
        }
    };
    thread::scope(|scope| {
        (1..threads).for_each(|_| {
            scope.spawn(read);
        });
        read();
    });
    if has_failed.into_inner() {
        return None;
    }
    // SAFETY: every block was filled, so that all bytes of the values are initialised; any bytes
    // are a valid `Pod`.
    unsafe { values.set_len(count) };
    Some((values, sum_of_blocks(&sums)))
}

/// Returns the checksum of `length` bytes of a file from the byte `from` on; `None` if the file is
/// shorter or cannot be read.
pub(crate) fn sum_in_file(file: &File, from: u64, length: u64) -> Option<[u64; 2]> {
    let blocks = length.div_ceil(BLOCK as u64) as usize;
    let mut sums = vec![[0; 2]; blocks];
    let threads = thread::available_parallelism().map_or(1, |n| n.get());
    let threads = threads.min(THREADS_MAX).min(blocks);
    let work = Mutex::new((from..from + length).step_by(BLOCK).zip(&mut sums));
    let has_failed = AtomicBool::new(false);
    let read = || {
        let mut room = Vec::with_capacity(STRETCH);
        loop {
            let Some((at, sum)) = work.lock().expect("no panic").next() else { break };
            let length = BLOCK.min((from + length - at) as usize);
            match sum_of_block(file, at, length, &mut room.spare_capacity_mut()[..STRETCH]) {
                Some(found) => *sum = found,
                None => has_failed.store(true, Ordering::Relaxed),
            }
        }
    };
    thread::scope(|scope| {
        (1..threads).for_each(|_| {
            scope.spawn(read);
        });
        read();
    });
    (!has_failed.into_inner()).then(|| sum_of_blocks(&sums))
}

/// Returns the checksum of a block, through the memory of `room`.
fn sum_of_block(
    file: &File,
    at: u64,
    length: usize,
    room: &mut [MaybeUninit<u8>],
) -> Option<[u64; 2]> {
    let mut sum = Checksum::new();
    let mut done = 0;
    loop {
        let count = room.len().min(length - done);
        let bytes = read_block(file, at + done as u64, &mut room[..count])?;
        done += count;
        if done == length {
            let whole = bytes.len() / 32 * 32;
            sum.add_beginning(&bytes[..whole]);
            sum.add_end(&bytes[whole..], length);
            return Some(sum.digest());
        }
        sum.add_beginning(bytes);
    }
}

/// Fills a block from the byte `at` on; `None` if the file ends before.
fn read_block<'a>(file: &File, at: u64, block: &'a mut [MaybeUninit<u8>]) -> Option<&'a [u8]> {
    let mut done = 0;
    while done < block.len() {
        match pread(file, &mut block[done..], at + done as u64) {
            Ok((read, _)) if !read.is_empty() => done += read.len(),
            Err(rustix::io::Errno::INTR) => {}
            _ => return None,
        }
    }
    // SAFETY: `pread` initialised all bytes.
    Some(unsafe { block.assume_init_ref() })
}

/// Advises the kernel to back the whole large pages of `room` with such: a page fault for each
/// small page took longer than reading it.
fn use_large_pages(room: &mut [MaybeUninit<u8>]) {
    let begin = room.as_mut_ptr().addr();
    let (first, last) =
        (begin.next_multiple_of(LARGE_PAGE), (begin + room.len()) / LARGE_PAGE * LARGE_PAGE);
    if first < last {
        let at = room.as_mut_ptr().wrapping_add(first - begin);
        // SAFETY: the advice changes no byte of the range, which is ours.
        let _ = unsafe { madvise(at.cast(), last - first, Advice::LinuxHugepage) };
    }
}

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

    /// Maps all of `file`, without its pages: each is read when it is first used.
    pub(crate) fn lazy(file: &File) -> Option<Mapped> {
        // SAFETY: as in `new`.
        let map = unsafe { MmapOptions::new().map(file) }.ok()?;
        let part = 0..map.len();
        Some(Mapped { map, part })
    }
}

impl AsRef<[u8]> for Mapped {
    fn as_ref(&self) -> &[u8] {
        &self.map[self.part.clone()]
    }
}
