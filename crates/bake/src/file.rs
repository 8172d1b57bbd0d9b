//! One file of the cache: a header, a table of parts, and the parts.

use std::{
    fs::File,
    io::{self, Read, Write},
    path::Path,
};

use bytemuck::{Pod, Zeroable};

use crate::{
    checksum::Checksum,
    memory::{Mapped, part_sum, read_values},
};

const MAGIC: [u8; 8] = *b"omnibak2";

/// The most parts that a file may have.
const PARTS_MAX: u64 = 16;

/// The beginning of a file. One [`Row`] per part follows, then the parts without gaps.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 8],
    key: [u64; 2],
    parts: u64,
    /// The checksum of the rows.
    sum: [u64; 2],
}

/// The length of a part in bytes, and its checksum.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Row {
    length: u64,
    sum: [u64; 2],
}

/// The parts of a baked item, read in the order in which they were kept.
#[derive(Debug)]
pub struct Parts {
    file: File,
    rows: Vec<Row>,
    next: usize,
}

impl Parts {
    /// Opens a file whose header names this key; `None` if it is missing, foreign or cut short.
    pub(crate) fn open(path: &Path, key: [u64; 2]) -> Option<Parts> {
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
        let is_whole = length == file.metadata().ok().map(|metadata| metadata.len());
        (is_whole && Checksum::of(bytemuck::cast_slice(&rows)) == header.sum).then_some(Parts {
            file,
            rows,
            next: 0,
        })
    }

    /// Copies the next part as values of `T`; `None` if there is none, its length does not fit, or
    /// its checksum does not match.
    pub fn take<T: Pod>(&mut self) -> Option<Vec<T>> {
        let (from, row) = self.skip()?;
        let length = usize::try_from(row.length).ok()?;
        if length % size_of::<T>() != 0 {
            return None;
        }
        let (values, sum) = read_values(&self.file, from, length / size_of::<T>())?;
        (sum == row.sum).then_some(values)
    }

    /// Maps the next part into memory. The caller must verify its checksum before it trusts the
    /// bytes.
    pub(crate) fn map(&mut self) -> Option<(Mapped, ExpectedSum)> {
        let (from, row) = self.skip()?;
        let mapped = Mapped::new(&self.file, from, row.length)?;
        Some((mapped, ExpectedSum(row.sum)))
    }

    /// Returns where the next part begins, and its row, and goes on to the part after it.
    fn skip(&mut self) -> Option<(u64, Row)> {
        let before = &self.rows[..self.next];
        let from = size_of::<Header>() as u64
            + size_of_val(&*self.rows) as u64
            + before.iter().map(|row| row.length).sum::<u64>();
        let row = *self.rows.get(self.next)?;
        self.next += 1;
        Some((from, row))
    }

    /// Reads the remaining parts and returns whether all of their checksums match.
    pub(crate) fn is_intact(&mut self) -> bool {
        (self.next..self.rows.len()).all(|_| self.take::<u8>().is_some())
    }
}

/// The checksum that a part must have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExpectedSum([u64; 2]);

impl ExpectedSum {
    /// Whether `bytes` have this checksum.
    pub(crate) fn matches(self, bytes: &[u8]) -> bool {
        part_sum(bytes) == self.0
    }
}

/// Writes a whole file.
pub(crate) fn write(path: &Path, key: [u64; 2], parts: &[&[u8]]) -> io::Result<()> {
    let row = |part: &&[u8]| Row { length: part.len() as u64, sum: part_sum(part) };
    let rows: Vec<Row> = parts.iter().map(row).collect();
    let sum = Checksum::of(bytemuck::cast_slice(&rows));
    let header = Header { magic: MAGIC, key, parts: rows.len() as u64, sum };
    let mut file = File::create_new(path)?;
    file.write_all(bytemuck::bytes_of(&header))?;
    file.write_all(bytemuck::cast_slice(&rows))?;
    parts.iter().try_for_each(|part| file.write_all(part))
}
