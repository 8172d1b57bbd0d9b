//! A tick that was requested and is awaited.

use std::{sync::Arc, time::Duration};

use bus::{Ending, Interrupted};
use protocol::Frame;

use crate::{
    ClientError, Incompleteness,
    connection::{Connection, after},
};

/// A frame that was requested by [`Controller::request_tick`](crate::Controller::request_tick) and
/// may not be complete yet.
///
/// The client is not needed to await it and may serve other threads meanwhile.
#[derive(Debug)]
#[must_use = "the frame is awaited with wait()"]
pub struct PendingTick {
    connection: Arc<Connection>,
    frame: Frame,
    deadline: Option<Duration>,
}

impl PendingTick {
    pub(crate) fn new(
        connection: &Arc<Connection>,
        frame: Frame,
        deadline: Option<Duration>,
    ) -> PendingTick {
        PendingTick { connection: Arc::clone(connection), frame, deadline }
    }

    /// Returns the frame.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Waits until every participant has done its work for the frame, for at most
    /// [`Deadlines::frame`](crate::Deadlines::frame). [`Observer::refresh`](crate::Observer::refresh)
    /// then takes its snapshot in.
    ///
    /// # Errors
    ///
    /// [`ClientError::Incomplete`] if a participant was late or died; [`ClientError::HostEnded`];
    /// [`ClientError::Timeout`].
    pub fn wait(&self) -> Result<Frame, ClientError> {
        let ended = self.wait_until(self.deadline.map(after)).map_err(|why| {
            let waited = self.deadline.unwrap_or_default();
            self.connection.interrupted(why, "the next frame", waited)
        })?;
        ended.map(|()| self.frame)
    }

    /// As [`PendingTick::wait`] for at most `limit`; `None` if the frame is not complete then. It
    /// may be called again.
    ///
    /// # Errors
    ///
    /// [`ClientError::Incomplete`]; [`ClientError::HostEnded`].
    pub fn wait_for(&self, limit: Duration) -> Result<Option<Frame>, ClientError> {
        match self.wait_until(Some(after(limit))) {
            Ok(ended) => ended.map(|()| Some(self.frame)),
            Err(Interrupted::Deadline) => Ok(None),
            Err(Interrupted::HostEnds) => Err(self.connection.host_ended()),
        }
    }

    /// Waits until a moment of the monotonic clock, nanoseconds.
    fn wait_until(&self, deadline: Option<u64>) -> Result<Result<(), ClientError>, Interrupted> {
        let participant = &self.connection.participant;
        let (cause, mask) = match participant.await_complete(self.frame, deadline)? {
            Ending::Complete => return Ok(Ok(())),
            Ending::Late(mask) => (Incompleteness::Late, mask),
            Ending::Degraded(mask) => (Incompleteness::Degraded, mask),
        };
        let missing = participant.control().names(mask);
        Ok(Err(ClientError::Incomplete { frame: self.frame, cause, missing }))
    }
}
