use std::fmt::Debug;

use crate::process;

/// An error of the transport.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusError {
    /// A channel could not be created or opened.
    #[error(
        "channel {name:?} cannot be opened: {why}; was this program built from the same checkout as the host?"
    )]
    Channel {
        /// The channel.
        name: String,
        /// The transport's error.
        why: String,
    },
    /// A channel could not be opened because this process has as many files open as it may.
    #[error(
        "channel {name:?} cannot be opened: this process may have {limit} files open (ulimit -n), and has; raise the limit"
    )]
    OpenFiles {
        /// The channel.
        name: String,
        /// The largest number of open files.
        limit: u64,
    },
    /// A port could not be created or used.
    #[error("{what} {name:?}: {why}")]
    Port {
        /// The kind of the port.
        what: &'static str,
        /// The channel.
        name: String,
        /// The transport's error.
        why: String,
    },
    /// There is no memory to write a message.
    #[error(
        "no memory to write a message: {why}; a reader borrows too many messages, or the message is longer than its channel allows"
    )]
    Loan {
        /// The transport's error.
        why: String,
    },
    /// There is too little shared memory for what a process is about to create or write.
    #[error(
        "{what} needs {} KiB of shared memory and {} KiB are left in /dev/shm; end another simulator, \
         or make /dev/shm larger",
        needed.div_ceil(1024),
        free / 1024
    )]
    SharedMemory {
        /// What is created or written.
        what: String,
        /// Bytes that it needs.
        needed: u64,
        /// Bytes that are left.
        free: u64,
    },
    /// The reader borrows the largest number of messages.
    #[error(
        "this reader borrows the largest number of messages; drop one before receiving the next"
    )]
    TooManyBorrowed,
    /// A part of the journal was lost between host and stage.
    #[error(
        "journal part {received} arrived where {expected} was expected; the stage starts again"
    )]
    JournalGap {
        /// The serial that was expected.
        expected: u64,
        /// The serial that arrived.
        received: u64,
    },
    /// The control page is not usable.
    #[error(transparent)]
    Page(#[from] crate::control::PageError),
    /// The host ended while this process joined.
    #[error("the host ended while this process joined")]
    HostEnds,
    /// An instance could not be created, found or joined.
    #[error("{0}")]
    Instance(String),
}

impl BusError {
    /// Whether the error is that the channel does not exist, or is being removed.
    pub fn is_missing_channel(&self) -> bool {
        const GONE: [&str; 3] =
            ["DoesNotExist", "IsMarkedForDestruction", "ServiceInCorruptedState"];
        matches!(self, BusError::Channel { why, .. } if GONE.contains(&why.as_str()))
    }

    /// Whether the host is of another build or protocol version than this program.
    pub fn is_other_build(&self) -> bool {
        use crate::control::PageError;
        matches!(self, BusError::Page(PageError::Protocol { .. } | PageError::Build { .. }))
    }

    pub(crate) fn channel(name: &str, why: impl Debug) -> BusError {
        let name = name.to_owned();
        match process::exhausted_file_limit() {
            Some(limit) => BusError::OpenFiles { name, limit },
            None => BusError::Channel { name, why: format!("{why:?}") },
        }
    }

    pub(crate) fn port(what: &'static str, name: &str, why: impl Debug) -> BusError {
        BusError::Port { what, name: name.to_owned(), why: format!("{why:?}") }
    }
}
