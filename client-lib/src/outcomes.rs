//! What became of commands: read from the journal, and kept until it is polled.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Weak},
};

use bus::Journal;
use protocol::{ActorId, Frame, JournalEntry, Name};

use crate::{ClientError, connection::Connection};

/// Commands that were sent and whose outcome was not taken yet: see
/// [`Controller::submit`](crate::Controller::submit). Dropped, the outcome is forgotten; the
/// commands are carried out all the same.
#[derive(Debug)]
#[must_use = "the outcome is polled with the ticket"]
pub struct Ticket {
    pub(crate) what: &'static str,
    pub(crate) first: u64,
    pub(crate) count: usize,
    connection: Weak<Connection>,
}

impl Ticket {
    pub(crate) fn new(
        connection: &Arc<Connection>,
        what: &'static str,
        first: u64,
        count: usize,
    ) -> Ticket {
        Ticket { what, first, count, connection: Arc::downgrade(connection) }
    }

    /// How many commands it stands for.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        if let Some(connection) = self.connection.upgrade() {
            connection.inbox().open.remove(&self.first);
        }
    }
}

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
        self.entry.outcome.result().map_err(|why| ClientError::refused(self.what, why))
    }

    /// Returns the actor that the command spawned or changed.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`].
    pub fn actor(&self) -> Result<ActorId, ClientError> {
        self.id().map(ActorId)
    }

    pub(crate) fn into_entry(self) -> JournalEntry {
        self.entry
    }
}

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
    journal: Journal,
    /// By the number of the first command.
    open: BTreeMap<u64, Awaited>,
    /// Commands of other participants, if they are wanted.
    others: Option<VecDeque<(Frame, JournalEntry)>>,
    /// Entries for `others` were lost.
    is_gap: bool,
}

impl Inbox {
    pub(crate) fn new(journal: Journal) -> Inbox {
        Inbox { journal, open: BTreeMap::new(), others: None, is_gap: false }
    }

    /// Awaits the outcomes of `count` commands that are about to be sent, numbered from `first`.
    pub(crate) fn open(&mut self, first: u64, count: usize) {
        let awaited = Awaited { count, outcomes: Vec::with_capacity(count), is_lost: false };
        self.open.insert(first, awaited);
    }

    /// Before commands are sent: entries that nothing waits for are dropped unread.
    pub(crate) fn prepare(&mut self, own: Name) -> Result<(), ClientError> {
        if self.open.is_empty() && self.others.is_none() {
            return Ok(self.journal.begin_here()?);
        }
        self.take_in(own)
    }

    /// Collects entries of other participants from now on.
    pub(crate) fn follow_others(&mut self) -> Result<(), ClientError> {
        if self.others.is_none() && self.open.is_empty() {
            self.journal.begin_here()?;
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
        let is_lost = self.journal.poll()?;
        for event in self.journal.until(Frame(u64::MAX)) {
            let bus::Event::Entry(frame, entry) = event else { continue };
            if entry.client == own {
                if let Some((first, awaited)) = self.open.range_mut(..=entry.sequence).next_back()
                    && entry.sequence < first + awaited.count as u64
                {
                    awaited.outcomes.push(entry);
                }
            } else if let Some(others) = &mut self.others {
                if others.len() == OTHERS_MAX {
                    others.pop_front();
                    self.is_gap = true;
                }
                others.push_back((frame, entry));
            }
        }
        if is_lost {
            self.open.values_mut().for_each(|awaited| awaited.is_lost = true);
            self.is_gap = self.others.is_some();
            self.journal.begin_here()?;
        }
        Ok(())
    }

    /// The outcomes of a ticket's commands, when all are there.
    pub(crate) fn outcomes(
        &mut self,
        ticket: &Ticket,
    ) -> Result<Option<Vec<Outcome>>, ClientError> {
        let Some(awaited) = self.open.get(&ticket.first) else { return Ok(None) };
        if awaited.outcomes.len() == awaited.count {
            let awaited = self.open.remove(&ticket.first);
            let typed = |entry| Outcome::new(ticket.what, entry);
            return Ok(awaited.map(|a| a.outcomes.into_iter().map(typed).collect()));
        }
        if awaited.is_lost {
            self.open.remove(&ticket.first);
            return Err(ClientError::JournalOverrun);
        }
        Ok(None)
    }
}
