//! JSON arrays that are written item by item.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use serde::Serialize;

/// A file that holds one JSON array.
pub(crate) struct Table {
    path: PathBuf,
    file: BufWriter<File>,
    count: u64,
}

impl Table {
    /// Creates the file.
    pub(crate) fn create(path: &Path) -> anyhow::Result<Table> {
        let file = File::create(path).with_context(|| path.display().to_string())?;
        let mut table = Table { path: path.to_owned(), file: BufWriter::new(file), count: 0 };
        table.write(b"[")?;
        Ok(table)
    }

    /// Appends an item.
    pub(crate) fn push(&mut self, item: &impl Serialize) -> anyhow::Result<()> {
        let text = serde_json::to_vec(item).context("an item without a JSON form")?;
        self.write(if self.count == 0 { b"\n" } else { b",\n" })?;
        self.write(&text)?;
        self.count += 1;
        Ok(())
    }

    /// Returns the number of items.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Ends the array.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        self.write(b"\n]\n")?;
        self.file.flush().with_context(|| self.path.display().to_string())
    }

    fn write(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        self.file.write_all(bytes).with_context(|| self.path.display().to_string())
    }
}
