//! The processes of the operating system: a thread that waits for their ends, and one that cleans up
//! after them.

use std::{collections::BTreeMap, io, os::fd::OwnedFd, sync::Arc, thread, time::Duration};

use bus::{Instance, Role, SLOTS, clock, process};
use crossbeam::channel::{Receiver, Sender, bounded};
use rustix::event::epoll;

use crate::supervisor::{Launcher, Occupant, Processes, Reports, Stage};

/// Longest time that the host waits for the cleaner.
const CLEANING_MAX: Duration = Duration::from_secs(5);

/// The stages as processes or threads, and all processes of participants.
pub(crate) struct SystemProcesses {
    instance: Instance,
    launcher: Box<dyn Launcher>,
    reports: Reports,
    stages: BTreeMap<usize, Stage>,
    watch: Arc<epoll_watch::Watch>,
    /// `None` after the end.
    cleaner: Option<Sender<Vec<u32>>>,
    cleaned: Receiver<(u64, u64)>,
}

impl SystemProcesses {
    /// Starts the watcher and cleaner threads.
    pub(crate) fn new(
        instance: &Instance,
        launcher: Box<dyn Launcher>,
        reports: Reports,
    ) -> io::Result<SystemProcesses> {
        let watch = Arc::new(epoll_watch::Watch::new()?);
        let watcher = (Arc::clone(&watch), reports.clone());
        thread::Builder::new().name("watcher".into()).spawn(move || {
            let (watch, reports) = watcher;
            watch.run(|occupant| reports.report(occupant));
        })?;
        let (cleaner, jobs) = bounded(1);
        let (results, cleaned) = bounded(1);
        let in_process = launcher.is_single_process();
        let cleaned_instance = instance.clone();
        thread::Builder::new().name("cleaner".into()).spawn(move || {
            clean_on_demand(&cleaned_instance, in_process, &jobs, &results);
        })?;
        Ok(SystemProcesses {
            instance: instance.clone(),
            launcher,
            reports,
            stages: BTreeMap::new(),
            watch,
            cleaner: Some(cleaner),
            cleaned,
        })
    }
}

impl Processes for SystemProcesses {
    fn start(&mut self, role: Role, occupant: Occupant, start_index: u64) -> io::Result<()> {
        let slot = occupant.slot;
        let reports = self.reports.clone();
        let on_end = Box::new(move || reports.report(occupant));
        let stage = self.launcher.launch(role, slot, start_index, &self.instance, on_end)?;
        if let Stage::Process(child) = &stage {
            let pid = child.id();
            let started = process::start_time(pid).unwrap_or(0);
            match process::watch(pid, started) {
                Some(fd) => self.watch.add(fd, occupant)?,
                None => self.reports.report(occupant),
            }
        }
        self.stages.insert(slot, stage);
        Ok(())
    }

    fn kill(&mut self, slot: usize) -> bool {
        match self.stages.get_mut(&slot) {
            Some(Stage::Process(child)) => child.kill().is_ok(),
            Some(Stage::Thread(_)) | None => false,
        }
    }

    fn processor_ticks(&self, slot: usize) -> Option<u64> {
        match self.stages.get(&slot) {
            Some(Stage::Process(child)) => process::processor_ticks(child.id()),
            Some(Stage::Thread(_)) | None => None,
        }
    }

    fn watch(&self, occupant: Occupant, pid: u32, start_time: u64) -> bool {
        // A thread of this process ends with it.
        if pid == process::own_pid() {
            return true;
        }
        match process::watch(pid, start_time) {
            Some(fd) => self.watch.add(fd, occupant).is_ok(),
            None => false,
        }
    }

    fn unwatch(&self, slot: usize) {
        self.watch.remove(slot);
    }

    fn status(&mut self, slot: usize) -> Option<String> {
        match self.stages.get_mut(&slot)? {
            // The process has ended, so this does not block.
            Stage::Process(child) => child.wait().ok().map(|status| status.to_string()),
            Stage::Thread(_) => None,
        }
    }

    fn clean_up(&self, spared: Vec<u32>) -> u64 {
        if self.cleaner.as_ref().is_none_or(|jobs| jobs.try_send(spared).is_err()) {
            return 1;
        }
        self.cleaned.recv_timeout(CLEANING_MAX).map_or(1, |(_, stuck)| stuck)
    }

    fn shut_down(&mut self) {
        let deadline = clock::now_nanos() + 3_000_000_000;
        for (_, stage) in std::mem::take(&mut self.stages) {
            match stage {
                Stage::Process(mut child) => {
                    while matches!(child.try_wait(), Ok(None)) {
                        if clock::now_nanos() > deadline {
                            let _ = child.kill();
                            let _ = child.wait();
                            break;
                        }
                        thread::sleep(Duration::from_millis(2));
                    }
                }
                Stage::Thread(handle) => {
                    let _ = handle.join();
                }
            }
        }
        self.watch.stop();
        // The cleaner makes files of its own: the instance is removed after them.
        self.cleaner = None;
        while self.cleaned.recv_timeout(CLEANING_MAX).is_ok() {}
    }
}

/// Cleans up on a separate thread: the transport may need milliseconds, or block forever on a
/// defect.
fn clean_on_demand(
    instance: &Instance,
    in_process: bool,
    jobs: &Receiver<Vec<u32>>,
    results: &Sender<(u64, u64)>,
) {
    let Ok(node) = instance.node("cleaner", in_process) else { return };
    while let Ok(spared) = jobs.recv() {
        instance.sweep_unfinished_segments();
        let mut report = node.clean(&spared);
        if report.1 > 0 {
            instance.sweep_stuck_nodes(&spared);
            report = node.clean(&spared);
        }
        let _ = results.try_send(report);
    }
}

mod epoll_watch {
    //! One thread that waits for many process descriptors.

    use std::{
        collections::BTreeMap,
        sync::{
            Mutex, PoisonError,
            atomic::{AtomicBool, Ordering},
        },
    };

    use rustix::event::{EventfdFlags, eventfd};

    use super::*;

    const WAKE: u64 = u64::MAX;

    pub(super) struct Watch {
        epoll: OwnedFd,
        wake: OwnedFd,
        /// The number of the process of each slot, and its descriptor.
        fds: Mutex<BTreeMap<usize, (u64, OwnedFd)>>,
        is_stopped: AtomicBool,
    }

    impl Watch {
        pub(super) fn new() -> io::Result<Watch> {
            let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
            let wake = eventfd(0, EventfdFlags::CLOEXEC)?;
            epoll::add(&epoll, &wake, epoll::EventData::new_u64(WAKE), epoll::EventFlags::IN)?;
            let fds = Mutex::new(BTreeMap::new());
            Ok(Watch { epoll, wake, fds, is_stopped: AtomicBool::new(false) })
        }

        fn fds(&self) -> std::sync::MutexGuard<'_, BTreeMap<usize, (u64, OwnedFd)>> {
            self.fds.lock().unwrap_or_else(PoisonError::into_inner)
        }

        pub(super) fn add(&self, fd: OwnedFd, occupant: Occupant) -> io::Result<()> {
            let Occupant { slot, number } = occupant;
            self.remove(slot);
            let data = epoll::EventData::new_u64(number * SLOTS as u64 + slot as u64);
            let mut fds = self.fds();
            epoll::add(&self.epoll, &fd, data, epoll::EventFlags::IN)?;
            fds.insert(slot, (number, fd));
            Ok(())
        }

        pub(super) fn remove(&self, slot: usize) {
            if let Some((_, fd)) = self.fds().remove(&slot) {
                let _ = epoll::delete(&self.epoll, &fd);
            }
        }

        pub(super) fn stop(&self) {
            self.is_stopped.store(true, Ordering::Release);
            let _ = rustix::io::write(&self.wake, &1u64.to_ne_bytes());
        }

        /// Calls `on_exit` for each process that ends while it is watched.
        pub(super) fn run(&self, mut on_exit: impl FnMut(Occupant)) {
            let mut events = Vec::with_capacity(SLOTS + 1);
            while !self.is_stopped.load(Ordering::Acquire) {
                events.clear();
                let spare = rustix::buffer::spare_capacity(&mut events);
                if epoll::wait(&self.epoll, spare, None).is_err() {
                    continue;
                }
                for data in events.iter().map(|event| event.data.u64()).filter(|d| *d != WAKE) {
                    let slot = (data % SLOTS as u64) as usize;
                    let number = data / SLOTS as u64;
                    // The host cannot stop watching it, and watch another one, before `on_exit`
                    // returns.
                    let mut fds = self.fds();
                    if fds.get(&slot).is_some_and(|(watched, _)| *watched == number)
                        && let Some((_, fd)) = fds.remove(&slot)
                    {
                        let _ = epoll::delete(&self.epoll, &fd);
                        on_exit(Occupant { slot, number });
                    }
                }
            }
        }
    }
}
