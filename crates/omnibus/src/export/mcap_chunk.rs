//! The records of an MCAP file as bytes, and the checksums over them.
//!
//! Source: <https://mcap.dev/spec>. The fields of a record are those of the package `mcap`. Its writer
//! computes two checksums of every byte where the file is written, which takes longer than the writing.
//! Here that of a message is computed where the message is made, on any thread, and those of its chunk
//! and of the file are combined from it.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, BufWriter, Cursor, Write},
};

use binrw::BinWrite;
use crc32fast::Hasher;
use mcap::records::{ChunkHeader, ChunkIndex, MessageHeader, MessageIndex, MessageIndexEntry, op};

/// Opcode and length.
const HEAD_BYTES: usize = 9;

/// Data from this size on are moved to the file without a copy.
const LARGE_BYTES: usize = 4096;

/// The level of Zstandard: a higher one takes longer than the disk for what it saves.
const ZSTD_LEVEL: i32 = 1;

/// Bytes with their checksum.
pub(crate) struct Summed {
    bytes: Vec<u8>,
    sum: Hasher,
}

impl Summed {
    /// Computes the checksum.
    pub(crate) fn new(bytes: Vec<u8>) -> Summed {
        let mut sum = Hasher::new();
        sum.update(&bytes);
        Summed { bytes, sum }
    }
}

/// Returns a record with these fields, which `more` further bytes complete.
pub(crate) fn record<T>(code: u8, fields: &T, more: usize) -> io::Result<Vec<u8>>
where
    T: for<'a> BinWrite<Args<'a> = ()>,
{
    let mut bytes = Cursor::new(vec![0; HEAD_BYTES]);
    bytes.set_position(HEAD_BYTES as u64);
    fields.write_le(&mut bytes).map_err(io::Error::other)?;
    let mut bytes = bytes.into_inner();
    bytes[0] = code;
    let len = (bytes.len() - HEAD_BYTES + more) as u64;
    bytes[1..HEAD_BYTES].copy_from_slice(&len.to_le_bytes());
    Ok(bytes)
}

/// A file that is written from front to back, with the checksum of all bytes so far.
pub(crate) struct SummedFile {
    // Images and points are larger than the buffer, and pass by it without a copy.
    file: BufWriter<File>,
    pub(crate) sum: Hasher,
    pub(crate) position: u64,
}

impl SummedFile {
    pub(crate) fn new(file: File) -> SummedFile {
        SummedFile { file: BufWriter::new(file), sum: Hasher::new(), position: 0 }
    }

    pub(crate) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sum.update(bytes);
        self.position += bytes.len() as u64;
        self.file.write_all(bytes)
    }

    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    /// Writes parts whose checksum is known.
    fn put_parts(&mut self, parts: &[Vec<u8>], sum: &Hasher) -> io::Result<()> {
        self.sum.combine(sum);
        self.position += parts.iter().map(|part| part.len() as u64).sum::<u64>();
        parts.iter().try_for_each(|part| self.file.write_all(part))
    }
}

/// Records that are written together, and where in them the messages of each channel are.
#[derive(Default)]
pub(crate) struct Chunk {
    parts: Vec<Vec<u8>>,
    /// The end of the records, until a large part follows.
    small: Vec<u8>,
    sum: Hasher,
    bytes: u64,
    /// First and last time of a message.
    times: Option<(u64, u64)>,
    messages: BTreeMap<u16, Vec<MessageIndexEntry>>,
}

impl Chunk {
    /// Returns the number of bytes so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Appends a schema or a channel.
    pub(crate) fn put(&mut self, record: &[u8]) {
        self.sum.update(record);
        self.small.extend_from_slice(record);
        self.bytes += record.len() as u64;
    }

    /// Appends a message.
    pub(crate) fn put_message(&mut self, header: &MessageHeader, data: Summed) -> io::Result<()> {
        let entry = MessageIndexEntry { log_time: header.log_time, offset: self.bytes };
        self.messages.entry(header.channel_id).or_default().push(entry);
        let (first, last) = self.times.unwrap_or((header.log_time, header.log_time));
        self.times = Some((first.min(header.log_time), last.max(header.log_time)));
        self.put(&record(op::MESSAGE, header, data.bytes.len())?);
        self.sum.combine(&data.sum);
        self.bytes += data.bytes.len() as u64;
        if data.bytes.len() < LARGE_BYTES {
            self.small.extend_from_slice(&data.bytes);
        } else {
            self.parts.extend([std::mem::take(&mut self.small), data.bytes]);
        }
        Ok(())
    }

    /// Writes the chunk and the index of its messages, and returns what the summary says of it; `None` if
    /// it is empty.
    pub(crate) fn write(
        mut self,
        file: &mut SummedFile,
        is_compressed: bool,
    ) -> io::Result<Option<ChunkIndex>> {
        if self.bytes == 0 {
            return Ok(None);
        }
        self.parts.push(self.small);
        let uncompressed_crc = self.sum.clone().finalize();
        let mut compressed_size = self.bytes;
        if is_compressed {
            let mut encoder = zstd::Encoder::new(Vec::new(), ZSTD_LEVEL)?;
            self.parts.iter().try_for_each(|part| encoder.write_all(part))?;
            let compressed = Summed::new(encoder.finish()?);
            compressed_size = compressed.bytes.len() as u64;
            (self.parts, self.sum) = (vec![compressed.bytes], compressed.sum);
        }
        let (message_start_time, message_end_time) = self.times.unwrap_or_default();
        let compression = if is_compressed { "zstd".to_owned() } else { String::new() };
        let header = ChunkHeader {
            message_start_time,
            message_end_time,
            uncompressed_size: self.bytes,
            uncompressed_crc,
            compression: compression.clone(),
            compressed_size,
        };
        let chunk_start_offset = file.position;
        file.put(&record(op::CHUNK, &header, compressed_size as usize)?)?;
        file.put_parts(&self.parts, &self.sum)?;
        let chunk_length = file.position - chunk_start_offset;
        let index_begin = file.position;
        let mut message_index_offsets = BTreeMap::new();
        for (channel_id, records) in self.messages {
            message_index_offsets.insert(channel_id, file.position);
            let index = MessageIndex { channel_id, records };
            file.put(&record(op::MESSAGE_INDEX, &index, 0)?)?;
        }
        Ok(Some(ChunkIndex {
            message_start_time,
            message_end_time,
            chunk_start_offset,
            chunk_length,
            message_index_offsets,
            message_index_length: file.position - index_begin,
            compression,
            compressed_size,
            uncompressed_size: self.bytes,
        }))
    }
}
