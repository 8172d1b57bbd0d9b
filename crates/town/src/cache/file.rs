use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use bytemuck::{Pod, Zeroable};

use super::mapped::Mapped;
use super::sum::Sum;

const MAGIC: [u8; 8] = *b"omnibake";

/// Parts that a file can have.
const PARTS_MAX: u64 = 16;

/// The beginning of a file; a row for each part follows, then the parts without gaps.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 8],
    key: [u64; 2],
    parts: u64,
    /// Over the rows.
    sum: [u64; 2],
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Row {
    length: u64,
    sum: [u64; 2],
}

/// What was found, part by part.
#[derive(Debug)]
pub struct Parts {
    file: File,
    rows: Vec<Row>,
    next: usize,
}

impl Parts {
    pub(super) fn open(path: &Path, key: [u64; 2]) -> Option<Parts> {
        let mut file = File::open(path).ok()?;
        let mut header = Header::zeroed();
        file.read_exact(bytemuck::bytes_of_mut(&mut header)).ok()?;
        if header.magic != MAGIC || header.key != key || header.parts > PARTS_MAX {
            return None;
        }
        let mut rows = vec![Row::zeroed(); header.parts as usize];
        file.read_exact(bytemuck::cast_slice_mut(&mut rows)).ok()?;
        let length =
            rows.iter().try_fold((size_of::<Header>() + size_of_val(&*rows)) as u64, |sum, row| {
                sum.checked_add(row.length)
            });
        let is_whole = length == file.metadata().ok().map(|about| about.len());
        (is_whole && sum_of(bytemuck::cast_slice(&rows)) == header.sum).then_some(Parts {
            file,
            rows,
            next: 0,
        })
    }

    /// The next part, if it is what was kept: many things of this kind.
    pub fn take<T: Pod>(&mut self) -> Option<Vec<T>> {
        let row = *self.rows.get(self.next)?;
        self.next += 1;
        let length = usize::try_from(row.length).ok()?;
        if length % size_of::<T>() != 0 {
            return None;
        }
        let mut things = bytemuck::zeroed_vec::<T>(length / size_of::<T>());
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut things);
        self.file.read_exact(bytes).ok()?;
        (sum_of(bytes) == row.sum).then_some(things)
    }

    /// The next part where it lies in memory, and what to hold it against before it is believed.
    pub(super) fn map(&mut self) -> Option<(Mapped, Check)> {
        let before = &self.rows[..self.next];
        let from = size_of::<Header>() as u64
            + size_of_val(&*self.rows) as u64
            + before.iter().map(|row| row.length).sum::<u64>();
        let row = *self.rows.get(self.next)?;
        self.next += 1;
        let mapped = Mapped::new(&self.file, from, row.length)?;
        Some((mapped, Check(row.sum)))
    }

    /// Whether all parts that are left are what was kept.
    pub(super) fn is_intact(&mut self) -> bool {
        (self.next..self.rows.len()).all(|_| self.take::<u8>().is_some())
    }
}

/// What a part must add up to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Check([u64; 2]);

impl Check {
    pub(super) fn holds(self, bytes: &[u8]) -> bool {
        sum_of(bytes) == self.0
    }
}

/// Writes a whole file.
pub(super) fn write(path: &Path, key: [u64; 2], parts: &[&[u8]]) -> io::Result<()> {
    let row = |part: &&[u8]| Row { length: part.len() as u64, sum: sum_of(part) };
    let rows: Vec<Row> = parts.iter().map(row).collect();
    let sum = sum_of(bytemuck::cast_slice(&rows));
    let header = Header { magic: MAGIC, key, parts: rows.len() as u64, sum };
    let mut file = File::create_new(path)?;
    file.write_all(bytemuck::bytes_of(&header))?;
    file.write_all(bytemuck::cast_slice(&rows))?;
    parts.iter().try_for_each(|part| file.write_all(part))
}

fn sum_of(bytes: &[u8]) -> [u64; 2] {
    let mut sum = Sum::new();
    sum.add(bytes);
    sum.both()
}
