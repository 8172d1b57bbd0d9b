//! Paths of recordings and saved states, and how they are recorded and replayed.

use std::{
    env, fs, io,
    path::{Path, PathBuf},
};

use protocol::FilePath;

use crate::ClientError;

/// How much of a run a recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Profile {
    /// Every published field of every actor, exactly, and the inputs.
    #[default]
    State = 0,
    /// Commands, controls and traffic's decisions: exact by re-simulation, and small.
    Inputs = 1,
    /// Positions within 1 cm and rotations within 0.1 degrees; the smallest.
    Compact = 2,
}

/// Which part of a recording is replayed, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Replay {
    /// Recorded seconds to skip; below 0: counted from the end.
    pub from_s: f64,
    /// Recorded seconds to play; 0: to the end.
    pub duration_s: f64,
    /// Recorded seconds per simulated second. Above 2, poses between two recorded frames are not
    /// interpolated.
    pub time_factor: f32,
    /// Leaves out actors of the role `hero`.
    pub ignore_hero: bool,
}

impl Default for Replay {
    /// The whole recording at recorded speed.
    fn default() -> Self {
        Replay { from_s: 0.0, duration_s: 0.0, time_factor: 1.0, ignore_hero: false }
    }
}

/// Returns the folder of recordings whose name is no path: `$OMNIBUS_SAVED`, else `omnibus/saved` in
/// the user's data folder.
#[must_use]
pub fn saved_folder() -> PathBuf {
    if let Some(folder) = env::var_os("OMNIBUS_SAVED") {
        return folder.into();
    }
    let data = env::var_os("XDG_DATA_HOME").map(PathBuf::from);
    let home = || env::var_os("HOME").map(|home| Path::new(&home).join(".local/share"));
    data.or_else(home).unwrap_or_else(env::temp_dir).join("omnibus/saved")
}

/// Returns the path that a name stands for. CARLA's rule: a name with `/`, `\\` or `:` is a path, else
/// it lies in the [`saved_folder`].
///
/// # Errors
///
/// [`ClientError::BadArgument`] if the name is empty.
pub fn saved_path(name: &str) -> Result<PathBuf, ClientError> {
    if name.is_empty() {
        return Err(ClientError::bad_argument("file", "the name is empty"));
    }
    if name.contains(['/', '\\', ':']) {
        return absolute(Path::new(name));
    }
    absolute(&saved_folder().join(name))
}

/// An absolute path: the host may run in another folder.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf, ClientError> {
    std::path::absolute(path).map_err(|e| file_error(path, e))
}

pub(crate) fn wire_path(path: &Path) -> Result<FilePath, ClientError> {
    FilePath::new(path).map_err(|why| ClientError::bad_argument("file", why))
}

pub(crate) fn read(path: &Path) -> Result<Vec<u8>, ClientError> {
    fs::read(path).map_err(|e| file_error(path, e))
}

pub(crate) fn file_error(path: &Path, source: io::Error) -> ClientError {
    ClientError::File { path: path.to_owned(), source }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_with_a_separator_is_a_path() {
        let there = std::env::temp_dir().join("a.mcap");
        assert_eq!(saved_path(there.to_str().unwrap()).unwrap(), there);
        assert!(saved_path("./a.mcap").unwrap().is_absolute());
        assert_eq!(saved_path("a.mcap").unwrap(), saved_folder().join("a.mcap"));
        assert!(saved_path("").is_err());
    }
}
