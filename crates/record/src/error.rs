use std::path::PathBuf;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system.
    #[error("{path}: {why}", path = path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What it said.
        why: std::io::Error,
    },
    /// It is something else.
    #[error("{path} is no recording of this simulator: {why}", path = path.display())]
    NotARecording {
        /// Which file.
        path: PathBuf,
        /// What is there instead.
        why: String,
    },
    /// It was written by a build that writes another form.
    #[error(
        "{path} is a recording of format version {found}, this build reads format version {supported}; \
         read it with the build that wrote it, or record it again",
        path = path.display()
    )]
    Version {
        /// Which file.
        path: PathBuf,
        /// The form it has.
        found: String,
        /// The form that is read.
        supported: u32,
    },
    /// It contradicts itself.
    #[error("{path} is damaged: {why}", path = path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// Where, and what.
        why: String,
    },
    /// Its profile lacks what was asked for.
    #[error("{path} is a recording of profile {profile}; {what}", path = path.display())]
    NotInProfile {
        /// Which file.
        path: PathBuf,
        /// Its profile.
        profile: &'static str,
        /// What is not in it.
        what: &'static str,
    },
    /// The container.
    #[error("MCAP: {0}")]
    Container(#[from] mcap::McapError),
    /// The thread that writes.
    #[error("the recording ended early: {0}")]
    Ended(String),
}

/// Bytes that contradict themselves; where is said by who knows the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Damage(pub(crate) &'static str);

impl RecordError {
    pub(crate) fn file(path: &std::path::Path, why: std::io::Error) -> RecordError {
        RecordError::File { path: path.to_owned(), why }
    }
}
