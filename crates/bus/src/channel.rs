//! The table of channels: the whole bus on one page.

use crate::{Role, Role::*};

/// What it means when a reader is too slow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Never lost: the writer waits, up to a deadline.
    Never,
    /// The oldest unread ones go; frame stamps and serials tell how many.
    OldestGoes,
}

/// One named stream of messages.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// The service name under which it is opened. A bundle's own is `bundle/<id>`.
    pub name: &'static str,
    /// What one message is: header and payload.
    pub carries: &'static str,
    /// Who may write it.
    pub writers: &'static [Role],
    /// Who may read it.
    pub readers: &'static [Role],
    /// Messages that wait unread for one reader.
    pub depth: usize,
    /// How many writers it takes, the dead ones included that nobody cleaned up after yet.
    pub writers_max: usize,
    /// How many readers it takes, likewise.
    pub readers_max: usize,
    /// Messages that one reader may hold; a bundle's client chooses, up to this.
    pub held: usize,
    /// Messages that a newcomer finds.
    pub history: usize,
    /// What happens to a slow reader.
    pub loss: Loss,
}

/// One for each slot, and some for the dead whom nobody cleaned up after yet.
const MANY: usize = crate::control::SLOTS + 4;

/// The whole bus, in the order in which a tick uses it.
#[rustfmt::skip]
pub const CHANNELS: [Channel; 7] = [
    Channel { name: "command",  carries: "BatchHeader, [Command]",         writers: &[Client],  readers: &[Host],                    depth: 16, writers_max: MANY, readers_max: 1, held: 2, history: 0, loss: Loss::Never },
    Channel { name: "control",  carries: "BatchHeader, [VehicleControl]",  writers: &[Client],  readers: &[Host],                    depth: 8,  writers_max: MANY, readers_max: 1, held: 2, history: 0, loss: Loss::OldestGoes },
    Channel { name: "journal",  carries: "JournalHeader, [JournalEntry]",  writers: &[Host],    readers: &[Traffic, Render, Client], depth: 64, writers_max: 1, readers_max: MANY, held: 2, history: 0, loss: Loss::OldestGoes },
    Channel { name: "snapshot", carries: "SnapshotHeader, [ActorState]",   writers: &[Host],    readers: &[Traffic, Render, Client], depth: 5,  writers_max: 1, readers_max: MANY, held: 3, history: 4, loss: Loss::OldestGoes },
    Channel { name: "resume",   carries: "TrafficHeader, [Block]",         writers: &[Host],    readers: &[Traffic],                 depth: 1,  writers_max: 1, readers_max: 8, held: 1, history: 1, loss: Loss::OldestGoes },
    Channel { name: "traffic",  carries: "TrafficHeader, [Block]",         writers: &[Traffic], readers: &[Host],                    depth: 2,  writers_max: 8, readers_max: 1, held: 3, history: 0, loss: Loss::OldestGoes },
    Channel { name: "bundle",      carries: "BundleHeader, [Page]",           writers: &[Render, Host], readers: &[Client],                  depth: 4,  writers_max: 4, readers_max: 2, held: 8, history: 1, loss: Loss::OldestGoes },
];

/// The row of this name.
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
        for name in ["snapshot", "journal"] {
            assert_eq!(channel(name).writers, [Host]);
        }
    }

    #[test]
    fn who_may_trail_finds_every_frame_it_trails_by() {
        assert!(channel("snapshot").depth > protocol::PIPELINE_MAX as usize);
        assert!(channel("snapshot").history > protocol::PIPELINE_MAX as usize);
    }
}
