//! The reading end of the journal: outcomes of this client's commands, kept until they are polled, and
//! the commands of other participants.

use std::collections::{BTreeMap, VecDeque};

use bus::Outcomes;
use protocol::{Frame, JournalEntry, Name};

use crate::ClientError;

/// The commands of one ticket.
struct Awaited {
    count: usize,
    outcomes: Vec<JournalEntry>,
    is_lost: bool,
}

/// The most commands of other clients that wait to be taken.
const OTHERS_MAX: usize = 65_536;

/// The reading end of the journal, and the tickets that wait for entries of it.
pub(crate) struct Inbox {
    entries: Outcomes,
    /// By the number of the first command.
    open: BTreeMap<u64, Awaited>,
    /// Commands of other participants, if they are wanted.
    others: Option<VecDeque<(Frame, JournalEntry)>>,
    /// Entries for `others` were lost.
    is_gap: bool,
}

impl Inbox {
    pub(crate) fn new(entries: Outcomes) -> Inbox {
        Inbox { entries, open: BTreeMap::new(), others: None, is_gap: false }
    }

    /// Awaits the outcomes of `count` commands that are about to be sent, numbered from `first`.
    pub(crate) fn open(&mut self, first: u64, count: usize) {
        let awaited = Awaited { count, outcomes: Vec::with_capacity(count), is_lost: false };
        self.open.insert(first, awaited);
    }

    /// Before commands are sent: entries that nothing waits for are dropped unread.
    pub(crate) fn prepare(&mut self, own: Name) -> Result<(), ClientError> {
        if self.open.is_empty() && self.others.is_none() {
            return Ok(self.entries.begin_here()?);
        }
        self.take_in(own)
    }

    /// Collects entries of other participants from now on.
    pub(crate) fn follow_others(&mut self) -> Result<(), ClientError> {
        if self.others.is_none() && self.open.is_empty() {
            self.entries.begin_here()?;
        }
        self.others.get_or_insert_default();
        Ok(())
    }

    /// Collects no more entries of other participants.
    pub(crate) fn ignore_others(&mut self) {
        self.others = None;
        self.is_gap = false;
    }

    /// Whether entries of other participants are collected.
    pub(crate) fn follows_others(&self) -> bool {
        self.others.is_some()
    }

    /// The oldest command of another participant that was not taken yet.
    pub(crate) fn next_other(&mut self) -> Option<(Frame, JournalEntry)> {
        self.others.as_mut()?.pop_front()
    }

    /// Whether commands of others were lost since the last call.
    pub(crate) fn take_gap(&mut self) -> bool {
        std::mem::take(&mut self.is_gap)
    }

    /// Reads what has come.
    pub(crate) fn take_in(&mut self, own: Name) -> Result<(), ClientError> {
        let Inbox { entries, open, others, is_gap } = self;
        let is_lost = entries.receive(|frame, entry| {
            if entry.client == own {
                if let Some((first, awaited)) = open.range_mut(..=entry.sequence).next_back()
                    && entry.sequence < first + awaited.count as u64
                {
                    awaited.outcomes.push(*entry);
                }
            } else if let Some(others) = others {
                if others.len() == OTHERS_MAX {
                    others.pop_front();
                    *is_gap = true;
                }
                others.push_back((frame, *entry));
            }
        })?;
        if is_lost {
            self.open.values_mut().for_each(|awaited| awaited.is_lost = true);
            self.is_gap = self.others.is_some();
        }
        Ok(())
    }

    /// Awaits the commands numbered from `first` no longer.
    pub(crate) fn close(&mut self, first: u64) {
        self.open.remove(&first);
    }

    /// Returns the entries of the commands numbered from `first`, once, when all of them have come.
    pub(crate) fn take(&mut self, first: u64) -> Result<Option<Vec<JournalEntry>>, ClientError> {
        let Some(awaited) = self.open.get(&first) else { return Ok(None) };
        if awaited.outcomes.len() == awaited.count {
            return Ok(self.open.remove(&first).map(|awaited| awaited.outcomes));
        }
        if awaited.is_lost {
            self.open.remove(&first);
            return Err(ClientError::JournalOverrun);
        }
        Ok(None)
    }
}
