//! The table of channels.

use crate::{Role, Role::*};

/// What happens when a reader is too slow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Never lost: the writer waits, up to a deadline.
    Never,
    /// Never lost: the writer counts what each reader has received, and keeps what there is no room
    /// for until there is.
    Kept,
    /// The oldest unread messages are dropped; frame stamps and serial numbers show how many.
    OldestGoes,
}

/// One named stream of messages.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// The service name. The channel of a sensor bundle is `bundle/<id>`.
    pub name: &'static str,
    /// Types of header and payload.
    pub carries: &'static str,
    /// Roles that write.
    pub writers: &'static [Role],
    /// Roles that read.
    pub readers: &'static [Role],
    /// Unread messages kept for one reader.
    pub depth: usize,
    /// Largest number of writers, including dead ones that are not cleaned up yet.
    pub writers_max: usize,
    /// Largest number of readers, including dead ones that are not cleaned up yet.
    pub readers_max: usize,
    /// Messages that one reader may borrow; for a bundle the client chooses, up to this number.
    pub held: usize,
    /// Messages that a reader receives when it joins.
    pub history: usize,
    /// What happens to a slow reader.
    pub loss: Loss,
}

/// One for each slot, and some for dead processes that are not cleaned up yet.
const MANY: usize = crate::control::SLOTS + 8;

/// All channels, in the order in which a tick uses them.
#[rustfmt::skip]
pub const CHANNELS: [Channel; 10] = [
    Channel { name: "command",  carries: "BatchHeader, [Command]",         writers: &[Client],  readers: &[Host],                    depth: 16, writers_max: MANY, readers_max: 1, held: 2, history: 0, loss: Loss::Never },
    Channel { name: "control",  carries: "BatchHeader, [VehicleControl]",  writers: &[Client],  readers: &[Host],                    depth: 8,  writers_max: MANY, readers_max: 1, held: 2, history: 0, loss: Loss::OldestGoes },
    Channel { name: "query",    carries: "QueryHeader, [Query]",           writers: &[Client],  readers: &[Host],                    depth: 8,  writers_max: MANY, readers_max: 1, held: 2, history: 0, loss: Loss::Never },
    Channel { name: "response", carries: "QueryHeader, [Response]",        writers: &[Host],    readers: &[Client],                  depth: 8,  writers_max: 1, readers_max: MANY, held: 2, history: 0, loss: Loss::OldestGoes },
    Channel { name: "outcome",  carries: "JournalHeader, [JournalEntry]",  writers: &[Host],    readers: &[Client],                  depth: 256, writers_max: 1, readers_max: MANY, held: 2, history: 0, loss: Loss::OldestGoes },
    Channel { name: "journal",  carries: "JournalHeader, [JournalEntry]",  writers: &[Host],    readers: &[Traffic, Render],         depth: 64, writers_max: 1, readers_max: 8, held: 2, history: 0, loss: Loss::Kept },
    Channel { name: "snapshot", carries: "SnapshotHeader, [ActorState]",   writers: &[Host],    readers: &[Traffic, Render, Client], depth: 5,  writers_max: 1, readers_max: MANY, held: 4, history: 4, loss: Loss::OldestGoes },
    Channel { name: "resume",   carries: "TrafficHeader, [Block]",         writers: &[Host],    readers: &[Traffic],                 depth: 1,  writers_max: 1, readers_max: 8, held: 1, history: 1, loss: Loss::OldestGoes },
    Channel { name: "traffic",  carries: "TrafficHeader, [Block]",         writers: &[Traffic], readers: &[Host],                    depth: 2,  writers_max: 8, readers_max: 1, held: 3, history: 0, loss: Loss::OldestGoes },
    Channel { name: "bundle",      carries: "BundleHeader, [Page]",           writers: &[Render, Host], readers: &[Client],                  depth: 4,  writers_max: 8, readers_max: 2, held: 8, history: 1, loss: Loss::OldestGoes },
];

/// The channel of this name.
pub fn channel(name: &str) -> &'static Channel {
    CHANNELS.iter().find(|c| c.name == name).expect("a row of CHANNELS")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_reads_what_they_write() {
        for channel in CHANNELS {
            for writer in channel.writers {
                assert!(!channel.readers.contains(writer), "{}", channel.name);
            }
        }
    }

    #[test]
    fn only_the_host_tells_what_is_true() {
        for name in ["snapshot", "journal", "outcome", "response"] {
            assert_eq!(channel(name).writers, [Host]);
        }
    }

    #[test]
    fn who_may_trail_finds_every_frame_it_trails_by() {
        assert!(channel("snapshot").depth > protocol::PIPELINE_MAX as usize);
        assert!(channel("snapshot").history > protocol::PIPELINE_MAX as usize);
    }
}
