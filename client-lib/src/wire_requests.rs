//! Requests and settings in the protocol's layout.

use crate::{
    Client, ClientError, Outcome,
    wire::{Command, JournalEntry, Settings},
};

impl Client {
    /// How time passes, in the protocol's layout.
    #[must_use]
    pub fn wire_settings(&self) -> Settings {
        self.connection().participant.control().settings()
    }

    /// Sets how time passes, in the protocol's layout.
    ///
    /// # Errors
    ///
    /// As for [`Client::apply_settings`].
    pub fn apply_wire_settings(&mut self, settings: Settings) -> Result<(), ClientError> {
        self.request_one("settings", Command::SetSettings(settings)).map(drop)
    }

    /// Collects the commands of other participants and of the host from now on:
    /// [`Client::next_wire_command`] returns them.
    ///
    /// # Errors
    ///
    /// [`ClientError::Bus`].
    pub fn follow_wire_commands(&mut self) -> Result<(), ClientError> {
        self.connection().inbox().follow_others()
    }

    /// Returns the oldest command of another participant that was not returned yet, with its
    /// outcome. Never blocks.
    ///
    /// # Errors
    ///
    /// [`ClientError::JournalOverrun`] once after commands were lost; [`ClientError::Bus`].
    pub fn next_wire_command(&mut self) -> Result<Option<JournalEntry>, ClientError> {
        let connection = self.connection();
        let mut inbox = connection.inbox();
        inbox.take_in(connection.name())?;
        if inbox.take_gap() {
            return Err(ClientError::JournalOverrun);
        }
        Ok(inbox.next_other().map(|(_, entry)| entry))
    }

    /// As [`Client::try_request`], with the entries of the journal.
    ///
    /// # Errors
    ///
    /// As for [`Client::try_request`].
    pub fn try_wire_request(
        &mut self,
        what: &'static str,
        commands: &[Command],
    ) -> Result<Vec<JournalEntry>, ClientError> {
        let outcomes = self.try_request(what, commands)?;
        Ok(outcomes.into_iter().map(Outcome::into_entry).collect())
    }
}
