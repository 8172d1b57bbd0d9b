//! A tick that was requested and is awaited.

use std::{sync::Arc, time::Duration};

use bus::Ending;
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
        let participant = &self.connection.participant;
        let deadline = self.deadline.map(after);
        let ending = participant.await_complete(self.frame, deadline).map_err(|why| {
            let waited = self.deadline.unwrap_or_default();
            self.connection.interrupted(why, "the next frame", waited)
        })?;
        let (cause, mask) = match ending {
            Ending::Complete => return Ok(self.frame),
            Ending::Late(mask) => (Incompleteness::Late, mask),
            Ending::Degraded(mask) => (Incompleteness::Degraded, mask),
        };
        let missing = participant.control().names(mask);
        Err(ClientError::Incomplete { frame: self.frame, cause, missing })
    }
}
