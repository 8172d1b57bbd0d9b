//! Reads the stage clock of a simulator frame by frame, without taking part in it.

use bus::{
    CLOCK_FRAMES, ControlPageMapping, Instance, Queues, Role, SLOTS, SlotInstant, SlotState,
    StageClock,
};
use protocol::{Frame, Settings};

/// Frames after which every instant of a frame is there: a renderer may trail by three, and the
/// controls sent on a frame act in the next.
pub(crate) const SETTLED: u64 = 5;

/// A participant of a simulator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Member {
    /// Its slot on the control page; `None` for the host.
    pub(crate) slot: Option<usize>,
    pub(crate) role: Role,
    pub(crate) name: String,
    pub(crate) pid: u32,
    /// Frames that were published and at which it has not arrived.
    pub(crate) behind: u64,
    /// Frames that it never received.
    pub(crate) missed: u64,
    /// Parts of outcomes that it has not read; `None` if it waits for none.
    pub(crate) unread: Option<u64>,
    pub(crate) holds_tick: bool,
}

/// Reads frames from a control page.
pub(crate) struct Sampler {
    control: ControlPageMapping,
    /// The frame to be read next.
    next: Frame,
    /// The stage clocks of the frames that were read, in rising order.
    pub(crate) clocks: Vec<StageClock>,
    /// Frames that were overwritten before they were read.
    pub(crate) skipped: u64,
    /// How much waited in the host, at most.
    pub(crate) queues_max: Queues,
    /// The most frames that a stage was behind, by role.
    pub(crate) behind_max: Vec<(Role, u64)>,
}

impl Sampler {
    /// Begins with the frame that is published next.
    pub(crate) fn new(instance: &Instance) -> anyhow::Result<Sampler> {
        let control = instance.control()?;
        let next = Frame(control.tick.get()).next();
        Ok(Sampler {
            control,
            next,
            clocks: Vec::new(),
            skipped: 0,
            queues_max: Queues::default(),
            behind_max: Vec::new(),
        })
    }

    /// Whether the host has ended or is ending.
    pub(crate) fn is_over(&self) -> bool {
        let (pid, started) = self.control.host_process();
        self.control.is_ending() || bus::process::start_time(pid) != Some(started)
    }

    pub(crate) fn settings(&self) -> Settings {
        self.control.settings()
    }

    /// The newest published frame.
    pub(crate) fn frame(&self) -> Frame {
        Frame(self.control.tick.get())
    }

    /// How much waited in the host when it published the last frame.
    pub(crate) fn queues(&self) -> Queues {
        self.control.queues()
    }

    /// Reads the frames whose instants are all there.
    pub(crate) fn poll(&mut self) {
        let newest = self.control.tick.get();
        let until = newest.saturating_sub(SETTLED);
        let oldest = (newest + 1).saturating_sub(CLOCK_FRAMES as u64);
        if self.next.0 < oldest {
            self.skipped += oldest - self.next.0;
            self.next = Frame(oldest);
        }
        let client = self.client();
        while self.next.0 <= until {
            let clock = self.control.stage_clock(self.next, client);
            if clock.published_nanos.is_some() {
                self.clocks.push(clock);
            } else {
                self.skipped += 1;
            }
            self.next = self.next.next();
        }
        let queues = self.control.queues();
        let max = &mut self.queues_max;
        max.commands = max.commands.max(queues.commands);
        max.journal_parts = max.journal_parts.max(queues.journal_parts);
        max.recorded_frames = max.recorded_frames.max(queues.recorded_frames);
        for member in self.members() {
            match self.behind_max.iter_mut().find(|(role, _)| *role == member.role) {
                Some((_, most)) => *most = (*most).max(member.behind),
                None => self.behind_max.push((member.role, member.behind)),
            }
        }
    }

    /// The client whose instants are read: the one that ticks, or the one that read a frame last.
    fn client(&self) -> Option<usize> {
        let newest = self.control.tick.get();
        let last_read = |slot: &usize| {
            let frames = (0..CLOCK_FRAMES as u64).map(|age| newest.checked_sub(age));
            let mut read = frames.map_while(|frame| frame).map(Frame);
            read.find(|frame| self.control.instant(*slot, SlotInstant::Read, *frame).is_some())
        };
        self.control.ticker().or_else(|| {
            let clients = (0..SLOTS).filter(|slot| {
                let words = self.control.slot(*slot);
                words.role() == Some(Role::Client) && words.state() == SlotState::Live
            });
            clients.filter(|slot| last_read(slot).is_some()).max_by_key(last_read)
        })
    }

    /// The host, and every live participant in the order of slots.
    pub(crate) fn members(&self) -> Vec<Member> {
        let (pid, _) = self.control.host_process();
        let mut members = vec![Member {
            slot: None,
            role: Role::Host,
            name: Role::Host.name().to_owned(),
            pid,
            behind: 0,
            missed: 0,
            unread: None,
            holds_tick: false,
        }];
        let (tick, sent) = (self.control.tick.get(), self.control.outcomes_sent());
        for slot in 0..SLOTS {
            let words = self.control.slot(slot);
            let Some(role) = words.role().filter(|_| words.state() == SlotState::Live) else {
                continue;
            };
            let is_stage = role != Role::Client;
            let read = words.journal_read();
            members.push(Member {
                slot: Some(slot),
                role,
                name: words.name().to_string(),
                pid: words.pid(),
                behind: if is_stage || words.in_barrier() {
                    tick.saturating_sub(words.ack().0)
                } else {
                    0
                },
                missed: words.missed(),
                unread: (!is_stage && read != bus::Slot::READS_NOTHING)
                    .then(|| sent.saturating_sub(read)),
                holds_tick: self.control.ticker() == Some(slot),
            });
        }
        members
    }
}
