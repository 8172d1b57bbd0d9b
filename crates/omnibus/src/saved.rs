//! How commands that read a recording find its file.

use std::path::{Path, PathBuf};

use client_lib::{ClientError, saved_path};

/// Returns the path of a recording that is to be read.
///
/// A name without a folder means the file of that name in the folder for recordings, where `record`
/// writes it, or else the one in the folder of CARLA's clients, or else the one in the current
/// folder. Every command that reads a recording resolves
/// its path here.
pub(crate) fn existing_recording(name: &Path) -> Result<PathBuf, ClientError> {
    let saved = saved_path(&name.to_string_lossy())?;
    if saved.exists() {
        return Ok(saved);
    }
    let is_plain = name.file_name() == Some(name.as_os_str());
    let of_clients = carla_gateway::default_recordings_folder().filter(|_| is_plain);
    if let Some(path) = of_clients.map(|folder| folder.join(name)).filter(|path| path.exists()) {
        return Ok(path);
    }
    if !name.exists() {
        return Ok(saved);
    }
    // The host, which opens the file too, takes a name without a folder for a saved one.
    Ok(std::path::absolute(name).unwrap_or_else(|_| name.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_means_a_saved_recording_or_else_a_file_in_the_current_folder() {
        let here = existing_recording(Path::new("Cargo.toml")).unwrap();
        assert!(here.is_absolute() && here.is_file(), "{}", here.display());
        let missing = existing_recording(Path::new("no-such-recording.mcap")).unwrap();
        assert_eq!(missing, saved_path("no-such-recording.mcap").unwrap());
    }
}
