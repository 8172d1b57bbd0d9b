//! File descriptors that become readable when something came: for epoll, and for runtimes built on it.

use std::{
    os::fd::{AsFd, BorrowedFd, OwnedFd},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use bus::{ControlPageMapping, Strategy};
use rustix::event::{EventfdFlags, eventfd};

use crate::{ClientError, Controller, Observer, connection::Connection};

/// An eventfd: readable after something came, until it is read ([`EventFd::clear`]).
///
/// A thread of this process waits for the event and writes the descriptor; it ends when the value is
/// dropped or the host ends. `Send` and `Sync`.
#[derive(Debug)]
#[must_use = "dropped, the descriptor is closed"]
pub struct EventFd {
    fd: Arc<OwnedFd>,
    is_dropped: Arc<AtomicBool>,
    control: Wake,
}

#[derive(Clone)]
struct Wake {
    control: ControlPageMapping,
    is_frame: bool,
}

impl std::fmt::Debug for Wake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(if self.is_frame { "frames" } else { "outcomes" })
    }
}

impl Wake {
    fn event(&self) -> &bus::SequenceEvent {
        if self.is_frame { &self.control.tick } else { &self.control.complete }
    }
}

impl EventFd {
    fn new(connection: &Connection, is_frame: bool) -> Result<EventFd, ClientError> {
        let failed = |source: std::io::Error| ClientError::EventFd { source };
        let flags = EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC;
        let fd = Arc::new(eventfd(0, flags).map_err(|e| failed(e.into()))?);
        let is_dropped = Arc::new(AtomicBool::new(false));
        let control = Wake { control: connection.participant.control().clone(), is_frame };
        let watch = connection.participant.watch();
        let (to, stop, wake) = (Arc::clone(&fd), Arc::clone(&is_dropped), control.clone());
        let work = move || {
            let mut last = 0;
            wake.event().listen(Strategy::BATCH, None, || {
                let now = wake.event().get();
                if now != last || !wake.is_frame {
                    last = now;
                    // A full counter is readable already.
                    let _ = rustix::io::write(&to, &1u64.to_ne_bytes());
                }
                (stop.load(Ordering::Acquire) || watch.is_over()).then_some(())
            });
        };
        let thread = thread::Builder::new().name("event-fd".into()).stack_size(64 * 1024);
        thread.spawn(work).map_err(failed)?;
        Ok(EventFd { fd, is_dropped, control })
    }

    /// Makes the descriptor unreadable until the next event. Call it before looking at what came.
    pub fn clear(&self) {
        let _ = rustix::io::read(&*self.fd, &mut [0u8; 8]);
    }
}

impl AsFd for EventFd {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

impl Drop for EventFd {
    fn drop(&mut self) {
        self.is_dropped.store(true, Ordering::Release);
        self.control.event().notify_all();
    }
}

impl Observer {
    /// Returns a descriptor that becomes readable whenever a frame is published, and when the host
    /// ends.
    ///
    /// # Errors
    ///
    /// [`ClientError::EventFd`] if the process has no descriptor or thread left.
    pub fn frame_fd(&self) -> Result<EventFd, ClientError> {
        EventFd::new(self.connection(), true)
    }
}

impl Controller {
    /// Returns a descriptor that becomes readable whenever outcomes for [`Controller::poll`] or
    /// measurements may have come, and when the host ends.
    ///
    /// # Errors
    ///
    /// [`ClientError::EventFd`] if the process has no descriptor or thread left.
    pub fn outcome_fd(&self) -> Result<EventFd, ClientError> {
        EventFd::new(self.connection(), false)
    }
}
