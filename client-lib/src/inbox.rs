//! The reading end of the journal: outcomes of this client's commands, kept until they are polled, and
//! the commands of other participants.

use std::collections::{BTreeMap, VecDeque};

use bus::{ControlPageMapping, Outcomes, Slot};
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
    control: ControlPageMapping,
    /// The slot of this client.
    slot: usize,
    /// By the number of the first command.
    open: BTreeMap<u64, Awaited>,
    /// Commands of other participants, if they are wanted.
    others: Option<VecDeque<(Frame, JournalEntry)>>,
    /// Entries for `others` were lost.
    is_gap: bool,
}

impl Inbox {
    pub(crate) fn new(entries: Outcomes, control: ControlPageMapping, slot: usize) -> Inbox {
        Inbox { entries, control, slot, open: BTreeMap::new(), others: None, is_gap: false }
    }

    /// Discards what has arrived; from now on the host counts what this client reads.
    fn begin_here(&mut self) -> Result<(), ClientError> {
        let sent = self.control.outcomes_sent();
        // First: what the host sends while older parts are discarded is not lost.
        self.control.slot(self.slot).set_journal_read(sent);
        Ok(self.entries.begin_here(sent)?)
    }

    /// Reports how far this client has read, so that the host does not overwrite what it waits for.
    fn report(&self) {
        let is_waiting = !self.open.is_empty() || self.others.is_some();
        let read = if is_waiting { self.entries.next() } else { Slot::READS_NOTHING };
        self.control.slot(self.slot).set_journal_read(read);
    }

    /// Awaits the outcomes of `count` commands that are about to be sent, numbered from `first`.
    pub(crate) fn open(&mut self, first: u64, count: usize) {
        let awaited = Awaited { count, outcomes: Vec::with_capacity(count), is_lost: false };
        self.open.insert(first, awaited);
        self.report();
    }

    /// Before commands are sent: entries that nothing waits for are dropped unread.
    pub(crate) fn prepare(&mut self, own: Name) -> Result<(), ClientError> {
        if self.open.is_empty() && self.others.is_none() {
            return self.begin_here();
        }
        self.take_in(own)
    }

    /// Collects entries of other participants from now on.
    pub(crate) fn follow_others(&mut self) -> Result<(), ClientError> {
        if self.others.is_none() && self.open.is_empty() {
            self.begin_here()?;
        }
        self.others.get_or_insert_default();
        self.report();
        Ok(())
    }

    /// Collects no more entries of other participants.
    pub(crate) fn ignore_others(&mut self) {
        self.others = None;
        self.is_gap = false;
        self.report();
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
        let Inbox { entries, open, others, is_gap, .. } = self;
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
        self.report();
        Ok(())
    }

    /// How many of the commands numbered from `first` have an outcome.
    pub(crate) fn ended(&self, first: u64) -> usize {
        self.open.get(&first).map_or(0, |awaited| awaited.outcomes.len())
    }

    /// Awaits the commands numbered from `first` no longer.
    pub(crate) fn close(&mut self, first: u64) {
        self.open.remove(&first);
        self.report();
    }

    /// Returns the entries of the commands numbered from `first`, once, when all of them have come.
    pub(crate) fn take(&mut self, first: u64) -> Result<Option<Vec<JournalEntry>>, ClientError> {
        let Some(awaited) = self.open.get(&first) else { return Ok(None) };
        if awaited.outcomes.len() == awaited.count {
            let ended = self.open.remove(&first);
            self.report();
            return Ok(ended.map(|awaited| awaited.outcomes));
        }
        if awaited.is_lost {
            self.close(first);
            return Err(ClientError::JournalOverrun);
        }
        Ok(None)
    }
}
