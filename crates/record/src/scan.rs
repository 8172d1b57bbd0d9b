//! Finds the segments of a file, including one whose writer was killed.

use std::{collections::BTreeMap, fs::File, os::unix::fs::FileExt, path::Path};

use mcap::{
    MAGIC,
    read::parse_record,
    records::{ChunkHeader, Record, op},
};

use crate::{RecordError, columns::Unpacker, write::topic};

/// One chunk of the file, at most a second.
#[derive(Clone, Debug)]
pub(crate) struct Segment {
    /// Offset of the chunk's body.
    at: u64,
    len: u64,
    /// Recorded time at its first frame.
    pub(crate) start_nanos: u64,
    /// Whether its actors can be read without the segments before it.
    pub(crate) is_key: bool,
    /// Whether it begins with the whole world.
    pub(crate) has_world: bool,
}

/// The contents of a file.
pub(crate) struct Scan {
    pub(crate) about: BTreeMap<String, String>,
    /// The map, compressed by zstd.
    pub(crate) map: Vec<u8>,
    pub(crate) segments: Vec<Segment>,
    /// Whether the file was closed.
    pub(crate) is_complete: bool,
}

/// The messages of a segment.
pub(crate) struct Messages {
    bytes: Vec<u8>,
    /// The channel of each message, and the range of its data.
    places: Vec<(u16, std::ops::Range<usize>)>,
}

impl Messages {
    /// Returns the first message on a channel.
    pub(crate) fn of(&self, topic: u16) -> Option<&[u8]> {
        let (_, place) = self.places.iter().find(|(of, _)| *of == topic)?;
        Some(&self.bytes[place.clone()])
    }
}

/// The largest size of a chunk, in bytes.
const CHUNK_MAX: usize = 1 << 28;
/// The largest size of any other record, in bytes.
const RECORD_MAX: u64 = 1 << 30;

/// Walks over the records of the file without reading the bodies of chunks.
pub(crate) fn scan(path: &Path, file: &File) -> Result<Scan, RecordError> {
    let told = |e| RecordError::file(path, e);
    let strange =
        |why: &str| RecordError::NotARecording { path: path.to_owned(), why: why.to_owned() };
    let len = file.metadata().map_err(told)?.len();
    let mut magic = [0; 8];
    if len < 8 || file.read_exact_at(&mut magic, 0).is_err() || magic != *MAGIC {
        return Err(strange("it does not begin as an MCAP file does"));
    }
    let mut found =
        Scan { about: BTreeMap::new(), map: Vec::new(), segments: Vec::new(), is_complete: false };
    let mut at = 8;
    // Whether the indexes of the last segment were found.
    let mut indexed = true;
    while at + 9 <= len {
        let mut head = [0; 9];
        file.read_exact_at(&mut head, at).map_err(told)?;
        let (opcode, body) = (head[0], at + 9);
        let size = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        if size > len - body {
            break;
        }
        at = body + size;
        match opcode {
            op::CHUNK => {
                finish_last_chunk(path, file, &mut found, indexed)?;
                let mut times = [0; 8];
                if size < 40 || file.read_exact_at(&mut times, body).is_err() {
                    break;
                }
                found.segments.push(Segment {
                    at: body,
                    len: size,
                    start_nanos: u64::from_le_bytes(times),
                    is_key: false,
                    has_world: false,
                });
                indexed = false;
            }
            op::MESSAGE_INDEX if size >= 2 => {
                let mut id = [0; 2];
                file.read_exact_at(&mut id, body).map_err(told)?;
                if let Some(segment) = found.segments.last_mut() {
                    segment.keep_last(u16::from_le_bytes(id));
                    // The index of the actors is the last one of a chunk.
                    indexed = true;
                }
            }
            op::METADATA | op::ATTACHMENT if size <= RECORD_MAX => {
                let mut bytes = vec![0; size as usize];
                file.read_exact_at(&mut bytes, body).map_err(told)?;
                if !has_whole_strings(opcode, &bytes) {
                    return Err(strange("a record of it cannot be read"));
                }
                match parse_record(opcode, &bytes) {
                    Ok(Record::Metadata(told)) if told.name == "omnibus" => {
                        found.about = told.metadata;
                    }
                    Ok(Record::Attachment { header, data, .. }) if header.name == "map.xodr" => {
                        found.map = data.into_owned();
                    }
                    Ok(_) => {}
                    Err(_) => return Err(strange("a record of it cannot be read")),
                }
            }
            op::DATA_END => {
                found.is_complete = true;
                break;
            }
            _ => {}
        }
    }
    let known = indexed && found.is_complete;
    finish_last_chunk(path, file, &mut found, known)?;
    if found.about.is_empty() {
        return Err(strange(
            "it is an MCAP file of another kind, or was cut off at its very start",
        ));
    }
    Ok(found)
}

/// Reads a chunk whose indexes were cut off; drops the chunk if it is cut off itself.
fn finish_last_chunk(
    path: &Path,
    file: &File,
    found: &mut Scan,
    known: bool,
) -> Result<(), RecordError> {
    if known {
        return Ok(());
    }
    let Some(segment) = found.segments.last_mut() else { return Ok(()) };
    match read(path, file, segment, &mut Unpacker::default()) {
        Ok(messages) if !messages.places.is_empty() => {
            messages.places.iter().for_each(|(topic, _)| segment.keep_last(*topic));
        }
        // Or it only names the channels.
        _ => drop(found.segments.pop()),
    }
    Ok(())
}

/// Whether every string of a record ends within the record. The parser of the container allocates a
/// string of any length before it reads it.
fn has_whole_strings(opcode: u8, record: &[u8]) -> bool {
    /// Skips a string, or the list of strings of a map: both begin with their length in bytes.
    fn skip(rest: &mut &[u8]) -> bool {
        let skipped = rest.split_first_chunk::<4>().and_then(|(len, after)| {
            let len = usize::try_from(u32::from_le_bytes(*len)).ok()?;
            after.split_at_checked(len)
        });
        skipped.is_some_and(|(_, after)| {
            *rest = after;
            true
        })
    }
    match opcode {
        // A name, and a map of strings.
        op::METADATA => {
            let mut rest = record;
            let mut pairs = &[][..];
            if skip(&mut rest) {
                pairs = rest.get(4..).unwrap_or_default();
            }
            let is_whole = skip(&mut rest);
            while is_whole && !pairs.is_empty() {
                if !skip(&mut pairs) {
                    return false;
                }
            }
            is_whole
        }
        // Two times, a name and a type.
        op::ATTACHMENT => {
            let mut rest = record.get(16..).unwrap_or_default();
            // The length of the data and the checksum follow, whose absence is a panic.
            skip(&mut rest) && skip(&mut rest) && rest.len() >= 12
        }
        // Two times, size and checksum, and the compression.
        op::CHUNK => skip(&mut record.get(28..).unwrap_or_default()),
        _ => true,
    }
}

impl Segment {
    fn keep_last(&mut self, channel: u16) {
        self.is_key |= channel == topic::KEY;
        self.has_world |= channel == topic::WORLD;
    }
}

/// Reads the messages of a segment and checks their CRC.
pub(crate) fn read(
    path: &Path,
    file: &File,
    segment: &Segment,
    unpacker: &mut Unpacker,
) -> Result<Messages, RecordError> {
    let damaged = |why: String| RecordError::Damaged { path: path.to_owned(), why };
    let at = segment.start_nanos as f64 / 1e9;
    let mut bytes = vec![0; segment.len as usize];
    file.read_exact_at(&mut bytes, segment.at).map_err(|e| RecordError::file(path, e))?;
    if !has_whole_strings(op::CHUNK, &bytes) {
        return Err(damaged("a chunk of it is none".to_owned()));
    }
    let unreadable = |e| damaged(format!("the second that begins at {at:.2} s: {e}"));
    let (header, data): (ChunkHeader, _) = match parse_record(op::CHUNK, &bytes) {
        Ok(Record::Chunk { header, data }) => (header, data),
        Ok(_) => return Err(damaged("a chunk of it is none".to_owned())),
        Err(e) => return Err(unreadable(e)),
    };
    let damage = |why: &str| damaged(format!("the second that begins at {at:.2} s: {why}"));
    let size = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
    if size > CHUNK_MAX {
        return Err(damage("its size is absurd"));
    }
    let bytes = match header.compression.as_str() {
        "zstd" => unpacker.decompress(&data, size).map_err(|_| damage("zstd refuses it"))?,
        "" => data.into_owned(),
        _ => return Err(damage("it is packed in a way that we do not know")),
    };
    if header.uncompressed_crc != 0 && crc32fast::hash(&bytes) != header.uncompressed_crc {
        return Err(damage("its checksum is wrong"));
    }
    let mut places = Vec::new();
    let mut at = 0;
    while let Some((head, after)) = bytes[at..].split_first_chunk::<9>() {
        let size = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        let body = usize::try_from(size).ok().and_then(|size| after.split_at_checked(size));
        let (body, _) = body.ok_or_else(|| damage("a record of it ends early"))?;
        let begin = at + head.len();
        at = begin + body.len();
        // Channel, sequence and two times precede the data.
        if head[0] == op::MESSAGE && body.len() >= 22 {
            places.push((u16::from_le_bytes([body[0], body[1]]), begin + 22..at));
        }
    }
    Ok(Messages { bytes, places })
}
