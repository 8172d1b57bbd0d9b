use std::{
    io,
    path::{Path, PathBuf},
};

use client_lib::ClientError;

use crate::collect::format::FORMAT;

/// Why a data set was not written, or is faulty.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CollectError {
    /// An argument out of range.
    #[error("{0}")]
    Argument(String),
    /// The folder holds something else.
    #[error("{dir} is not empty: it holds {what}; {advice}", dir = .dir.display())]
    Occupied { dir: PathBuf, what: String, advice: &'static str },
    /// Another process writes to the folder.
    #[error("{dir} is being written by another omnibus collect; choose another --out", dir = .dir.display())]
    Busy { dir: PathBuf },
    /// The file system reported an error.
    #[error("{path}: {why}", path = .path.display())]
    Io { path: PathBuf, why: io::Error },
    /// The disk is full.
    #[error("the disk is full: there was no room for {path}; free some space", path = .path.display())]
    DiskFull { path: PathBuf },
    /// A file of the data set cannot be parsed.
    #[error("{path}: {why}", path = .path.display())]
    Damaged { path: PathBuf, why: String },
    /// The data set has another version of the format.
    #[error(
        "{path}: unsupported data set format {format:?}, this build reads {FORMAT:?}; read it with \
         the build that wrote it, or collect it again",
        path = .path.display()
    )]
    OtherFormat { path: PathBuf, format: String },
    /// A resumed run has other settings.
    #[error(
        "{dir} was collected with {key} {recorded}, this command has {requested}; resume with the \
         same settings, or choose another --out",
        dir = .dir.display()
    )]
    OtherSettings { dir: PathBuf, key: String, recorded: String, requested: String },
    /// A resumed run reached another state.
    #[error(
        "frame {frame} has state hash {now}, but {recorded} was recorded; another build \
         or another machine made {dir}, so it cannot be continued: choose another --out",
        dir = .dir.display()
    )]
    Diverged { dir: PathBuf, frame: u64, recorded: String, now: String },
    /// The map has no free spawn point for the ego.
    #[error("no spawn point for the ego on map {map}: {why}")]
    NoSpawnPoint { map: String, why: String },
    /// The simulator reported an error.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The bundle and the snapshot are of different frames.
    #[error("the sensor bundle measured {measured}, expected frame {frame} (state hash {hash})")]
    WrongFrame { frame: u64, hash: String, measured: String },
    /// An image could not be encoded, or a thread panicked.
    #[error("{what}: {why}; this is a bug in omnibus")]
    Bug { what: &'static str, why: String },
    /// Ctrl-C or SIGTERM ended the run.
    #[error("stopped")]
    Stopped,
    /// The run ended early.
    #[error(
        "{why}; {complete} of {wanted} frames are complete in {dir}, the same command with \
         --resume continues there",
        dir = .dir.display()
    )]
    CutShort { why: Box<CollectError>, dir: PathBuf, complete: u64, wanted: u64 },
    /// `--verify` found faults; a line for each kind.
    #[error("{dir} has faults\n{faults}", dir = .dir.display())]
    Unsound { dir: PathBuf, faults: String },
    /// Scenes of a collection are missing or have faults; the lines name each.
    #[error("{dir}: {count} of {scenes} scenes have faults\n{faults}", dir = .dir.display())]
    UnsoundScenes { dir: PathBuf, count: usize, scenes: usize, faults: String },
    /// The folder holds no data set.
    #[error(
        "{dir} holds neither metadata.json nor a scene-*/metadata.json; is it a data set of omnibus \
         collect?",
        dir = .dir.display()
    )]
    NoDataSet { dir: PathBuf },
    /// Files of the data set are missing or faulty.
    #[error("{dir}: {count} faults, the first: {first}", dir = .dir.display())]
    Faulty { dir: PathBuf, count: usize, first: String },
}

impl CollectError {
    /// Returns the error for a failed operation on a path.
    pub(crate) fn io(path: &Path, why: io::Error) -> CollectError {
        let path = path.to_owned();
        match why.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                CollectError::DiskFull { path }
            }
            _ => CollectError::Io { path, why },
        }
    }

    /// Returns the error for a file that cannot be parsed.
    pub(crate) fn damaged(path: &Path, why: impl ToString) -> CollectError {
        CollectError::Damaged { path: path.to_owned(), why: why.to_string() }
    }
}
