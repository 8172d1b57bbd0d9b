//! How commands that read a recording find its file.

use std::path::{Path, PathBuf};

use client_lib::{ClientError, saved_path};

/// Returns the path of a recording that is to be read.
///
/// A name without a folder means the file of that name in the folder for recordings, where `record`
/// writes it, or else the one in the current folder. Every command that reads a recording resolves
/// its path here.
pub(crate) fn existing_recording(name: &Path) -> Result<PathBuf, ClientError> {
    let saved = saved_path(&name.to_string_lossy())?;
    Ok(if !saved.exists() && name.exists() { name.to_owned() } else { saved })
}
