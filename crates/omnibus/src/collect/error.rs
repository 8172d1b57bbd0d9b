use std::{
    io,
    path::{Path, PathBuf},
};

use client_lib::ClientError;

use crate::collect::format::FORMAT;

/// Why a data set was not made, or is not what it should be.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CollectError {
    /// A number that cannot be meant.
    #[error("{0}")]
    Argument(String),
    /// There is something in the folder already.
    #[error("{dir} is not empty: it description {what}; {advice}", dir = .dir.display())]
    Occupied { dir: PathBuf, what: String, advice: &'static str },
    /// Another process writes there.
    #[error("{dir} is being written by another omnibus collect; choose another --out", dir = .dir.display())]
    Busy { dir: PathBuf },
    /// The file system refused something.
    #[error("{path}: {why}", path = .path.display())]
    Io { path: PathBuf, why: io::Error },
    /// No space left.
    #[error("the disk is full: there was no room for {path}; free some space", path = .path.display())]
    DiskFull { path: PathBuf },
    /// A file of the data set makes no sense.
    #[error("{path}: {why}", path = .path.display())]
    Damaged { path: PathBuf, why: String },
    /// The data set has another version of the format.
    #[error(
        "{path}: unsupported data set format {format:?}, this build reads {FORMAT:?}; read it with \
         the build that wrote it, or collect it again",
        path = .path.display()
    )]
    OtherFormat { path: PathBuf, format: String },
    /// A resumed run is asked to be another one.
    #[error(
        "{dir} was collected with {key} {recorded}, this command says {asked}; resume with the \
         same settings, or choose another --out",
        dir = .dir.display()
    )]
    OtherSettings { dir: PathBuf, key: String, recorded: String, asked: String },
    /// A resumed run came to another state.
    #[error(
        "frame {frame} comes out with state hash {now}, but {recorded} was recorded; another build \
         or another machine made {dir}, so it cannot be continued: choose another --out",
        dir = .dir.display()
    )]
    Diverged { dir: PathBuf, frame: u64, recorded: String, now: String },
    /// There is no index to start from.
    #[error("no index for the ego on map {map}: {why}")]
    NoSpawnPoint { map: String, why: String },
    /// The simulator.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The bundle is not of the frame that the snapshot is of.
    #[error("the rig measured {measured} where frame {frame} (state hash {hash}) was due")]
    WrongFrame { frame: u64, hash: String, measured: String },
    /// An image could not be encoded, or a thread died: a bug of ours.
    #[error("{what}: {why}; this is a bug of omnibus")]
    Bug { what: &'static str, why: String },
    /// A person or a scheduler ended it.
    #[error("stopped")]
    Stopped,
    /// Something ended the run, and what there is by then.
    #[error(
        "{why}; {complete} of {wanted} frames are complete in {dir}, the same command with \
         --resume continues there",
        dir = .dir.display()
    )]
    CutShort { why: Box<CollectError>, dir: PathBuf, complete: u64, wanted: u64 },
    /// A data set lacks something.
    #[error("{dir}: {count} faults, the first: {first}", dir = .dir.display())]
    Faulty { dir: PathBuf, count: usize, first: String },
}

impl CollectError {
    /// What the file system said about a path.
    pub(crate) fn io(path: &Path, why: io::Error) -> CollectError {
        let path = path.to_owned();
        match why.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                CollectError::DiskFull { path }
            }
            _ => CollectError::Io { path, why },
        }
    }

    /// A file that makes no sense.
    pub(crate) fn damaged(path: &Path, why: impl ToString) -> CollectError {
        CollectError::Damaged { path: path.to_owned(), why: why.to_string() }
    }
}
