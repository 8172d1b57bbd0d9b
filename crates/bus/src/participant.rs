//! Joining an instance: a slot, its words, and a watch on the host.

use std::{
    cell::Cell,
    io,
    os::fd::OwnedFd,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    BusError, BusNode, ControlPageMapping, DeviceInstant, Ending, Instance, Journal, Role, SLOTS,
    Slot, SlotInstant, SlotState, Snapshot, SnapshotReader, Strategy, clock, process,
};
use protocol::{Frame, Name};

/// A process that joins gives up when the host has used no processor time for this long. A host that
/// builds a map, or shares its processor with many others, may take longer to admit it.
pub const ADMISSION_SECS: u64 = 60;

/// How long a stage waits for the journal before it wakes the host again. Nanoseconds.
const JOURNAL_NANOS: u64 = 100_000_000;

/// The participation of a process or thread in an instance. Dropping it leaves the instance.
pub struct Participant {
    instance: Instance,
    control: ControlPageMapping,
    slot: usize,
    strategy: Strategy,
    host_watch: Arc<HostWatch>,
    in_process: bool,
}

/// The reason why a wait ended early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interrupted {
    /// The host is shutting down or has ended.
    HostEnds,
    /// The deadline passed.
    Deadline,
}

impl Participant {
    /// Joins as `role`. The host assigns the slot of a stage; other processes claim a free one.
    /// `in_process`: the host runs in this process.
    pub fn join(
        instance: &Instance,
        role: Role,
        name: Name,
        slot: Option<usize>,
        in_process: bool,
    ) -> Result<Participant, BusError> {
        let control = instance.control()?;
        let pid = process::own_pid();
        let started = process::start_time(pid).unwrap_or(0);
        let slot = match slot {
            Some(slot) => {
                control.slot(slot).reserve(SlotState::Claimed, pid);
                slot
            }
            None => (0..SLOTS).find(|&i| control.slot(i).claim(pid)).ok_or_else(|| {
                BusError::Instance(format!(
                    "all {SLOTS} slots of simulator {:?} are in use; end a client",
                    instance.id()
                ))
            })?,
        };
        let host_watch =
            if in_process { HostWatch::default() } else { HostWatch::start(&control)? };
        let strategy = control.strategy();
        let participant = Participant {
            instance: instance.clone(),
            control,
            slot,
            strategy,
            host_watch: Arc::new(host_watch),
            in_process,
        };
        participant.words().introduce(role, name, started);
        participant.words().set_state(SlotState::Waiting);
        participant.control.host.notify();
        participant.await_state(SlotState::Admitted)?;
        Ok(participant)
    }

    fn await_state(&self, state: SlotState) -> Result<(), BusError> {
        let reached = || self.words().state() >= state;
        let host = self.control.host_process().0;
        loop {
            let used = process::processor_ticks(host);
            let deadline = clock::now_nanos() + ADMISSION_SECS * 1_000_000_000;
            self.control
                .complete
                .wait(u64::MAX, self.strategy, Some(deadline), || reached() || self.is_over());
            if self.is_over() {
                return Err(BusError::HostEnds);
            }
            if reached() {
                return Ok(());
            }
            if process::processor_ticks(host) == used {
                return Err(BusError::Instance(format!(
                    "simulator {:?} did not admit this process, and its host, process {host}, has \
                     used no processor time for {ADMISSION_SECS} s; is it stopped?",
                    self.instance.id(),
                )));
            }
        }
    }

    /// Opens the node of this participant.
    pub fn node(&self) -> Result<BusNode, BusError> {
        let role = self.words().role().map_or("participant", Role::name);
        self.instance.node(role, self.in_process)
    }

    /// Reports that the ports are created; participation begins.
    pub fn ready(&self) -> Result<(), BusError> {
        self.words().set_state(SlotState::Ready);
        self.control.host.notify();
        self.await_state(SlotState::Live)
    }

    /// Waits until a frame after `done` is published and returns the newest.
    pub fn next_frame(&self, done: Frame, deadline: Option<u64>) -> Result<Frame, Interrupted> {
        let gate = &self.control.tick;
        if gate.wait(done.0 + 1, self.strategy, deadline, || self.is_over()) {
            return Ok(Frame(gate.get()));
        }
        Err(if self.is_over() { Interrupted::HostEnds } else { Interrupted::Deadline })
    }

    /// Waits until `frame` is complete and returns how it ended. While it spins, it detects the last
    /// arrival itself without waiting for the host.
    pub fn await_complete(
        &self,
        frame: Frame,
        deadline: Option<u64>,
    ) -> Result<Ending, Interrupted> {
        let control = &self.control;
        // Seen once is enough: a client that dies afterwards takes the words back.
        let is_seen = Cell::new(false);
        let give_up = || {
            is_seen.set(control.have_all_arrived(frame));
            is_seen.get() || self.is_over()
        };
        if control.complete.wait(frame.0, self.strategy, deadline, give_up) {
            return Ok(control.ending());
        }
        if is_seen.get() {
            return Ok(Ending::Complete);
        }
        Err(if self.is_over() { Interrupted::HostEnds } else { Interrupted::Deadline })
    }

    /// Waits until `look` returns a value. `look` is called whenever a frame completes and whenever
    /// the host notifies clients between frames.
    pub fn await_answer<T>(
        &self,
        deadline: u64,
        mut look: impl FnMut() -> Option<T>,
    ) -> Result<T, Interrupted> {
        let found = self.control.complete.listen(self.strategy, Some(deadline), || {
            look().map(Ok).or_else(|| self.is_over().then_some(Err(Interrupted::HostEnds)))
        });
        found.unwrap_or(Err(Interrupted::Deadline))
    }

    /// For a stage: like [`Participant::next_frame`] without a deadline. Meanwhile it receives the parts
    /// of the journal for which the host has no room, so that another stage gets those after them.
    ///
    /// # Errors
    ///
    /// As for [`Participant::receive_journal`].
    pub fn next_stage_frame(&self, done: Frame, journal: &mut Journal) -> Result<Frame, BusError> {
        let gate = &self.control.tick;
        let mut last_count = None;
        let found = gate.listen(self.strategy, None, || {
            let count = gate.count();
            if gate.get() > done.0 {
                return Some(Ok(Frame(gate.get())));
            }
            if self.is_over() {
                return Some(Err(BusError::HostEnds));
            }
            // The host has woken the stages without a new frame.
            if last_count.replace(count) != Some(count) {
                let read = self.words().journal_read();
                match self.receive_parts(journal) {
                    Ok(received) if received != read => self.control.host.notify(),
                    Ok(_) => {}
                    Err(error) => return Some(Err(error)),
                }
            }
            None
        });
        found.unwrap_or(Err(BusError::HostEnds))
    }

    /// Receives the parts of the journal that have arrived, and makes room for others. Returns the
    /// serial after them.
    fn receive_parts(&self, journal: &mut Journal) -> Result<u64, BusError> {
        let read = self.words().journal_read();
        journal.begin_at(read);
        let received = journal.receive()?;
        if received != read {
            self.words().set_journal_read(received);
        }
        Ok(received)
    }

    /// For a stage: receives the journal up to the part before `serial`, and waits for what the host
    /// has kept back because this stage had no room for it.
    ///
    /// # Errors
    ///
    /// [`BusError::JournalGap`] after the loss of a part, [`BusError::HostEnds`].
    pub fn receive_journal(&self, journal: &mut Journal, serial: u64) -> Result<(), BusError> {
        loop {
            let received = self.receive_parts(journal)?;
            if journal.is_whole(serial) {
                return Ok(());
            }
            self.control.host.notify();
            let deadline = clock::now_nanos() + JOURNAL_NANOS;
            let arrived = self.await_answer(deadline, || match journal.receive() {
                Ok(now) => (now != received).then_some(Ok(())),
                Err(error) => Some(Err(error)),
            });
            match arrived {
                Ok(result) => result?,
                Err(Interrupted::Deadline) => {}
                Err(Interrupted::HostEnds) => return Err(BusError::HostEnds),
            }
        }
    }

    /// For a stage whose work is done up to `done`: returns the snapshot to work on next, which is
    /// the oldest that it has not received; in asynchronous mode the newest, and the others count as
    /// missed. `None` if all after `done` were overwritten unread. Hands what precedes over to `skip`.
    ///
    /// # Errors
    ///
    /// Those of the channel.
    pub fn next_snapshot(
        &self,
        snapshots: &SnapshotReader,
        done: Frame,
        mut skip: impl FnMut(&Snapshot),
    ) -> Result<Option<Snapshot>, BusError> {
        let takes_every = self.control.is_synchronous();
        let mut latest = None;
        while let Some(snapshot) = snapshots.receive()? {
            if snapshot.header().stamp.frame <= done {
                skip(&snapshot);
            } else if takes_every {
                return Ok(Some(snapshot));
            } else {
                self.words().add_missed(latest.is_some().into());
                latest = Some(snapshot);
            }
        }
        Ok(latest)
    }

    /// Reports that the work of `frame` begins.
    pub fn begin(&self, frame: Frame) {
        self.control.begin(self.slot, frame);
    }

    /// Stores that an instant of `frame` is now, for the stage clock.
    pub fn mark(&self, instant: SlotInstant, frame: Frame) {
        self.control.mark_now(self.slot, instant, frame);
    }

    /// Stores an instant of the device that traces for the renderer.
    pub fn mark_device(&self, instant: DeviceInstant, frame: Frame, nanos: u64) {
        self.control.mark_device(instant, frame, nanos);
    }

    /// Reports that the work of `frame` is done.
    pub fn arrive(&self, frame: Frame) {
        self.control.arrive(self.slot, frame);
        if self.words().lag() > 0 {
            // The barrier does not wait for this frame, but a reader may.
            self.control.complete.notify_all();
        }
    }

    /// For a stage that has found no snapshot up to `frame`: counts those after `done` as missed, and
    /// arrives.
    pub fn arrive_without(&self, done: Frame, frame: Frame) {
        self.words().add_missed(frame.0 - done.0);
        self.arrive(frame);
    }

    /// Whether the host is shutting down or has ended.
    pub fn is_over(&self) -> bool {
        self.host_watch.is_gone.load(Ordering::Acquire) || self.control.is_ending()
    }

    /// A handle for another thread, which waits for frames without receiving them.
    pub fn watch(&self) -> Watch {
        Watch { control: self.control.clone(), host_watch: Arc::clone(&self.host_watch) }
    }

    /// The words of the slot.
    pub fn words(&self) -> &Slot {
        self.control.slot(self.slot)
    }

    /// The number of the slot.
    pub fn slot(&self) -> usize {
        self.slot
    }

    /// The wait strategy.
    pub fn strategy(&self) -> Strategy {
        self.strategy
    }

    /// Sets the wait strategy; the initial one is that of the instance.
    pub fn set_strategy(&mut self, strategy: Strategy) {
        self.strategy = strategy;
    }

    /// The control page.
    pub fn control(&self) -> &ControlPageMapping {
        &self.control
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }
}

/// Waits for frames beside the participant that created it. It sleeps instead of spinning.
#[derive(Clone)]
pub struct Watch {
    control: ControlPageMapping,
    host_watch: Arc<HostWatch>,
}

impl Watch {
    /// Waits until a frame after `done` is published and returns the newest.
    pub fn next_frame(&self, done: Frame, deadline: Option<u64>) -> Result<Frame, Interrupted> {
        let gate = &self.control.tick;
        if gate.wait(done.0 + 1, Strategy::BATCH, deadline, || self.is_over()) {
            return Ok(Frame(gate.get()));
        }
        Err(if self.is_over() { Interrupted::HostEnds } else { Interrupted::Deadline })
    }

    /// Whether the host is shutting down or has ended.
    pub fn is_over(&self) -> bool {
        self.host_watch.is_gone.load(Ordering::Acquire) || self.control.is_ending()
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        self.words().set_state(SlotState::Leaving);
        self.control.host.notify();
    }
}

/// Thread that sleeps until the host ends and then wakes every waiting thread. Dropping it ends the
/// thread.
#[derive(Default)]
struct HostWatch {
    is_gone: Arc<AtomicBool>,
    stop: Option<Arc<OwnedFd>>,
}

impl HostWatch {
    fn start(control: &ControlPageMapping) -> Result<HostWatch, BusError> {
        let (pid, started) = control.host_process();
        let Some(fd) = process::watch(pid, started) else {
            return Err(BusError::Instance(format!("the host, process {pid}, has ended")));
        };
        let fault = |e: io::Error| {
            BusError::Instance(format!("cannot start the thread that watches the host: {e}"))
        };
        let stop = Arc::new(process::signal().map_err(fault)?);
        let is_gone = Arc::default();
        let (control, signal, gone) = (control.clone(), Arc::clone(&stop), Arc::clone(&is_gone));
        let watch = move || {
            if process::wait_for_end_unless(&fd, &signal) {
                AtomicBool::store(&gone, true, Ordering::Release);
                control.tick.notify_all();
                control.complete.notify_all();
            }
        };
        let thread = std::thread::Builder::new().name("host-watch".into()).stack_size(64 * 1024);
        thread.spawn(watch).map_err(fault)?;
        Ok(HostWatch { is_gone, stop: Some(stop) })
    }
}

impl Drop for HostWatch {
    fn drop(&mut self) {
        if let Some(stop) = &self.stop {
            process::set(stop);
        }
    }
}
