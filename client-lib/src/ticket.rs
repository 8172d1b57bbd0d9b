//! Commands that were sent, until their outcomes are taken.

use std::sync::{Arc, Weak};

use crate::connection::Connection;

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
            connection.inbox().close(self.first);
        }
    }
}
