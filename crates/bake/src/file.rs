//! One file of the cache: a header, a table of parts, and the parts.

use std::{
    fs::File,
    io::{self, Read, Write},
    os::unix::fs::FileExt,
    path::Path,
    sync::Arc,
};

use bytemuck::{Pod, Zeroable};

use crate::{
    checksum::Checksum,
    memory::{Mapped, part_sum, read_values, sum_in_file},
    values::Values,
};

const MAGIC: [u8; 8] = *b"omnibak3";

/// The most parts that a file may have.
const PARTS_MAX: u64 = 32;
/// Each part begins at a multiple of this, so that its values are aligned where it is mapped.
const ALIGNMENT: u64 = 64;

/// The beginning of a file. One [`Row`] per part follows, then the parts; between them are zeros up
/// to the next multiple of [`ALIGNMENT`].
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
    /// Where each part begins.
    begins: Vec<u64>,
    next: usize,
    /// The whole file, since a part was mapped as values.
    map: Option<Arc<Mapped>>,
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
        if Checksum::of(bytemuck::cast_slice(&rows)) != header.sum {
            return None;
        }
        let mut begins = Vec::with_capacity(rows.len());
        let mut end = (size_of::<Header>() + size_of_val(&*rows)) as u64;
        for row in &rows {
            let begin = end.checked_next_multiple_of(ALIGNMENT)?;
            let mut zeros = [0; ALIGNMENT as usize];
            let zeros = &mut zeros[..(begin - end) as usize];
            file.read_exact_at(zeros, end).ok()?;
            if zeros.iter().any(|byte| *byte != 0) {
                return None;
            }
            begins.push(begin);
            end = begin.checked_add(row.length)?;
        }
        let is_whole = file.metadata().is_ok_and(|metadata| metadata.len() == end);
        is_whole.then_some(Parts { file, rows, begins, next: 0, map: None })
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

    /// Returns the next part as values of `T` in the mapped file: processes share its pages, and only
    /// those that are read count as resident. `None` as for [`Parts::take`].
    pub fn share<T: Pod>(&mut self) -> Option<Values<T>> {
        let (from, row) = self.skip()?;
        // The sum is that of the file and not of the mapping, whose pages would become resident.
        if sum_in_file(&self.file, from, row.length)? != row.sum {
            return None;
        }
        let map = match &self.map {
            Some(map) => map,
            None => self.map.insert(Arc::new(Mapped::lazy(&self.file)?)),
        };
        let from = usize::try_from(from).ok()?;
        let part = from..from.checked_add(usize::try_from(row.length).ok()?)?;
        Values::mapped(Arc::clone(map), part)
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
        let from = *self.begins.get(self.next)?;
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
    let mut end = (size_of::<Header>() + size_of_val(&*rows)) as u64;
    for part in parts {
        let begin = end.next_multiple_of(ALIGNMENT);
        file.write_all(&[0; ALIGNMENT as usize][..(begin - end) as usize])?;
        file.write_all(part)?;
        end = begin + part.len() as u64;
    }
    Ok(())
}
