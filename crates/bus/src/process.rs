//! Identity and end of processes.

use std::{io, os::fd::OwnedFd};

use rustix::{
    event::{EventfdFlags, PollFd, PollFlags, eventfd, poll},
    process::{Pid, PidfdFlags, Resource, getrlimit, pidfd_open},
};

/// The id of this process.
pub fn own_pid() -> u32 {
    std::process::id()
}

/// Start time of process `pid` in clock ticks since boot; `None` if there is no such process.
pub fn start_time(pid: u32) -> Option<u64> {
    stat_field(pid, 22)
}

/// Whether process `pid` runs: it exists, and is not a zombie.
pub fn is_alive(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    let state = stat.rsplit_once(')').and_then(|(_, after)| after.trim_start().chars().next());
    state.is_some_and(|state| !matches!(state, 'Z' | 'X'))
}

/// Processor time that process `pid` has used, in clock ticks of 10 ms.
pub fn processor_ticks(pid: u32) -> Option<u64> {
    Some(stat_field(pid, 14)? + stat_field(pid, 15)?)
}

/// A field of `/proc/<pid>/stat`, counted from 1 as in its manual page.
fn stat_field(pid: u32, number: usize) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is the command in brackets and may hold any byte.
    let (_, after) = stat.rsplit_once(')')?;
    after.split_whitespace().nth(number - 3)?.parse().ok()
}

/// The largest number of files that this process may have open, if it has nearly as many open: the
/// transport does not report why it cannot open another.
pub(crate) fn exhausted_file_limit() -> Option<u64> {
    /// Files that the transport closes again before it reports an error.
    const SPARE: u64 = 4;
    let limit = getrlimit(Resource::Nofile).current?;
    let open = std::fs::read_dir("/proc/self/fd").map_or(limit, |files| files.count() as u64);
    (open + SPARE >= limit).then_some(limit)
}

/// A descriptor that becomes readable when process `pid`, started at `start_time`, ends; `None` if it has
/// ended.
pub fn watch(pid: u32, started: u64) -> Option<OwnedFd> {
    let fd = pidfd_open(Pid::from_raw(pid as i32)?, PidfdFlags::empty()).ok()?;
    (start_time(pid)? == started).then_some(fd)
}

/// Whether the watched process still runs.
pub fn is_running(watched: &OwnedFd) -> bool {
    let mut fds = [PollFd::new(watched, PollFlags::IN)];
    let now = rustix::fs::Timespec { tv_sec: 0, tv_nsec: 0 };
    matches!(poll(&mut fds, Some(&now)), Ok(0))
}

/// Returns a signal for [`wait_for_end_unless`].
pub fn signal() -> io::Result<OwnedFd> {
    Ok(eventfd(0, EventfdFlags::CLOEXEC)?)
}

/// Sets a signal.
pub fn set(signal: &OwnedFd) {
    // It fails only where the counter is full: the signal is set then.
    let _ = rustix::io::write(signal, &1u64.to_ne_bytes());
}

/// Sleeps until the watched process has ended, and returns true, or until the signal is set.
pub fn wait_for_end_unless(watched: &OwnedFd, signal: &OwnedFd) -> bool {
    let mut fds = [PollFd::new(watched, PollFlags::IN), PollFd::new(signal, PollFlags::IN)];
    while !matches!(poll(&mut fds, None), Ok(n) if n > 0) {}
    fds[1].revents().is_empty()
}

/// Sleeps until the watched process has ended.
pub fn wait_for_end(watched: &OwnedFd) {
    let mut fds = [PollFd::new(watched, PollFlags::IN)];
    while !matches!(poll(&mut fds, None), Ok(n) if n > 0) {}
}
