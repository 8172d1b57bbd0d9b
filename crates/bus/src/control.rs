//! The control page: the tick barrier's words, beside the channels.
//!
//! One small file per instance, mapped by every process. Each word has one writer at a time. The words
//! of the barrier only increase, and settings are stored in two copies with a version, so that a process
//! killed at any instruction leaves nothing to repair:
//!
//! ```text
//!   words       written by          means
//!   tick        host                frame N is published; work on it
//!   complete    host                frame N is complete
//!   request     the ticking client  advance to frame N
//!   ack         each participant    my work for frame N is done
//!   alive       host                the participants that the barrier waits for
//! ```
//!
//! The state of a slot says which process may write it:
//! joiner `Free → Claimed → Waiting`, host `→ Admitted`, joiner `→ Ready`, host `→ Live`,
//! and when its process is gone, host `→ Dead → Free`.

use crate::{
    Notify, SequenceEvent, Strategy,
    atoms::{AtomicU32, AtomicU64, Ordering},
    clock,
    stage_clock::{Clocks, SlotInstant},
    versioned::Versioned,
};
use protocol::{BUILD, Frame, Name, Settings};

/// Version of the protocol; increased with every change of a message, a channel or this page.
pub const PROTOCOL: u32 = 15;

/// The most participants and clients of an instance.
pub const SLOTS: usize = 32;

const MAGIC: u64 = u64::from_le_bytes(*b"omnibus\x01");

/// The role of a process on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Role {
    /// The simulation host.
    Host = 1,
    /// The traffic planner.
    Traffic = 2,
    /// The sensor renderer.
    Render = 3,
    /// A client: a script, a driving stack, a benchmark.
    Client = 4,
}

impl Role {
    /// The name of the crate that runs the role.
    pub fn name(self) -> &'static str {
        match self {
            Role::Host => "sim-host",
            Role::Traffic => "traffic",
            Role::Render => "sensor-render",
            Role::Client => "client",
        }
    }

    fn from_code(code: u32) -> Option<Role> {
        [Role::Host, Role::Traffic, Role::Render, Role::Client]
            .into_iter()
            .find(|r| *r as u32 == code)
    }
}

/// The state of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum SlotState {
    /// Free.
    Free = 0,
    /// Claimed by a joining process, which writes its identity.
    Claimed = 1,
    /// The joining process waits for the host to watch it.
    Waiting = 2,
    /// The host watches the process, which may create its ports.
    Admitted = 3,
    /// The ports are created.
    Ready = 4,
    /// The process participates.
    Live = 5,
    /// The process leaves; its ports are dropped.
    Leaving = 6,
    /// The process has died; the host cleans up.
    Dead = 7,
    /// Resources of the process could not be removed; the slot is not used again.
    Quarantined = 8,
}

impl SlotState {
    fn from_code(code: u32) -> SlotState {
        use SlotState::*;
        [Free, Claimed, Waiting, Admitted, Ready, Live, Leaving, Dead, Quarantined]
            .into_iter()
            .find(|s| *s as u32 == code)
            .unwrap_or(Quarantined)
    }
}

/// The words of one participant.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct Slot {
    /// State in the low half, process id of the holder in the high half: one word, so that the death of
    /// a process killed right after its claim is still detected.
    owner: AtomicU64,
    /// Start time of that process, because process ids are reused.
    start_time: AtomicU64,
    role: AtomicU32,
    /// 1: the barrier waits for the participant.
    waited_for: AtomicU32,
    /// Frames that the participant may trail.
    lag: AtomicU64,
    /// The last frame whose work is done.
    ack: AtomicU64,
    /// Monotonic clock when the work of the last frame began.
    begin_nanos: AtomicU64,
    /// Monotonic clock when the work of the last frame ended.
    end_nanos: AtomicU64,
    /// The frame that a ticking client requests.
    request: AtomicU64,
    name: [AtomicU64; 5],
    /// Number of parts of the journal that a stage has received, or of outcomes that a client has,
    /// counted from the host's start; of a stage at first, the serial at which its keyframe begins.
    journal_read: AtomicU64,
    /// Number of frames that the participant never received.
    missed: AtomicU64,
    /// 1: the holder asks the barrier to wait for it.
    wants_barrier: AtomicU64,
}

const _: () = assert!(size_of::<Slot>() == 128);

impl Slot {
    /// [`Slot::journal_read`] of a client that waits for no outcomes.
    pub const READS_NOTHING: u64 = u64::MAX;

    /// The state of the slot.
    pub fn state(&self) -> SlotState {
        SlotState::from_code(self.owner.load(Ordering::Acquire) as u32)
    }

    /// Id of the process that holds the slot; 0 if it is free.
    pub fn pid(&self) -> u32 {
        (self.owner.load(Ordering::Acquire) >> 32) as u32
    }

    /// Start time of that process.
    pub fn start_time(&self) -> u64 {
        self.start_time.load(Ordering::Acquire)
    }

    /// The role of the holder.
    pub fn role(&self) -> Option<Role> {
        Role::from_code(self.role.load(Ordering::Acquire))
    }

    /// The name of the holder.
    pub fn name(&self) -> Name {
        let words: [u64; 5] = std::array::from_fn(|i| self.name[i].load(Ordering::Relaxed));
        Name(bytemuck::cast(words))
    }

    /// The last frame whose work is done.
    pub fn ack(&self) -> Frame {
        Frame(self.ack.load(Ordering::Acquire))
    }

    /// Frames that the participant may trail.
    pub fn lag(&self) -> u64 {
        self.lag.load(Ordering::Relaxed)
    }

    /// Begin and end of the work of the last frame, nanoseconds of the monotonic clock.
    pub fn work_nanos(&self) -> (u64, u64) {
        (self.begin_nanos.load(Ordering::Relaxed), self.end_nanos.load(Ordering::Relaxed))
    }

    /// The frame that a ticking client requests.
    pub fn request(&self) -> Frame {
        Frame(self.request.load(Ordering::Acquire))
    }

    /// The serial after the last part of the journal that a stage has received, or of outcomes that a
    /// client has; [`Slot::READS_NOTHING`] of a client that waits for none.
    pub fn journal_read(&self) -> u64 {
        self.journal_read.load(Ordering::Acquire)
    }

    /// Number of frames that the participant never received.
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Whether the holder asks the barrier to wait for it.
    pub fn wants_barrier(&self) -> bool {
        self.wants_barrier.load(Ordering::Acquire) != 0
    }

    /// Whether the barrier waits for the participant.
    pub fn in_barrier(&self) -> bool {
        self.waited_for.load(Ordering::Acquire) != 0
    }

    /// For the holder of the slot: sets its state.
    pub fn set_state(&self, state: SlotState) {
        let pid = self.owner.load(Ordering::Relaxed) >> 32;
        self.owner.store(pid << 32 | u64::from(state as u32), Ordering::Release);
    }

    /// For a joining process: claims a free slot and stores the process id in one step.
    pub fn claim(&self, pid: u32) -> bool {
        let claimed = u64::from(pid) << 32 | u64::from(SlotState::Claimed as u32);
        self.owner.compare_exchange(0, claimed, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    /// For the host: reserves the slot for a process that it starts, or frees it (`pid` 0).
    pub fn reserve(&self, state: SlotState, pid: u32) {
        self.owner.store(u64::from(pid) << 32 | u64::from(state as u32), Ordering::Release);
    }

    /// For the holder, before `Waiting`: stores role, name and start time.
    pub fn introduce(&self, role: Role, name: Name, start_time: u64) {
        let words: [u64; 5] = bytemuck::cast(name.0);
        for (slot, word) in self.name.iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
        self.start_time.store(start_time, Ordering::Relaxed);
        self.role.store(role as u32, Ordering::Release);
        self.request.store(0, Ordering::Relaxed);
        let read = if role == Role::Client { Slot::READS_NOTHING } else { 0 };
        self.journal_read.store(read, Ordering::Relaxed);
        self.missed.store(0, Ordering::Relaxed);
        self.wants_barrier.store(0, Ordering::Relaxed);
        self.waited_for.store(0, Ordering::Relaxed);
    }

    /// For a client that holds the slot: asks the barrier to wait for it, or not.
    pub fn request_barrier(&self, wanted: bool) {
        self.wants_barrier.store(wanted.into(), Ordering::Release);
    }

    /// For the host: sets whether the barrier waits for the participant, its lag, and the frame after
    /// which its work is due.
    pub fn admit(&self, waited_for: bool, lag: u64, done: Frame) {
        self.lag.store(lag, Ordering::Relaxed);
        self.ack.store(done.0, Ordering::Release);
        self.waited_for.store(waited_for.into(), Ordering::Release);
    }

    /// For the host: sets the number of frames that the participant may trail.
    pub fn set_lag(&self, lag: u64) {
        self.lag.store(lag, Ordering::Release);
    }

    /// For a stage or a client: makes room for the parts that follow those before `serial`. For the
    /// host, before `Live`: a stage's keyframe begins there.
    pub fn set_journal_read(&self, serial: u64) {
        self.journal_read.store(serial, Ordering::Release);
    }

    /// For the holder: counts frames that it never received.
    pub fn add_missed(&self, count: u64) {
        self.missed.fetch_add(count, Ordering::Relaxed);
    }
}

/// How much waits in the host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Queues {
    /// Batches of commands that are received and not applied.
    pub commands: u64,
    /// Parts of the journal for which a stage has no room.
    pub journal_parts: u64,
    /// Frames that the recorder has not written.
    pub recorded_frames: u64,
}

/// How a frame ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Every participant arrived.
    Complete,
    /// The deadline passed; the mask holds the slots that had not arrived.
    Late(u64),
    /// Participants died and were not restarted; the mask holds their slots.
    Degraded(u64),
}

/// Value of `members` when the host decides how the frame ends.
const UNKNOWN: u64 = u64::MAX;

/// The control page of one instance.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct ControlPage {
    magic: AtomicU64,
    protocol: AtomicU32,
    host_pid: AtomicU32,
    /// [`BUILD`] of the host.
    build: AtomicU64,
    host_start_time: AtomicU64,
    spin_nanos: AtomicU64,
    /// 1: the host is shutting down.
    ending: AtomicU32,
    synchronous: AtomicU32,
    /// The slot that holds the tick, plus one.
    ticker: AtomicU32,
    ending_kind: AtomicU32,
    ending_mask: AtomicU64,
    /// The newest published frame.
    pub tick: SequenceEvent,
    /// The newest complete frame.
    pub complete: SequenceEvent,
    /// Notifies the host of arrivals, requests and joining processes.
    pub host: Notify,
    alive: AtomicU64,
    /// The frame whose arrivals are counted.
    awaited: AtomicU64,
    /// The slots that work on that frame, one bit each.
    members: AtomicU64,
    /// [`Settings`].
    settings: Versioned<4>,
    /// Number of the episode.
    episode: AtomicU64,
    /// Number of parts of outcomes that the host has sent.
    outcomes_sent: AtomicU64,
    /// Numbers of what waits in the host, of [`Queues`].
    queues: [AtomicU64; 3],
    slots: [Slot; SLOTS],
    pub(crate) clocks: Clocks<SLOTS>,
}

/// The reason why a control page cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PageError {
    /// The file is not a control page, or its host has not finished writing it.
    #[error("bad magic: the control file does not belong to a running host")]
    Foreign,
    /// The host uses another version of this crate.
    #[error(
        "this program speaks bus protocol {ours}, the host {theirs}; build both from one checkout"
    )]
    Protocol {
        /// Version of this program.
        ours: u32,
        /// Version of the host.
        theirs: u32,
    },
    /// The host is of another build.
    #[error(
        "this program is build {ours:016x}, the host is build {theirs:016x}; use programs of one \
         build (omnibus --version prints it)"
    )]
    Build {
        /// Build of this program.
        ours: u64,
        /// Build of the host.
        theirs: u64,
    },
}

impl ControlPage {
    /// For the host, on a page of zeros: makes the page valid.
    pub fn initialise(&self, pid: u32, start_time: u64, strategy: Strategy) {
        self.host_pid.store(pid, Ordering::Relaxed);
        self.host_start_time.store(start_time, Ordering::Relaxed);
        self.spin_nanos.store(strategy.spin_nanos, Ordering::Relaxed);
        self.protocol.store(PROTOCOL, Ordering::Relaxed);
        self.build.store(BUILD, Ordering::Relaxed);
        self.magic.store(MAGIC, Ordering::Release);
    }

    /// For other processes: checks that the page is valid, of the same protocol version and build.
    pub fn check(&self) -> Result<(), PageError> {
        if self.magic.load(Ordering::Acquire) != MAGIC {
            return Err(PageError::Foreign);
        }
        let theirs = self.protocol.load(Ordering::Relaxed);
        if theirs != PROTOCOL {
            return Err(PageError::Protocol { ours: PROTOCOL, theirs });
        }
        let theirs = self.build.load(Ordering::Relaxed);
        if theirs != BUILD {
            return Err(PageError::Build { ours: BUILD, theirs });
        }
        Ok(())
    }

    /// For tests: stores another protocol version.
    #[doc(hidden)]
    pub fn override_protocol(&self, protocol: u32) {
        self.protocol.store(protocol, Ordering::Release);
    }

    /// For tests: stores another build.
    #[doc(hidden)]
    pub fn override_build(&self, build: u64) {
        self.build.store(build, Ordering::Release);
    }

    /// Process id and start time of the host.
    pub fn host_process(&self) -> (u32, u64) {
        (self.host_pid.load(Ordering::Relaxed), self.host_start_time.load(Ordering::Relaxed))
    }

    /// The wait strategy of the instance.
    pub fn strategy(&self) -> Strategy {
        Strategy { spin_nanos: self.spin_nanos.load(Ordering::Relaxed) }
    }

    /// Whether the host is shutting down.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire) != 0
    }

    /// For the host: tells every process to end, and wakes it.
    pub fn end(&self) {
        self.ending.store(1, Ordering::Release);
        self.tick.notify_all();
        self.complete.notify_all();
        self.host.notify();
    }

    /// Whether the world is in synchronous mode.
    pub fn is_synchronous(&self) -> bool {
        self.synchronous.load(Ordering::Acquire) != 0
    }

    /// For the host: stores the settings.
    pub fn set_settings(&self, settings: &Settings) {
        self.settings.store(bytemuck::cast(*settings));
        self.synchronous.store(settings.synchronous, Ordering::Release);
        self.complete.notify_all();
    }

    /// The current settings.
    pub fn settings(&self) -> Settings {
        bytemuck::cast(self.settings.load())
    }

    /// For the host: stores the number of the current episode.
    pub fn set_episode(&self, number: u32) {
        self.episode.store(number.into(), Ordering::Release);
        self.complete.notify_all();
    }

    /// Number of the current episode; the first is 1.
    pub fn episode(&self) -> u32 {
        self.episode.load(Ordering::Acquire) as u32
    }

    /// For the host: stores the number of parts of outcomes that it has sent.
    pub fn set_outcomes_sent(&self, count: u64) {
        self.outcomes_sent.store(count, Ordering::Release);
    }

    /// Number of parts of outcomes that the host has sent, each of which is in the channel.
    pub fn outcomes_sent(&self) -> u64 {
        self.outcomes_sent.load(Ordering::Acquire)
    }

    /// For the host: stores how much waits in it.
    pub fn set_queues(&self, queues: Queues) {
        let Queues { commands, journal_parts, recorded_frames } = queues;
        for (word, count) in self.queues.iter().zip([commands, journal_parts, recorded_frames]) {
            word.store(count, Ordering::Relaxed);
        }
    }

    /// How much waited in the host when it published the last frame.
    pub fn queues(&self) -> Queues {
        let [commands, journal_parts, recorded_frames] =
            [0, 1, 2].map(|i: usize| self.queues[i].load(Ordering::Relaxed));
        Queues { commands, journal_parts, recorded_frames }
    }

    /// The slot of the ticking client.
    pub fn ticker(&self) -> Option<usize> {
        (self.ticker.load(Ordering::Acquire) as usize).checked_sub(1)
    }

    /// Passes the right to tick from one slot to another; `None` is nobody. Returns whether `from` held
    /// it.
    pub fn pass_tick(&self, from: Option<usize>, to: Option<usize>) -> bool {
        let code = |slot: Option<usize>| slot.map_or(0, |s| s as u32 + 1);
        self.ticker
            .compare_exchange(code(from), code(to), Ordering::AcqRel, Ordering::Relaxed)
            .is_ok()
    }

    /// The words of the participant in slot `index`.
    pub fn slot(&self, index: usize) -> &Slot {
        &self.slots[index]
    }

    /// The words of every slot.
    pub fn slots(&self) -> &[Slot; SLOTS] {
        &self.slots
    }

    /// The slots that the barrier waits for, one bit each.
    pub fn alive(&self) -> u64 {
        self.alive.load(Ordering::Acquire)
    }

    /// For the host: the barrier waits for the slot from now on.
    pub fn mark_alive(&self, slot: usize) {
        self.alive.fetch_or(1 << slot, Ordering::AcqRel);
    }

    /// For the host's watcher: the barrier no longer waits for the slot.
    pub fn mark_dead(&self, slot: usize) {
        self.alive.fetch_and(!(1 << slot), Ordering::AcqRel);
    }

    /// The live slots that have not arrived at `frame`, with their lag taken into account.
    pub fn missing(&self, frame: Frame) -> u64 {
        self.behind(self.alive(), frame, |slot| slot.in_barrier())
    }

    /// For the host, before it raises `tick`: stores the frame and the slots whose arrivals are counted.
    pub fn set_awaited(&self, frame: Frame, members: u64) {
        self.members.store(members, Ordering::Relaxed);
        self.awaited.store(frame.0, Ordering::Release);
    }

    /// For the host, after it lost a participant: the end of this frame cannot be derived from the words.
    pub fn leave_verdict_to_host(&self) {
        self.members.store(UNKNOWN, Ordering::Relaxed);
    }

    /// Whether every slot that works on `frame` has arrived, derived from the words before the host has
    /// noticed it.
    pub fn have_all_arrived(&self, frame: Frame) -> bool {
        if self.tick.get() < frame.0 {
            return false;
        }
        let members = self.members.load(Ordering::Relaxed);
        members != UNKNOWN && self.behind(members, frame, |_| true) == 0
    }

    /// The slots of `mask` that have not arrived at `frame`.
    fn behind(&self, mask: u64, frame: Frame, is_waited_for: impl Fn(&Slot) -> bool) -> u64 {
        let (mut left, mut behind) = (mask, 0);
        while left != 0 {
            let bit = left & left.wrapping_neg();
            left ^= bit;
            let slot = &self.slots[bit.trailing_zeros() as usize];
            if is_waited_for(slot) && slot.ack().0.saturating_add(slot.lag()) < frame.0 {
                behind |= bit;
            }
        }
        behind
    }

    /// For the holder of `slot`: the work of `frame` begins.
    pub fn begin(&self, slot: usize, frame: Frame) {
        let now = clock::now_nanos();
        self.slots[slot].begin_nanos.store(now, Ordering::Relaxed);
        self.clocks.of_slot(slot, SlotInstant::Begun).store(frame, now);
    }

    /// For the holder of `slot`: its work up to `frame` is done. The last arrival wakes the host.
    pub fn arrive(&self, slot: usize, frame: Frame) {
        let words = &self.slots[slot];
        let now = clock::now_nanos();
        words.end_nanos.store(now, Ordering::Relaxed);
        self.clocks.of_slot(slot, SlotInstant::Arrived).store(frame, now);
        words.ack.store(frame.0, Ordering::Release);
        let awaited = || Frame(self.awaited.load(Ordering::Acquire));
        self.host.notify_if(|| self.missing(awaited()) == 0);
    }

    /// For the ticking client: requests `frame`.
    pub fn request(&self, slot: usize, frame: Frame) {
        self.clocks.of_slot(slot, SlotInstant::Requested).store(frame, clock::now_nanos());
        self.slots[slot].request.store(frame.0, Ordering::Release);
        self.host.notify();
    }

    /// For the host: completes `frame`.
    pub fn close(&self, frame: Frame, ending: Ending) {
        let (kind, mask) = match ending {
            Ending::Complete => (0, 0),
            Ending::Late(mask) => (1, mask),
            Ending::Degraded(mask) => (2, mask),
        };
        self.ending_kind.store(kind, Ordering::Relaxed);
        self.ending_mask.store(mask, Ordering::Relaxed);
        self.complete.raise(frame.0);
    }

    /// How a frame ended.
    pub fn ending(&self) -> Ending {
        let mask = self.ending_mask.load(Ordering::Relaxed);
        match self.ending_kind.load(Ordering::Relaxed) {
            1 => Ending::Late(mask),
            2 => Ending::Degraded(mask),
            _ => Ending::Complete,
        }
    }

    /// The names of the slots in a mask, for example `sensor-render, client "agent"`.
    pub fn names(&self, mask: u64) -> String {
        let name = |index: usize| match self.slots[index].role() {
            Some(Role::Client) => format!("client {:?}", self.slots[index].name()),
            Some(role) => role.name().to_owned(),
            None => format!("slot {index}"),
        };
        let names: Vec<_> = (0..SLOTS).filter(|i| mask & (1 << i) != 0).map(name).collect();
        names.join(", ")
    }
}
