//! An MCAP file with messages in protobuf or JSON.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};

use anyhow::Context;
use mcap::{Attachment, Compression, McapResult, WriteOptions, Writer, records::MessageHeader};

use crate::{
    collect::map_lines::LaneMap,
    export::{map_scene::map_scene, writing::writing},
};

/// A reader that seeks reads one chunk.
const CHUNK_BYTES: u64 = 4 << 20;

/// A message with the time of what it says.
pub(crate) struct Stamped {
    pub(crate) topic: Cow<'static, str>,
    /// A schema of Foxglove in protobuf, as `foxglove.Log`; any other name: JSON.
    pub(crate) schema: &'static str,
    /// Simulated time.
    pub(crate) time_nanos: u64,
    pub(crate) data: Vec<u8>,
}

impl Stamped {
    /// Draws a map.
    pub(crate) fn map(map: &LaneMap, time_nanos: u64) -> Stamped {
        let data = map_scene(map, time_nanos).0;
        Stamped { topic: "/map".into(), schema: "foxglove.SceneUpdate", time_nanos, data }
    }
}

/// A file that is written.
pub(crate) struct McapFile {
    path: PathBuf,
    writer: Writer<BufWriter<File>>,
    schemas: BTreeMap<&'static str, u16>,
    channels: BTreeMap<Cow<'static, str>, u16>,
    sequence: u32,
}

impl McapFile {
    /// Creates a file.
    pub(crate) fn create(
        path: &Path,
        compression: Option<Compression>,
    ) -> anyhow::Result<McapFile> {
        let shown = || path.display().to_string();
        let file = File::create(path).with_context(shown)?;
        let options = WriteOptions::new()
            .profile("")
            .library(concat!("omnibus ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK_BYTES))
            .compression(compression);
        // Images and points are larger than the buffer, and pass by it without a copy.
        let writer = options.create(BufWriter::new(file)).with_context(shown)?;
        let (schemas, channels) = (BTreeMap::new(), BTreeMap::new());
        Ok(McapFile { path: path.to_owned(), writer, schemas, channels, sequence: 0 })
    }

    /// Attaches a file.
    pub(crate) fn attach(&mut self, name: &str, kind: &str, data: Vec<u8>) -> anyhow::Result<()> {
        let attachment = Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: kind.to_owned(),
            data: data.into(),
        };
        self.writer.attach(&attachment).with_context(|| self.path.display().to_string())
    }

    /// Appends a message.
    pub(crate) fn put(&mut self, message: &Stamped) -> anyhow::Result<()> {
        writing(|| self.write(message)).with_context(|| self.path.display().to_string())
    }

    fn write(&mut self, message: &Stamped) -> McapResult<()> {
        let channel_id = match self.channels.get(&message.topic) {
            Some(id) => *id,
            None => self.add_channel(message)?,
        };
        let header = MessageHeader {
            channel_id,
            sequence: self.sequence,
            log_time: message.time_nanos,
            publish_time: message.time_nanos,
        };
        self.sequence += 1;
        self.writer.write_to_known_channel(&header, &message.data)
    }

    fn add_channel(&mut self, message: &Stamped) -> McapResult<u16> {
        let name = message.schema;
        let is_json = !name.starts_with("foxglove.");
        let schema = match self.schemas.get(name) {
            Some(id) => *id,
            None if is_json => {
                self.writer.add_schema(name, "jsonschema", br#"{"type": "object"}"#)?
            }
            None => self.writer.add_schema(name, "protobuf", &foxglove::descriptor())?,
        };
        self.schemas.insert(name, schema);
        let encoding = if is_json { "json" } else { "protobuf" };
        let id = self.writer.add_channel(schema, &message.topic, encoding, &BTreeMap::new())?;
        self.channels.insert(message.topic.clone(), id);
        Ok(id)
    }

    /// Ends the file.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        writing(|| self.writer.finish()).with_context(|| self.path.display().to_string())?;
        Ok(())
    }
}
