//! Commands with their sender.

use bytemuck::{Pod, Zeroable};
use protocol::{Command, JournalEntry, Name, Outcome, RawCommand};

/// A command of a client that is not applied yet.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// The client that sent it.
    pub client: Name,
    /// Sequence number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
}

impl Request {
    /// Returns a command of the host itself, for its journal entry.
    pub fn of_host(command: Command) -> Request {
        Request { client: Name::new("sim-host"), sequence: 0, command: command.into() }
    }

    /// Returns the request in the form of a saved state.
    pub(crate) fn pending(&self, is_control: bool) -> Pending {
        let Request { client, sequence, command } = *self;
        Pending { client, sequence, command, is_control: is_control.into() }
    }

    /// Returns the request's journal entry.
    pub fn ended(self, outcome: Outcome) -> JournalEntry {
        let Request { client, sequence, command } = self;
        JournalEntry { client, sequence, command, outcome }
    }
}

impl From<&JournalEntry> for Request {
    fn from(entry: &JournalEntry) -> Request {
        let JournalEntry { client, sequence, command, .. } = *entry;
        Request { client, sequence, command }
    }
}

/// A command in a saved state that was not applied yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pending {
    /// The client that sent it.
    pub client: Name,
    /// Sequence number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
    /// 1 if the command came as a control, which is applied after other commands.
    pub is_control: u64,
}
