//! Identity and end of simulated processes.

use std::{io, os::fd::OwnedFd};

use crate::scheduler;

/// The id of the process that runs.
pub fn own_pid() -> u32 {
    scheduler::own_pid()
}

/// Start time of process `pid`; `None` if there is no such process.
pub fn start_time(pid: u32) -> Option<u64> {
    scheduler::lives(pid).then_some(u64::from(pid))
}

/// Processor time that process `pid` has used, in clock ticks of 10 ms.
pub fn processor_ticks(pid: u32) -> Option<u64> {
    scheduler::lives(pid).then_some(0)
}

/// Processes have no files.
pub(crate) fn exhausted_file_limit() -> Option<u64> {
    None
}

/// Simulated processes have no descriptors; [`scheduler::lives`] says whether they live.
pub fn watch(_pid: u32, _started: u64) -> Option<OwnedFd> {
    None
}

/// Returns at once.
pub fn wait_for_end(_watched: &OwnedFd) {}

/// Simulated processes have no descriptors.
pub fn signal() -> io::Result<OwnedFd> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Does nothing.
pub fn set(_signal: &OwnedFd) {}

/// Returns at once.
pub fn wait_for_end_unless(_watched: &OwnedFd, _signal: &OwnedFd) -> bool {
    false
}
