//! The processes of the stages: start, death, clean-up.

use std::{
    collections::BTreeMap,
    io,
    os::fd::OwnedFd,
    process::Child,
    sync::Arc,
    thread::{self, JoinHandle},
    time::Duration,
};

use bus::{ControlPageMapping, Instance, Role, SLOTS, SlotState, clock, process};
use crossbeam::channel::{Receiver, Sender, bounded};
use rustix::event::epoll;

/// The process or thread in which a stage runs.
pub enum Stage {
    /// A separate process.
    Process(Child),
    /// A thread of this process, which calls `on_end` when it ends.
    Thread(JoinHandle<()>),
}

/// Starts stages. Only the composition root knows the crates of the stages.
pub trait Launcher: Send {
    /// Starts `role` in `slot`. `start_index` counts the starts of a slot from 0. A thread calls
    /// `on_end` when it ends, because the kernel does not report the end of a thread.
    fn launch(
        &mut self,
        role: Role,
        slot: usize,
        start_index: u64,
        instance: &Instance,
        on_end: Box<dyn FnOnce() + Send>,
    ) -> io::Result<Stage>;

    /// Whether stages are threads of this process.
    fn is_single_process(&self) -> bool;
}

/// Longest time that the host waits for the cleaner.
const CLEANING_MAX: Duration = Duration::from_secs(5);

/// The end of a process.
pub(crate) struct Death {
    pub(crate) why: String,
    /// Whether `why` is the process's own exit message.
    pub(crate) has_message: bool,
}

/// Watches every process on the bus.
pub(crate) struct Supervisor {
    instance: Instance,
    control: ControlPageMapping,
    launcher: Box<dyn Launcher>,
    stages: BTreeMap<usize, Stage>,
    starts: BTreeMap<usize, u64>,
    watch: Arc<epoll_watch::Watch>,
    deaths: Receiver<usize>,
    death_sender: Sender<usize>,
    cleaner: Sender<()>,
    cleaned: Receiver<(u64, u64)>,
}

impl Supervisor {
    /// Starts the watcher and cleaner threads.
    pub(crate) fn new(
        instance: &Instance,
        control: &ControlPageMapping,
        launcher: Box<dyn Launcher>,
    ) -> io::Result<Supervisor> {
        let (death_sender, deaths) = bounded(4 * SLOTS);
        let watch = Arc::new(epoll_watch::Watch::new()?);
        let watcher = (Arc::clone(&watch), control.clone(), death_sender.clone());
        thread::Builder::new().name("watcher".into()).spawn(move || {
            let (watch, control, death_sender) = watcher;
            watch.run(|slot| report_exit(&control, &death_sender, slot));
        })?;
        let (cleaner, jobs) = bounded(1);
        let (results, cleaned) = bounded(1);
        let in_process = launcher.is_single_process();
        let cleaned_instance = instance.clone();
        thread::Builder::new().name("cleaner".into()).spawn(move || {
            clean_on_demand(&cleaned_instance, in_process, &jobs, &results);
        })?;
        Ok(Supervisor {
            instance: instance.clone(),
            control: control.clone(),
            launcher,
            stages: BTreeMap::new(),
            starts: BTreeMap::new(),
            watch,
            deaths,
            death_sender,
            cleaner,
            cleaned,
        })
    }

    /// Starts a stage in `slot`.
    pub(crate) fn start(&mut self, role: Role, slot: usize) -> io::Result<()> {
        let start_index = *self.starts.entry(slot).and_modify(|n| *n += 1).or_insert(0);
        self.control.slot(slot).reserve(SlotState::Claimed, 0);
        let (control, death_sender) = (self.control.clone(), self.death_sender.clone());
        let on_end = Box::new(move || report_exit(&control, &death_sender, slot));
        let stage = self.launcher.launch(role, slot, start_index, &self.instance, on_end)?;
        if let Stage::Process(child) = &stage {
            let pid = child.id();
            let started = process::start_time(pid).unwrap_or(0);
            match process::watch(pid, started) {
                Some(fd) => self.watch.add(fd, slot)?,
                None => report_exit(&self.control, &self.death_sender, slot),
            }
        }
        self.stages.insert(slot, stage);
        Ok(())
    }

    /// Kills the process of a stage. Returns false if the stage is a thread, which cannot be killed.
    pub(crate) fn kill(&mut self, slot: usize) -> bool {
        match self.stages.get_mut(&slot) {
            Some(Stage::Process(child)) => child.kill().is_ok(),
            Some(Stage::Thread(_)) | None => false,
        }
    }

    /// Returns the processor time that the process of a stage has used, in clock ticks of 10 ms; `None`
    /// for a thread, whose time is not known apart from that of its process.
    pub(crate) fn processor_ticks(&self, slot: usize) -> Option<u64> {
        match self.stages.get(&slot) {
            Some(Stage::Process(child)) => process::processor_ticks(child.id()),
            Some(Stage::Thread(_)) | None => None,
        }
    }

    /// Watches a process that the host did not start. Returns whether it is alive.
    pub(crate) fn watch(&self, slot: usize) -> bool {
        let words = self.control.slot(slot);
        // A thread of this process ends with it.
        if words.pid() == process::own_pid() {
            return true;
        }
        match process::watch(words.pid(), words.start_time()) {
            Some(fd) => self.watch.add(fd, slot).is_ok(),
            None => false,
        }
    }

    /// Stops watching a process that has left.
    pub(crate) fn unwatch(&self, slot: usize) {
        self.watch.remove(slot);
    }

    /// Returns the next slot whose process has ended, and the cause.
    pub(crate) fn next_death(&mut self) -> Option<(usize, Death)> {
        let slot = self.deaths.try_recv().ok()?;
        let mut why = "its thread ended".to_owned();
        if let Some(Stage::Process(child)) = self.stages.get_mut(&slot)
            // The process has ended, so this does not block.
            && let Ok(status) = child.wait()
        {
            why = status.to_string();
        }
        let words = self.instance.take_exit_message(slot);
        let has_message = words.is_some();
        Some((slot, Death { why: words.unwrap_or(why), has_message }))
    }

    /// Removes what dead processes left on the bus. Returns the number of items that could not be
    /// removed.
    pub(crate) fn clean_up(&self) -> u64 {
        if self.cleaner.try_send(()).is_err() {
            return 1;
        }
        self.cleaned.recv_timeout(CLEANING_MAX).map_or(1, |(_, stuck)| stuck)
    }

    /// Ends all stages and waits for them; kills those that do not end.
    pub(crate) fn shut_down(&mut self) {
        self.control.end();
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
    }
}

/// Reports the end of a process. The barrier is updated before anything else.
fn report_exit(control: &ControlPageMapping, death_sender: &Sender<usize>, slot: usize) {
    control.mark_dead(slot);
    let _ = death_sender.try_send(slot);
    control.host.notify();
}

/// Cleans up on a separate thread: the transport may need milliseconds, or block forever on a
/// defect.
fn clean_on_demand(
    instance: &Instance,
    in_process: bool,
    jobs: &Receiver<()>,
    results: &Sender<(u64, u64)>,
) {
    let Ok(node) = instance.node("cleaner", in_process) else { return };
    while jobs.recv().is_ok() {
        instance.sweep_unfinished_segments();
        let mut report = node.clean();
        if report.1 > 0 {
            instance.sweep_stuck_nodes(|pid| process::start_time(pid).is_some());
            report = node.clean();
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
        fds: Mutex<BTreeMap<usize, OwnedFd>>,
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

        fn fds(&self) -> std::sync::MutexGuard<'_, BTreeMap<usize, OwnedFd>> {
            self.fds.lock().unwrap_or_else(PoisonError::into_inner)
        }

        pub(super) fn add(&self, fd: OwnedFd, slot: usize) -> io::Result<()> {
            self.remove(slot);
            let data = epoll::EventData::new_u64(slot as u64);
            let mut fds = self.fds();
            epoll::add(&self.epoll, &fd, data, epoll::EventFlags::IN)?;
            fds.insert(slot, fd);
            Ok(())
        }

        pub(super) fn remove(&self, slot: usize) {
            if let Some(fd) = self.fds().remove(&slot) {
                let _ = epoll::delete(&self.epoll, &fd);
            }
        }

        pub(super) fn stop(&self) {
            self.is_stopped.store(true, Ordering::Release);
            let _ = rustix::io::write(&self.wake, &1u64.to_ne_bytes());
        }

        pub(super) fn run(&self, mut on_exit: impl FnMut(usize)) {
            let mut events = Vec::with_capacity(SLOTS + 1);
            while !self.is_stopped.load(Ordering::Acquire) {
                events.clear();
                let spare = rustix::buffer::spare_capacity(&mut events);
                if epoll::wait(&self.epoll, spare, None).is_err() {
                    continue;
                }
                for event in &events {
                    let slot = event.data.u64();
                    if slot != WAKE {
                        self.remove(slot as usize);
                        on_exit(slot as usize);
                    }
                }
            }
        }
    }
}
