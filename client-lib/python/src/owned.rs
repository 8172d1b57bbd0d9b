//! Values that only the process that made them may use or drop.

use std::{mem::ManuallyDrop, process};

use pyo3::PyResult;

use crate::error::NotAllowedError;

/// A value with a share of another process's memory. In a forked child it is neither used nor
/// dropped: what it would give back belongs to the parent.
pub(crate) struct Owned<T> {
    value: ManuallyDrop<T>,
    pid: u32,
}

impl<T> Owned<T> {
    pub(crate) fn new(value: T) -> Owned<T> {
        Owned { value: ManuallyDrop::new(value), pid: process::id() }
    }

    /// The value, also in a forked child: for memory that is only read.
    pub(crate) fn read(&self) -> &T {
        &self.value
    }

    /// The value, in the process that made it.
    pub(crate) fn get(&self) -> PyResult<&T> {
        self.check()?;
        Ok(&self.value)
    }

    /// As [`Owned::get`], to be changed.
    pub(crate) fn get_mut(&mut self) -> PyResult<&mut T> {
        self.check()?;
        Ok(&mut self.value)
    }

    fn check(&self) -> PyResult<()> {
        if self.pid == process::id() {
            return Ok(());
        }
        Err(NotAllowedError::new_err(format!(
            "process {} made this connection, and process {} is a fork of it; connect a Client of \
             its own in each process, or start processes with multiprocessing's \"spawn\" method",
            self.pid,
            process::id()
        )))
    }
}

impl<T> Drop for Owned<T> {
    fn drop(&mut self) {
        if self.pid == process::id() {
            // SAFETY: it is dropped here alone, and not used afterwards.
            unsafe { ManuallyDrop::drop(&mut self.value) }
        }
    }
}
