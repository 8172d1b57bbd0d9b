//! Files and standard output of `omnibus map`.

use std::{
    io::Write,
    path::{Path, PathBuf},
};

use anyhow::Context;

/// Writes a file atomically: it gets its name when it is complete.
pub(crate) fn write_file(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = PathBuf::from(part);
    let written: anyhow::Result<()> = (|| {
        let mut file = std::io::BufWriter::new(std::fs::File::create(&part)?);
        fill(&mut file)?;
        file.into_inner().map_err(|e| e.into_error())?;
        std::fs::rename(&part, path)?;
        Ok(())
    })();
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written.with_context(|| format!("writing {}", path.display()))
}

/// Writes many lines to standard output. A closed pipe is not an error.
pub(crate) fn write_stdout(
    fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> anyhow::Result<()> {
    let mut out = std::io::BufWriter::with_capacity(1 << 16, std::io::stdout().lock());
    match fill(&mut out).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        ended => ended.context("standard output"),
    }
}
