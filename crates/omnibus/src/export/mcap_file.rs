//! An MCAP file with messages in protobuf or JSON.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::File,
    io,
    path::{Path, PathBuf},
};

use anyhow::Context;
use crc32fast::Hasher;
use mcap::{
    MAGIC,
    records::{
        AttachmentHeader, AttachmentIndex, Channel, ChunkIndex, DataEnd, Footer, Header,
        MessageHeader, SchemaHeader, Statistics, SummaryOffset, op,
    },
};

use crate::{
    collect::map_lines::LaneMap,
    export::{
        map_scene::map_scene,
        mcap_chunk::{Chunk, Summed, SummedFile, record},
        writing::writing,
    },
};

/// A reader that seeks reads one chunk.
const CHUNK_BYTES: u64 = 4 << 20;

/// A message with the time of what it says.
pub(crate) struct Stamped {
    topic: Cow<'static, str>,
    schema: &'static str,
    time_nanos: u64,
    data: Summed,
}

impl Stamped {
    /// Returns a message at a simulated time, with the checksum of its data. `schema` is one of Foxglove
    /// in protobuf, as `foxglove.Log`; any other name: JSON.
    pub(crate) fn new(
        topic: Cow<'static, str>,
        schema: &'static str,
        time_nanos: u64,
        data: Vec<u8>,
    ) -> Stamped {
        Stamped { topic, schema, time_nanos, data: Summed::new(data) }
    }

    /// Draws a map.
    pub(crate) fn map(map: &LaneMap, time_nanos: u64) -> Stamped {
        let data = map_scene(map, time_nanos).0;
        Stamped::new("/map".into(), "foxglove.SceneUpdate", time_nanos, data)
    }
}

/// A file that is written.
pub(crate) struct McapFile {
    path: PathBuf,
    file: SummedFile,
    is_compressed: bool,
    chunk: Chunk,
    /// The records of schemas and channels, in the order of their numbers, which begin at 1.
    schemas: Vec<(&'static str, Vec<u8>)>,
    channels: BTreeMap<Cow<'static, str>, (u16, Vec<u8>)>,
    chunks: Vec<ChunkIndex>,
    attachments: Vec<AttachmentIndex>,
    statistics: Statistics,
}

impl McapFile {
    /// Creates a file, whose chunks are compressed by Zstandard or not at all.
    pub(crate) fn create(path: &Path, is_compressed: bool) -> anyhow::Result<McapFile> {
        let shown = || path.display().to_string();
        let mut file = SummedFile::new(File::create(path).with_context(shown)?);
        let library = concat!("omnibus ", env!("CARGO_PKG_VERSION")).to_owned();
        let header = record(op::HEADER, &Header { profile: String::new(), library }, 0);
        header.and_then(|header| file.put(MAGIC).and_then(|()| file.put(&header)))?;
        Ok(McapFile {
            path: path.to_owned(),
            file,
            is_compressed,
            chunk: Chunk::default(),
            schemas: Vec::new(),
            channels: BTreeMap::new(),
            chunks: Vec::new(),
            attachments: Vec::new(),
            statistics: Statistics::default(),
        })
    }

    /// Attaches a file.
    pub(crate) fn attach(&mut self, name: &str, kind: &str, data: &[u8]) -> anyhow::Result<()> {
        self.try_attach(name, kind, data).with_context(|| self.path.display().to_string())
    }

    fn try_attach(&mut self, name: &str, kind: &str, data: &[u8]) -> io::Result<()> {
        self.end_chunk()?;
        let (name, media_type) = (name.to_owned(), kind.to_owned());
        let data_size = data.len() as u64;
        let (log_time, create_time) = (0, 0);
        let header = AttachmentHeader {
            log_time,
            create_time,
            name: name.clone(),
            media_type: media_type.clone(),
        };
        // The size of the data, the data, and the sum of all fields.
        let mut bytes = record(op::ATTACHMENT, &header, 8 + data.len() + 4)?;
        bytes.extend(data_size.to_le_bytes());
        bytes.extend(data);
        let sum = crc32fast::hash(&bytes[9..]);
        bytes.extend(sum.to_le_bytes());
        let (offset, length) = (self.file.position, bytes.len() as u64);
        self.file.put(&bytes)?;
        self.attachments.push(AttachmentIndex {
            offset,
            length,
            log_time,
            create_time,
            data_size,
            name,
            media_type,
        });
        Ok(())
    }

    /// Appends a message.
    pub(crate) fn put(&mut self, message: Stamped) -> anyhow::Result<()> {
        writing(|| self.try_put(message)).with_context(|| self.path.display().to_string())
    }

    fn try_put(&mut self, message: Stamped) -> io::Result<()> {
        let channel_id = match self.channels.get(&message.topic) {
            Some((id, _)) => *id,
            None => self.add_channel(&message)?,
        };
        let statistics = &mut self.statistics;
        let time = message.time_nanos;
        let is_first = statistics.message_count == 0;
        let start = if is_first { time } else { statistics.message_start_time.min(time) };
        statistics.message_start_time = start;
        statistics.message_end_time = statistics.message_end_time.max(time);
        let header = MessageHeader {
            channel_id,
            sequence: statistics.message_count as u32,
            log_time: time,
            publish_time: time,
        };
        statistics.message_count += 1;
        *statistics.channel_message_counts.entry(channel_id).or_default() += 1;
        self.chunk.put_message(&header, message.data)?;
        if self.chunk.bytes() >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        self.chunks.extend(chunk.write(&mut self.file, self.is_compressed)?);
        Ok(())
    }

    fn add_channel(&mut self, message: &Stamped) -> io::Result<u16> {
        let name = message.schema;
        let is_json = !name.starts_with("foxglove.");
        let position = self.schemas.iter().position(|(known, _)| *known == name);
        let schema_id = position.unwrap_or(self.schemas.len()) as u16 + 1;
        if position.is_none() {
            let (encoding, data) = match is_json {
                true => ("jsonschema", br#"{"type": "object"}"#.to_vec()),
                false => ("protobuf", foxglove::descriptor()),
            };
            let (name_text, encoding) = (name.to_owned(), encoding.to_owned());
            let header = SchemaHeader { id: schema_id, name: name_text, encoding };
            let mut schema = record(op::SCHEMA, &header, 4 + data.len())?;
            schema.extend((data.len() as u32).to_le_bytes());
            schema.extend(data);
            self.chunk.put(&schema);
            self.schemas.push((name, schema));
        }
        let id = self.channels.len() as u16 + 1;
        let channel = Channel {
            id,
            schema_id,
            topic: message.topic.clone().into_owned(),
            message_encoding: if is_json { "json" } else { "protobuf" }.to_owned(),
            metadata: BTreeMap::new(),
        };
        let channel = record(op::CHANNEL, &channel, 0)?;
        self.chunk.put(&channel);
        self.channels.insert(message.topic.clone(), (id, channel));
        Ok(id)
    }

    /// Ends the file.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        writing(|| self.try_finish()).with_context(|| self.path.display().to_string())
    }

    /// Writes the summary: all but the messages once more, and where it is.
    fn try_finish(&mut self) -> io::Result<()> {
        self.end_chunk()?;
        let data_section_crc = self.file.sum.clone().finalize();
        self.file.put(&record(op::DATA_END, &DataEnd { data_section_crc }, 0)?)?;
        let mut statistics = std::mem::take(&mut self.statistics);
        statistics.schema_count = self.schemas.len() as u16;
        statistics.channel_count = self.channels.len() as u32;
        statistics.attachment_count = self.attachments.len() as u32;
        statistics.chunk_count = self.chunks.len() as u32;
        let records = |code, all: Vec<io::Result<Vec<u8>>>| {
            let all: io::Result<Vec<_>> = all.into_iter().collect();
            all.map(|all| (code, all.concat()))
        };
        let groups = [
            (op::SCHEMA, self.schemas.iter().flat_map(|(_, record)| record.clone()).collect()),
            (op::CHANNEL, self.channels.values().flat_map(|(_, record)| record.clone()).collect()),
            (op::STATISTICS, record(op::STATISTICS, &statistics, 0)?),
            records(
                op::CHUNK_INDEX,
                self.chunks.iter().map(|chunk| record(op::CHUNK_INDEX, chunk, 0)).collect(),
            )?,
            records(
                op::ATTACHMENT_INDEX,
                self.attachments.iter().map(|at| record(op::ATTACHMENT_INDEX, at, 0)).collect(),
            )?,
        ];
        let summary_start = self.file.position;
        self.file.sum = Hasher::new();
        let mut offsets = Vec::new();
        for (group_opcode, bytes) in groups.iter().filter(|(_, bytes)| !bytes.is_empty()) {
            let (group_start, group_length) = (self.file.position, bytes.len() as u64);
            let offset = SummaryOffset { group_opcode: *group_opcode, group_start, group_length };
            offsets.extend(record(op::SUMMARY_OFFSET, &offset, 0)?);
            self.file.put(bytes)?;
        }
        let summary_offset_start = self.file.position;
        self.file.put(&offsets)?;
        let footer = Footer { summary_start, summary_offset_start, summary_crc: 0 };
        let footer = record(op::FOOTER, &footer, 0)?;
        // The sum ends before itself.
        self.file.put(&footer[..footer.len() - 4])?;
        let summary_crc = self.file.sum.clone().finalize();
        self.file.put(&summary_crc.to_le_bytes())?;
        self.file.put(MAGIC)?;
        self.file.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use mcap::{
        MessageStream, Summary,
        sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
    };

    use super::*;

    /// Writes messages of many sizes, two chunks of them, and returns the bytes of the file.
    fn file(name: &str, is_compressed: bool) -> Vec<u8> {
        let path = std::env::temp_dir().join(format!("omnibus-{name}-{}", std::process::id()));
        let mut file = McapFile::create(&path, is_compressed).unwrap();
        file.attach("map.xodr", "application/xml", b"<OpenDRIVE/>").unwrap();
        for index in 0..64 {
            let (topic, schema) = match index % 2 {
                0 => ("/log", "foxglove.Log"),
                _ => ("/state", "omnibus.State"),
            };
            file.put(Stamped::new(topic.into(), schema, time(index), data(index))).unwrap();
        }
        file.finish().unwrap();
        let bytes = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        bytes
    }

    /// The first is not the earliest.
    fn time(index: u64) -> u64 {
        1000 + (index ^ 3)
    }

    fn data(index: u64) -> Vec<u8> {
        (0..index * index * 60).map(|byte| ((byte * index) >> 3) as u8).collect()
    }

    #[test]
    fn the_official_reader_finds_messages_attachments_and_checksums() {
        for is_compressed in [false, true] {
            let bytes = file("messages", is_compressed);
            let mut count = 0;
            for (index, message) in MessageStream::new(&bytes).unwrap().enumerate() {
                let (index, message) = (index as u64, message.unwrap());
                assert_eq!((message.log_time, &message.data[..]), (time(index), &data(index)[..]));
                let schema = message.channel.schema.clone().unwrap();
                let expected = match index % 2 {
                    0 => ("/log", "foxglove.Log", "protobuf"),
                    _ => ("/state", "omnibus.State", "json"),
                };
                let found = (&message.channel.topic[..], &schema.name[..]);
                assert_eq!((found.0, found.1, &message.channel.message_encoding[..]), expected);
                count += 1;
            }
            assert_eq!(count, 64);
            let options = LinearReaderOptions::default()
                .with_validate_chunk_crcs(true)
                .with_validate_data_section_crc(true)
                .with_validate_summary_section_crc(true);
            let mut reader = LinearReader::new_with_options(options);
            let (mut rest, mut records) = (&bytes[..], 0);
            while let Some(event) = reader.next_event() {
                match event.unwrap() {
                    LinearReadEvent::ReadRequest(len) => {
                        let len = len.min(rest.len());
                        reader.insert(len).copy_from_slice(&rest[..len]);
                        reader.notify_read(len);
                        rest = &rest[len..];
                    }
                    LinearReadEvent::Record { .. } => records += 1,
                }
            }
            assert!(records > 64 && rest.is_empty());
        }
    }

    #[test]
    fn the_summary_finds_every_message_by_its_chunk() {
        let bytes = file("summary", false);
        let summary = Summary::read(&bytes).unwrap().unwrap();
        assert!(summary.chunk_indexes.len() >= 2, "{}", summary.chunk_indexes.len());
        let mut times = Vec::new();
        for chunk in &summary.chunk_indexes {
            for messages in summary.read_message_indexes(&bytes, chunk).unwrap().into_values() {
                for entry in messages {
                    let message = summary.seek_message(&bytes, chunk, &entry).unwrap();
                    assert_eq!(message.log_time, entry.log_time);
                    times.push(message.log_time);
                }
            }
        }
        times.sort_unstable();
        assert_eq!(times, (1000..1064).collect::<Vec<_>>());
        let statistics = summary.stats.unwrap();
        let span = (statistics.message_start_time, statistics.message_end_time);
        assert_eq!((statistics.message_count, span), (64, (1000, 1063)));
        let attachment = &summary.attachment_indexes[0];
        let attached = mcap::read::attachment(&bytes, attachment).unwrap();
        assert_eq!((&attached.name[..], &attached.data[..]), ("map.xodr", &b"<OpenDRIVE/>"[..]));
    }
}
