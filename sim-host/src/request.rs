//! Commands as clients send them.

use bytemuck::{Pod, Zeroable};
use protocol::{Command, JournalEntry, Name, Outcome, RawCommand};

/// One command of one client, before it is carried out.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// The client that sent it.
    pub client: Name,
    /// Its number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
}

impl Request {
    /// A command that the host itself carries out, for its line in the journal.
    pub fn of_host(command: Command) -> Request {
        Request { client: Name::new("sim-host"), sequence: 0, command: command.into() }
    }

    /// Returns the request as a saved state keeps it.
    pub(crate) fn pending(&self, is_control: bool) -> Pending {
        let Request { client, sequence, command } = *self;
        Pending { client, sequence, command, is_control: is_control.into() }
    }

    /// Returns the request's line in the journal.
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

/// A command in a saved state that was not carried out yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Pending {
    /// The client that sent it.
    pub client: Name,
    /// Its number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
    /// 1: it came as a control, which is applied after commands.
    pub is_control: u64,
}
