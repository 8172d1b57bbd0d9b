//! Commands that were sent, until their outcomes are taken.

use std::{
    sync::{Arc, Weak},
    time::Duration,
};

use protocol::Frame;

use crate::{
    ClientError, Outcome,
    connection::{Connection, after},
};

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

    /// Waits for the outcomes of the commands, in their order. The client is not needed for it and
    /// may serve other threads meanwhile.
    ///
    /// # Errors
    ///
    /// [`ClientError::JournalOverrun`] if outcomes were overwritten before they were read;
    /// [`ClientError::Timeout`] after `deadline`; [`ClientError::HostEnded`], also if the client was
    /// dropped.
    pub fn wait(&self, deadline: Duration) -> Result<Vec<Outcome>, ClientError> {
        let dropped = ClientError::HostEnded { last: Frame(0) };
        let connection = self.connection.upgrade().ok_or(dropped)?;
        let answered = connection
            .participant
            .await_answer(after(deadline), || self.poll(&connection).transpose());
        answered.map_err(|why| connection.interrupted(why, self.what, deadline))?
    }

    /// Returns the outcomes once all commands have one.
    pub(crate) fn poll(
        &self,
        connection: &Connection,
    ) -> Result<Option<Vec<Outcome>>, ClientError> {
        let mut inbox = connection.inbox();
        inbox.take_in(connection.name())?;
        let Some(entries) = inbox.take(self.first)? else { return Ok(None) };
        Ok(Some(entries.into_iter().map(|entry| Outcome::new(self.what, entry)).collect()))
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
            connection.inbox().close(self.first);
        }
    }
}
