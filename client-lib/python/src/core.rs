//! A connection that several Python objects and threads share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use client_lib::{ClientError, Command, Outcome, PendingTick, Waiter};
use pyo3::prelude::*;

use crate::{
    error::{NotAllowedError, error},
    owned::Owned,
    storage::HeldCount,
    wait::{Limit, wait},
    world::{Snapshot, VIEWS_MAX},
};

/// The connection, while it is open.
struct Open {
    client: client_lib::Client,
    waiter: Waiter,
    /// The snapshot that was handed out last.
    last: Weak<Snapshot>,
}

/// A connection, and what Python holds of its snapshots.
pub(crate) struct Core {
    open: Mutex<Option<Owned<Open>>>,
    worlds: HeldCount,
    /// Checked before any lock: in a forked child a lock may be held by a thread that is not there.
    process: Owned<()>,
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing that a panic could leave half done is kept under these locks.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn closed() -> PyErr {
    NotAllowedError::new_err("this client is closed; connect another one: omnibus.Client()")
}

impl Core {
    pub(crate) fn new(mut client: client_lib::Client) -> Core {
        let waiter = client.observer().waiter();
        Core {
            open: Mutex::new(Some(Owned::new(Open { client, waiter, last: Weak::new() }))),
            worlds: HeldCount::default(),
            process: Owned::new(()),
        }
    }

    /// Calls `work` with the connection, without the interpreter's lock.
    fn with_open<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Open) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        self.check_process()?;
        py.detach(|| {
            let mut open = lock(&self.open);
            work(open.as_mut().ok_or_else(closed)?.get_mut()?)
        })
    }

    /// Calls `work` with the client, without the interpreter's lock.
    pub(crate) fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut client_lib::Client) -> Result<T, ClientError> + Send,
    ) -> PyResult<T> {
        self.with_open(py, |open| work(&mut open.client).map_err(error))
    }

    /// Checks that this process made the connection.
    pub(crate) fn check_process(&self) -> PyResult<()> {
        self.process.get().copied()
    }

    /// Ends the connection.
    pub(crate) fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.check_process()?;
        py.detach(|| {
            // Dropped after the lock.
            let open = lock(&self.open).take();
            drop(open);
        });
        Ok(())
    }

    pub(crate) fn is_open(&self) -> PyResult<bool> {
        self.check_process()?;
        Ok(lock(&self.open).is_some())
    }

    pub(crate) fn waiter(&self, py: Python<'_>) -> PyResult<Owned<Waiter>> {
        self.with_open(py, |open| Ok(Owned::new(open.waiter.clone())))
    }

    /// The world that was taken in last: a view while few are held, else a copy.
    pub(crate) fn world(&self, py: Python<'_>) -> PyResult<Arc<Snapshot>> {
        self.with_open(py, |open| Ok(self.snapshot(open)))
    }

    /// Takes the newest snapshot in and returns it.
    pub(crate) fn refreshed(&self, py: Python<'_>) -> PyResult<Arc<Snapshot>> {
        self.with_open(py, |open| {
            open.client.refresh().map_err(error)?;
            Ok(self.snapshot(open))
        })
    }

    fn snapshot(&self, open: &mut Open) -> Arc<Snapshot> {
        let world = open.client.observer().shared_world();
        if let Some(last) = open.last.upgrade()
            && last.is_at(world.header())
        {
            return last;
        }
        let snapshot = Arc::new(if self.worlds.get() < VIEWS_MAX {
            Snapshot::view(world, self.worlds.hold())
        } else {
            Snapshot::copy(&world)
        });
        open.last = Arc::downgrade(&snapshot);
        snapshot
    }

    /// Requests the next frame and waits for it.
    pub(crate) fn tick(&self, py: Python<'_>, limit: &Limit) -> PyResult<u64> {
        let pending = self.with_open(py, |open| {
            let pending = open.client.request_tick().map_err(error)?;
            Ok(Owned::new(pending))
        })?;
        let pending: &PendingTick = pending.get()?;
        Ok(wait(py, "the next frame", limit, |slice| pending.wait_for(slice))?.0)
    }

    /// Sends commands and waits for the outcome of each.
    pub(crate) fn try_request(
        &self,
        py: Python<'_>,
        what: &'static str,
        commands: &[Command],
    ) -> PyResult<Vec<Outcome>> {
        let (ticket, deadline) = self.with_open(py, |open| {
            let ticket = open.client.submit(what, commands).map_err(error)?;
            Ok((Owned::new(ticket), open.client.deadlines().answer))
        })?;
        let ticket = ticket.get()?;
        wait(py, &format!("the outcome of {what}"), &Limit::of(deadline), |slice| {
            match ticket.wait(slice) {
                Ok(outcomes) => Ok(Some(outcomes)),
                Err(ClientError::Timeout { .. }) => Ok(None),
                Err(why) => Err(why),
            }
        })
    }

    /// Sends one command and waits for its outcome: the id of what it made or changed.
    pub(crate) fn request(
        &self,
        py: Python<'_>,
        what: &'static str,
        command: impl Into<Command>,
    ) -> PyResult<u32> {
        self.try_request(py, what, &[command.into()])?[0].id().map_err(error)
    }
}
