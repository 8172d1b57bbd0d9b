//! The control page: the tick barrier's words, beside the channels.
//!
//! One small file per instance, mapped by everybody. Each word has one writer at a time, and what
//! it says only grows, so that a process killed at any instruction leaves nothing to repair:
//!
//! ```text
//!   words       written by          means
//!   tick        host                frame N is published; work on it
//!   complete    host                frame N is over for everybody
//!   request     the ticking client  please make frame N
//!   ack         each participant    my work for frame N is done
//!   alive       host                who is waited for
//! ```
//!
//! A slot passes from hand to hand by its state; only the hand that holds it writes it:
//! joiner `Free → Claimed → Waiting`, host `→ Admitted`, joiner `→ Ready`, host `→ Live`,
//! and when its process is gone, host `→ Dead → Free`.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use crate::{Notify, SequenceEvent, Strategy, clock, versioned::Versioned};
use protocol::{Frame, Name, Settings};

/// Raised with every change of a message, a channel or this page.
pub const PROTOCOL: u32 = 6;

/// How many participants and clients an instance can have at a time.
pub const SLOTS: usize = 32;

const MAGIC: u64 = u64::from_le_bytes(*b"omnibus\x01");

/// What a process on the bus is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Role {
    /// Owns the world and the tick.
    Host = 1,
    /// Drives the other road users.
    Traffic = 2,
    /// Turns snapshots into measurements.
    Render = 3,
    /// Anyone outside: a script, a driving stack, a benchmark.
    Client = 4,
}

impl Role {
    /// The room's name.
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

/// Who holds a slot, and how far it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum SlotState {
    /// Nobody's.
    Free = 0,
    /// A joiner writes its identity.
    Claimed = 1,
    /// The joiner asks the host to watch it.
    Waiting = 2,
    /// The host watches it; it may make its ports.
    Admitted = 3,
    /// Its ports are made.
    Ready = 4,
    /// It takes part.
    Live = 5,
    /// It goes of its own will; its ports are gone.
    Leaving = 6,
    /// Its process is gone; the host cleans up.
    Dead = 7,
    /// Something of it could not be removed; not used again.
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

/// One participant's words.
#[derive(Debug, Default)]
#[repr(C, align(64))]
pub struct Slot {
    /// The state in the low half, the process id of its holder in the high half: one word, so
    /// that a joiner killed right after its claim can still be found dead.
    owner: AtomicU64,
    /// When that process was started: a process id may be used again.
    start_time: AtomicU64,
    role: AtomicU32,
    /// 1: the barrier waits for it.
    waited_for: AtomicU32,
    /// How many frames it may trail.
    lag: AtomicU64,
    /// Its work up to this frame is done.
    ack: AtomicU64,
    /// Stage clock of the last frame: work began.
    begin_nanos: AtomicU64,
    /// Stage clock of the last frame: work ended.
    end_nanos: AtomicU64,
    /// The frame that it, a ticking client, wants made.
    request: AtomicU64,
    name: [AtomicU64; 5],
    /// Counts its calls for a journal keyframe.
    resync: AtomicU64,
    /// Frames that it never saw.
    missed: AtomicU64,
    /// 1: its holder wants the barrier to wait for it.
    wants_barrier: AtomicU64,
}

const _: () = assert!(size_of::<Slot>() == 128);

impl Slot {
    /// How far its holder is.
    pub fn state(&self) -> SlotState {
        SlotState::from_code(self.owner.load(Ordering::Acquire) as u32)
    }

    /// The process that holds it; 0 if nobody does.
    pub fn pid(&self) -> u32 {
        (self.owner.load(Ordering::Acquire) >> 32) as u32
    }

    /// When that process was started.
    pub fn start_time(&self) -> u64 {
        self.start_time.load(Ordering::Acquire)
    }

    /// What it is.
    pub fn role(&self) -> Option<Role> {
        Role::from_code(self.role.load(Ordering::Acquire))
    }

    /// What it calls itself.
    pub fn name(&self) -> Name {
        let words: [u64; 5] = std::array::from_fn(|i| self.name[i].load(Ordering::Relaxed));
        Name(bytemuck::cast(words))
    }

    /// Its work up to this frame is done.
    pub fn ack(&self) -> Frame {
        Frame(self.ack.load(Ordering::Acquire))
    }

    /// How many frames it may trail.
    pub fn lag(&self) -> u64 {
        self.lag.load(Ordering::Relaxed)
    }

    /// Begin and end of its last frame's work, nanoseconds of the monotonic clock.
    pub fn work_nanos(&self) -> (u64, u64) {
        (self.begin_nanos.load(Ordering::Relaxed), self.end_nanos.load(Ordering::Relaxed))
    }

    /// The frame that it wants made.
    pub fn request(&self) -> Frame {
        Frame(self.request.load(Ordering::Acquire))
    }

    /// How often it asked for a journal keyframe.
    pub fn resync(&self) -> u64 {
        self.resync.load(Ordering::Acquire)
    }

    /// Frames that it never saw.
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Whether its holder wants the barrier to wait for it.
    pub fn wants_barrier(&self) -> bool {
        self.wants_barrier.load(Ordering::Acquire) != 0
    }

    /// Whether the barrier waits for it.
    pub fn in_barrier(&self) -> bool {
        self.waited_for.load(Ordering::Acquire) != 0
    }

    /// For who holds the slot: hands it on.
    pub fn set_state(&self, state: SlotState) {
        let pid = self.owner.load(Ordering::Relaxed) >> 32;
        self.owner.store(pid << 32 | u64::from(state as u32), Ordering::Release);
    }

    /// For a joiner: takes a free slot. The word says the process at once.
    pub fn claim(&self, pid: u32) -> bool {
        let claimed = u64::from(pid) << 32 | u64::from(SlotState::Claimed as u32);
        self.owner.compare_exchange(0, claimed, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    /// For the host: the slot is for the process that it is about to start, or nobody's (pid 0).
    pub fn reserve(&self, state: SlotState, pid: u32) {
        self.owner.store(u64::from(pid) << 32 | u64::from(state as u32), Ordering::Release);
    }

    /// For its holder, before `Waiting`: who it is.
    pub fn introduce(&self, role: Role, name: Name, start_time: u64) {
        let words: [u64; 5] = bytemuck::cast(name.0);
        for (slot, word) in self.name.iter().zip(words) {
            slot.store(word, Ordering::Relaxed);
        }
        self.start_time.store(start_time, Ordering::Relaxed);
        self.role.store(role as u32, Ordering::Release);
        self.request.store(0, Ordering::Relaxed);
        self.resync.store(0, Ordering::Relaxed);
        self.missed.store(0, Ordering::Relaxed);
        self.wants_barrier.store(0, Ordering::Relaxed);
        self.waited_for.store(0, Ordering::Relaxed);
    }

    /// For its holder, a client: whether the barrier should wait for it.
    pub fn request_barrier(&self, wanted: bool) {
        self.wants_barrier.store(wanted.into(), Ordering::Release);
    }

    /// For the host: how the barrier treats it, and from which frame on it owes work.
    pub fn admit(&self, waited_for: bool, lag: u64, done: Frame) {
        self.lag.store(lag, Ordering::Relaxed);
        self.ack.store(done.0, Ordering::Release);
        self.waited_for.store(waited_for.into(), Ordering::Release);
    }

    /// For the host: how many frames it may trail from now on.
    pub fn set_lag(&self, lag: u64) {
        self.lag.store(lag, Ordering::Release);
    }

    /// For its holder: a frame's work begins.
    pub fn begin(&self) {
        self.begin_nanos.store(clock::now_nanos(), Ordering::Relaxed);
    }

    /// For its holder: a journal part was missed.
    pub fn request_keyframe(&self) {
        self.resync.fetch_add(1, Ordering::Release);
    }

    /// For its holder: `count` frames went by unseen.
    pub fn add_missed(&self, count: u64) {
        self.missed.fetch_add(count, Ordering::Relaxed);
    }
}

/// How the last complete frame ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Everybody arrived.
    Complete,
    /// The deadline passed; the mask says whom it waited for.
    Late(u64),
    /// Somebody died and was not brought back; the mask says who.
    Degraded(u64),
}

/// No mask of members: the host decides how the frame ends.
const UNKNOWN: u64 = u64::MAX;

/// The words of one instance.
#[derive(Debug)]
#[repr(C, align(64))]
pub struct ControlPage {
    magic: AtomicU64,
    protocol: AtomicU32,
    host_pid: AtomicU32,
    host_start_time: AtomicU64,
    spin_nanos: AtomicU64,
    /// 1: the host is on its way out.
    ending: AtomicU32,
    synchronous: AtomicU32,
    /// The slot that holds the tick, plus one.
    ticker: AtomicU32,
    ending_kind: AtomicU32,
    ending_mask: AtomicU64,
    /// Rises when a new frame is published.
    pub tick: SequenceEvent,
    /// Rises when a frame is over for everybody.
    pub complete: SequenceEvent,
    /// Rung for the host: arrivals, requests, joiners.
    pub host: Notify,
    alive: AtomicU64,
    /// The frame that the host waits for.
    awaited: AtomicU64,
    /// Who was to work on it, a bit per slot.
    members: AtomicU64,
    /// How time passes: [`Settings`].
    settings: Versioned<4>,
    /// Counts the worlds that the host has loaded.
    episode: AtomicU64,
    slots: [Slot; SLOTS],
}

/// Why a control page cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PageError {
    /// It is not one of ours, or its host has not finished writing it.
    #[error("the control file is not one of a running host")]
    Foreign,
    /// Another version of this crate.
    #[error(
        "this program speaks bus protocol {ours}, the host {theirs}; build both from one checkout"
    )]
    Protocol {
        /// Of this program.
        ours: u32,
        /// Of the host.
        theirs: u32,
    },
}

impl ControlPage {
    /// For the host, on a page of zeros: makes it valid. `done` is the frame that the world is at.
    pub fn initialise(&self, pid: u32, start_time: u64, strategy: Strategy) {
        self.host_pid.store(pid, Ordering::Relaxed);
        self.host_start_time.store(start_time, Ordering::Relaxed);
        self.spin_nanos.store(strategy.spin_nanos, Ordering::Relaxed);
        self.protocol.store(PROTOCOL, Ordering::Relaxed);
        self.magic.store(MAGIC, Ordering::Release);
    }

    /// For everybody else: whether we understand it.
    pub fn check(&self) -> Result<(), PageError> {
        if self.magic.load(Ordering::Acquire) != MAGIC {
            return Err(PageError::Foreign);
        }
        let theirs = self.protocol.load(Ordering::Relaxed);
        if theirs != PROTOCOL {
            return Err(PageError::Protocol { ours: PROTOCOL, theirs });
        }
        Ok(())
    }

    /// For a test of strangers: pretends to be another version.
    #[doc(hidden)]
    pub fn pretend_protocol(&self, protocol: u32) {
        self.protocol.store(protocol, Ordering::Release);
    }

    /// The host's process and when it was started.
    pub fn host_process(&self) -> (u32, u64) {
        (self.host_pid.load(Ordering::Relaxed), self.host_start_time.load(Ordering::Relaxed))
    }

    /// How everybody waits.
    pub fn strategy(&self) -> Strategy {
        Strategy { spin_nanos: self.spin_nanos.load(Ordering::Relaxed) }
    }

    /// Whether the host is on its way out.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire) != 0
    }

    /// For the host: everybody go home.
    pub fn end(&self) {
        self.ending.store(1, Ordering::Release);
        self.tick.notify_all();
        self.complete.notify_all();
        self.host.ring();
    }

    /// Whether the world waits for a ticking client.
    pub fn is_synchronous(&self) -> bool {
        self.synchronous.load(Ordering::Acquire) != 0
    }

    /// For the host: how time passes from now on.
    pub fn set_settings(&self, settings: &Settings) {
        self.settings.store(bytemuck::cast(*settings));
        self.synchronous.store(settings.synchronous, Ordering::Release);
        self.complete.notify_all();
    }

    /// How time passes.
    pub fn settings(&self) -> Settings {
        bytemuck::cast(self.settings.load())
    }

    /// For the host: this world stands from now on.
    pub fn set_episode(&self, number: u32) {
        self.episode.store(number.into(), Ordering::Release);
        self.complete.notify_all();
    }

    /// Counts the worlds that the host has loaded; the first is 1.
    pub fn episode(&self) -> u32 {
        self.episode.load(Ordering::Acquire) as u32
    }

    /// The slot that holds the tick.
    pub fn ticker(&self) -> Option<usize> {
        (self.ticker.load(Ordering::Acquire) as usize).checked_sub(1)
    }

    /// A client takes the tick if nobody has it, or hands it over, or gives it back. Returns
    /// whether `from` held it.
    pub fn pass_tick(&self, from: Option<usize>, to: Option<usize>) -> bool {
        let code = |slot: Option<usize>| slot.map_or(0, |s| s as u32 + 1);
        self.ticker
            .compare_exchange(code(from), code(to), Ordering::AcqRel, Ordering::Relaxed)
            .is_ok()
    }

    /// A participant's words.
    pub fn slot(&self, index: usize) -> &Slot {
        &self.slots[index]
    }

    /// All of them.
    pub fn slots(&self) -> &[Slot; SLOTS] {
        &self.slots
    }

    /// Who is waited for, a bit per slot.
    pub fn alive(&self) -> u64 {
        self.alive.load(Ordering::Acquire)
    }

    /// For the host: it is waited for from now on.
    pub fn revive(&self, slot: usize) {
        self.alive.fetch_or(1 << slot, Ordering::AcqRel);
    }

    /// For the host's watcher: it is not waited for any more.
    pub fn bury(&self, slot: usize) {
        self.alive.fetch_and(!(1 << slot), Ordering::AcqRel);
    }

    /// The living who have not arrived at `frame`, their lag allowed for.
    pub fn missing(&self, frame: Frame) -> u64 {
        self.behind(self.alive(), frame, |slot| slot.in_barrier())
    }

    /// For the host, before it raises `tick`: the frame that arrivals are counted for, and whose.
    pub fn set_awaited(&self, frame: Frame, members: u64) {
        self.members.store(members, Ordering::Relaxed);
        self.awaited.store(frame.0, Ordering::Release);
    }

    /// For the host, when a member is lost: how this frame ends is not to be seen from the words.
    pub fn leave_verdict_to_host(&self) {
        self.members.store(UNKNOWN, Ordering::Relaxed);
    }

    /// Whether all who were to work on `frame` have: seen from their words, a moment before the
    /// host sees it.
    pub fn have_all_arrived(&self, frame: Frame) -> bool {
        if self.tick.get() < frame.0 {
            return false;
        }
        let members = self.members.load(Ordering::Relaxed);
        members != UNKNOWN && self.behind(members, frame, |_| true) == 0
    }

    /// Who of `mask` has not arrived at `frame`.
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

    /// For the holder of `slot`: its work up to `frame` is done. Whoever arrives last wakes the
    /// host.
    pub fn arrive(&self, slot: usize, frame: Frame) {
        let words = &self.slots[slot];
        words.end_nanos.store(clock::now_nanos(), Ordering::Relaxed);
        words.ack.store(frame.0, Ordering::Release);
        let awaited = || Frame(self.awaited.load(Ordering::Acquire));
        self.host.notify_if(|| self.missing(awaited()) == 0);
    }

    /// For the holder of the tick: asks for `frame`.
    pub fn request(&self, slot: usize, frame: Frame) {
        self.slots[slot].request.store(frame.0, Ordering::Release);
        self.host.ring();
    }

    /// For the host: `frame` is over, and how.
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

    /// How the last complete frame ended.
    pub fn ending(&self) -> Ending {
        let mask = self.ending_mask.load(Ordering::Relaxed);
        match self.ending_kind.load(Ordering::Relaxed) {
            1 => Ending::Late(mask),
            2 => Ending::Degraded(mask),
            _ => Ending::Complete,
        }
    }

    /// `sensor-render, client "agent"`: the names of a mask's slots.
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
