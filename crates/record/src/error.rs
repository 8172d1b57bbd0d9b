use std::path::PathBuf;

use mcap::McapError;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system reported an error.
    #[error("{path}: {why}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error.
        why: std::io::Error,
    },
    /// The file is not a recording.
    #[error("{path} is not a recording of this simulator: {why}", path = path.display())]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What the file is instead.
        why: String,
    },
    /// A file that is not a recording has the name of the one to write.
    #[error(
        "{path} exists and is not a recording; name another file, or remove this one",
        path = path.display()
    )]
    NotReplaced {
        /// The file.
        path: PathBuf,
    },
    /// The recording has another format version.
    #[error(
        "{path} is a recording of format version {found}, this build reads format version {supported}; \
         read it with the build that wrote it, or record it again",
        path = path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// The version of the file.
        found: String,
        /// The version that this build reads.
        supported: u32,
    },
    /// The recording contradicts itself.
    #[error("{path} is damaged: {why}", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where, and what is wrong.
        why: String,
    },
    /// The profile does not keep what was requested.
    #[error("{path} is a recording of profile {profile}; {what}", path = path.display())]
    NotInProfile {
        /// The file.
        path: PathBuf,
        /// Its profile.
        profile: &'static str,
        /// What is missing.
        what: &'static str,
    },
    /// The MCAP container is faulty.
    #[error("MCAP: {0}")]
    Container(#[from] McapError),
    /// The writer thread ended early.
    #[error("the recording ended early: {0}")]
    Ended(String),
}

/// Bytes that contradict themselves. The caller adds the file and the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Damage(pub(crate) &'static str);

impl RecordError {
    pub(crate) fn file(path: &std::path::Path, why: std::io::Error) -> RecordError {
        RecordError::File { path: path.to_owned(), why }
    }

    /// Names the file if the file system reported the error to the container.
    pub(crate) fn at(self, path: &std::path::Path) -> RecordError {
        match self {
            RecordError::Container(McapError::Io(why)) => RecordError::file(path, why),
            // The container writes some records field by field, such as the header of a chunk, and
            // reports an error there as one of parsing.
            RecordError::Container(McapError::Parse(binrw::Error::Io(why))) => {
                RecordError::file(path, why)
            }
            other => other,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{io, path::Path};

    use super::*;

    #[test]
    fn a_full_disk_is_named_wherever_the_container_meets_it() {
        let full = || io::Error::from_raw_os_error(28);
        for error in [McapError::Io(full()), McapError::Parse(binrw::Error::Io(full()))] {
            let said = RecordError::from(error).at(Path::new("a.mcap")).to_string();
            assert_eq!(said, "a.mcap: No space left on device (os error 28)");
        }
    }
}
