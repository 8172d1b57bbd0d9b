//! CPU affinity and CPU time of processes.

use std::fs;

use rustix::{
    process::Pid,
    thread::{CpuSet, sched_getaffinity, sched_setaffinity},
};

/// Returns the cores that this process may use.
fn allowed() -> Vec<usize> {
    let Ok(set) = sched_getaffinity(None) else { return Vec::new() };
    (0..CpuSet::MAX_CPU).filter(|core| set.is_set(*core)).collect()
}

/// Returns two different cores, or `None` on a machine with one.
pub(crate) fn two() -> Option<[usize; 2]> {
    match allowed()[..] {
        [first, .., last] => Some([first, last]),
        _ => None,
    }
}

/// Keeps this thread on the given cores until it is dropped.
pub(crate) struct Pinned(CpuSet);

impl Pinned {
    pub(crate) fn to(core: usize) -> anyhow::Result<Pinned> {
        let before = sched_getaffinity(None)?;
        sched_setaffinity(None, &only(core))?;
        Ok(Pinned(before))
    }
}

impl Drop for Pinned {
    fn drop(&mut self) {
        let _ = sched_setaffinity(None, &self.0);
    }
}

/// Moves every thread of a process to one core.
pub(crate) fn pin_process(pid: u32, core: usize) -> anyhow::Result<()> {
    for thread in threads(pid) {
        let thread = Pid::from_raw(thread as i32);
        sched_setaffinity(thread, &only(core))?;
    }
    Ok(())
}

fn only(core: usize) -> CpuSet {
    let mut set = CpuSet::new();
    set.set(core);
    set
}

fn threads(pid: u32) -> Vec<u32> {
    let entries = fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    entries.filter_map(|e| e.file_name().to_str()?.parse().ok()).collect()
}

/// Returns the CPU time of a process's live threads, user and kernel, in nanoseconds.
pub(crate) fn cpu_nanos(pid: u32) -> u64 {
    let of_thread = |thread: u32| {
        let text = fs::read_to_string(format!("/proc/{pid}/task/{thread}/schedstat"));
        text.ok().and_then(|t| t.split(' ').next()?.parse::<u64>().ok()).unwrap_or(0)
    };
    threads(pid).into_iter().map(of_thread).sum()
}
