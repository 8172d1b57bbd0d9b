//! The journal: every command with its outcome, by frame.

use bytemuck::{Pod, Zeroable};

use crate::{Name, Outcome, RawCommand, Stamp};

/// One entry of a frame's journal: a command and its outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalEntry {
    /// Name of the client that sent the command.
    pub client: Name,
    /// Sequence number among the client's commands.
    pub sequence: u64,
    /// The command.
    pub command: RawCommand,
    /// Its outcome.
    pub outcome: Outcome,
}

const _: () = assert!(size_of::<JournalEntry>() == 832);

/// The most entries in one part of a journal: a longer journal has several parts.
pub const JOURNAL_PART_MAX: usize = 64;

/// Header of one part of a frame's journal, on the channel of the stages, or of the outcomes that
/// clients wait for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct JournalHeader {
    /// The first frame whose snapshot shows the effect of these commands.
    pub stamp: Stamp,
    /// Counts the parts of its channel without gaps since the host started, so that a reader detects a
    /// lost part.
    pub serial: u64,
    /// Index of this part's first entry in the frame's journal.
    pub first: u32,
    /// 0: the commands of one frame. Otherwise the first part of a keyframe, the standing state from
    /// which a reader that joined late starts, and the number of parts that belong to it: this one,
    /// those with the rest of the standing state, and the past journals that follow it.
    pub keyframe: u32,
}

const _: () = assert!(size_of::<JournalHeader>() == 40);
