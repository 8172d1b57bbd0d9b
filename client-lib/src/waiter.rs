//! Waiting beside a client, which may serve other threads meanwhile.

use std::{sync::Arc, time::Duration};

use bus::Interrupted;
use protocol::Frame;

use crate::{
    ClientError,
    connection::{Connection, after},
};

/// Waits for frames and measurements without the [`Observer`](crate::Observer) that gave it, for any
/// thread: `Clone`, `Send` and `Sync`. It waits as the client does ([`Strategy`](crate::Strategy)).
#[derive(Clone, Debug)]
pub struct Waiter {
    connection: Arc<Connection>,
}

impl Waiter {
    pub(crate) fn new(connection: &Arc<Connection>) -> Waiter {
        Waiter { connection: Arc::clone(connection) }
    }

    /// Returns the number of the world that is running: see
    /// [`Observer::episode`](crate::Observer::episode).
    #[must_use]
    pub fn episode(&self) -> u32 {
        self.connection.episode()
    }

    /// Waits for at most `limit` until a frame after `done` is published, and returns the newest;
    /// `None` if there is none then. [`Observer::refresh`](crate::Observer::refresh) takes it in.
    ///
    /// # Errors
    ///
    /// [`ClientError::HostEnded`].
    pub fn next_frame(&self, done: Frame, limit: Duration) -> Result<Option<Frame>, ClientError> {
        self.taken(self.connection.participant.next_frame(done, Some(after(limit))))
    }

    /// Waits for at most `limit` until `look` returns a value; `None` if it has returned none then.
    /// `look` is called whenever a frame completes and whenever the host notifies clients between
    /// frames.
    ///
    /// # Errors
    ///
    /// [`ClientError::HostEnded`].
    pub fn until<T>(
        &self,
        limit: Duration,
        look: impl FnMut() -> Option<T>,
    ) -> Result<Option<T>, ClientError> {
        self.taken(self.connection.participant.await_answer(after(limit), look))
    }

    fn taken<T>(&self, waited: Result<T, Interrupted>) -> Result<Option<T>, ClientError> {
        match waited {
            Ok(value) => Ok(Some(value)),
            Err(Interrupted::Deadline) => Ok(None),
            Err(Interrupted::HostEnds) => Err(self.connection.host_ended()),
        }
    }
}
