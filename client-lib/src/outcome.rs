//! The outcome of one command.

use protocol::{ActorId, JournalEntry};

use crate::ClientError;

/// What became of one command.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Outcome {
    what: &'static str,
    entry: JournalEntry,
}

impl Outcome {
    pub(crate) fn new(what: &'static str, entry: JournalEntry) -> Outcome {
        Outcome { what, entry }
    }

    /// Returns the id of what the command made or changed: an actor's, a bundle's, or 0.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`].
    pub fn id(&self) -> Result<u32, ClientError> {
        self.entry.outcome.result().map_err(|refusal| ClientError::refused(self.what, refusal))
    }

    /// Returns the actor that the command spawned or changed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`].
    pub fn actor(&self) -> Result<ActorId, ClientError> {
        self.id().map(ActorId)
    }

    /// Returns the entry of the journal, in the protocol's layout.
    #[must_use]
    pub fn into_entry(self) -> JournalEntry {
        self.entry
    }
}
