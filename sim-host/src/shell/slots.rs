//! The slots of participants: join, barrier, leave and death.

use bus::{Role, SLOTS, SlotState, process};
use protocol::Frame;

use super::Shell;
use crate::{HostError, barrier::OnDeath, supervisor::Death};

/// Number of deaths of a stage in one frame after which it is not restarted. The ports of so many
/// renderers may stay on the bus for a frame; the table of channels has room for them.
const DEATHS_MAX: u32 = 5;

impl Shell {
    /// Handles deaths, joins, requests and leaves of all slots.
    pub(crate) fn service_slots(&mut self) -> Result<(), HostError> {
        self.served_count = self.control.host.count();
        while let Some((slot, death)) = self.supervisor.next_death() {
            self.clean_up_dead(slot, death)?;
        }
        for slot in 0..SLOTS {
            let words = self.control.slot(slot);
            match words.state() {
                SlotState::Free
                | SlotState::Admitted
                | SlotState::Quarantined
                | SlotState::Dead => {}
                SlotState::Claimed => self.free_if_gone(slot),
                SlotState::Waiting => self.admit(slot),
                SlotState::Ready => self.start_participating(slot)?,
                SlotState::Live => self.update_barrier(slot),
                SlotState::Leaving => self.leave(slot)?,
            }
        }
        self.restart_without_progress();
        self.send_journal()
    }

    fn free_if_gone(&self, slot: usize) {
        let words = self.control.slot(slot);
        let pid = words.pid();
        let is_stage = self.roles.contains_key(&slot);
        if !is_stage && pid != 0 && process::start_time(pid).is_none() {
            words.reserve(SlotState::Free, 0);
        }
    }

    fn admit(&mut self, slot: usize) {
        let words = self.control.slot(slot);
        if !self.roles.contains_key(&slot) && !self.supervisor.watch(slot) {
            words.reserve(SlotState::Free, 0);
            return;
        }
        words.set_state(SlotState::Admitted);
        self.control.complete.notify_all();
    }

    /// Sends the standing state to a participant whose ports exist, and admits it.
    fn start_participating(&mut self, slot: usize) -> Result<(), HostError> {
        self.ports.journal.connect_readers()?;
        if let Some(role) = self.roles.get(&slot).copied() {
            let frame = self.barrier.frame();
            // While a map is loaded no stage may trail, whatever the settings say.
            let lag = self.barrier.lag(slot).unwrap_or(self.lag(role));
            let done = match self.barrier.done(slot) {
                // A restarted planner continues from the frame of its saved state.
                Some(done) if role == Role::Traffic => done,
                // A renderer continues where its predecessor was, or from the oldest snapshot that
                // a new reader receives.
                Some(done) => {
                    let history = bus::channel("snapshot").history as u64;
                    done.max(Frame(frame.0.saturating_sub(history)))
                }
                None => {
                    self.barrier.join(slot, role.name(), OnDeath::Respawn, lag, frame);
                    frame
                }
            };
            self.control.slot(slot).admit(true, lag, done);
            self.journal_from.insert(slot, self.journal.sent());
            self.control.slot(slot).set_journal_read(self.journal.serial());
            let (keyframe, after) = self.keyframes.since(done);
            self.journal.push_keyframe(&keyframe, &after);
            self.send_journal()?;
            if role == Role::Traffic
                && let Some(decided) = &self.decided
            {
                self.ports.resume.send(*decided.header(), decided.payload())?;
            }
            self.control.mark_alive(slot);
        } else {
            self.control.slot(slot).admit(false, 0, self.barrier.frame());
        }
        self.ports.snapshot.connect_readers()?;
        self.control.slot(slot).set_state(SlotState::Live);
        self.control.complete.notify_all();
        Ok(())
    }

    /// Adds a client to the barrier or removes it, as it requests. The ticking client is never
    /// waited for.
    fn update_barrier(&mut self, slot: usize) {
        if self.roles.contains_key(&slot) {
            return;
        }
        let words = self.control.slot(slot);
        let should_join = words.wants_barrier() && self.control.ticker() != Some(slot);
        let frame = self.barrier.frame();
        match (should_join, self.barrier.done(slot).is_some()) {
            (true, false) => {
                let name = format!("client {:?}", words.name());
                self.barrier.join(slot, &name, OnDeath::Drop, 0, frame);
                words.admit(true, 0, frame);
                self.control.mark_alive(slot);
                self.control.complete.notify_all();
            }
            (false, true) => {
                self.leave_barrier(slot);
                self.control.slot(slot).admit(false, 0, frame);
                self.control.complete.notify_all();
            }
            _ => {}
        }
    }

    fn leave_barrier(&mut self, slot: usize) {
        self.barrier.leave(slot);
        self.control.mark_dead(slot);
    }

    /// Removes a participant that leaves.
    fn leave(&mut self, slot: usize) -> Result<(), HostError> {
        if self.roles.contains_key(&slot) {
            // A stage that leaves ends its process, which the watcher reports.
            return Ok(());
        }
        self.supervisor.unwatch(slot);
        self.remove_bundles(self.bundles.of(self.control.slot(slot).name()));
        self.leave_barrier(slot);
        self.release_tick(slot);
        self.control.slot(slot).reserve(SlotState::Free, 0);
        Ok(())
    }

    fn release_tick(&self, slot: usize) {
        if self.control.pass_tick(Some(slot), None) && self.settings.synchronous != 0 {
            let name = self.control.slot(slot).name();
            log::info!(
                "{} client {name:?} was the ticking client and is gone; the world waits for another",
                self.barrier.frame().0
            );
        }
    }

    /// Removes what dead processes left on the bus; returns how much could not be removed.
    ///
    /// What a process left stays while it is in a slot: it may have died after another one whose
    /// death is handled now, and what it sent last is not received yet.
    fn clean_up(&self) -> u64 {
        let occupied = (0..SLOTS).map(|slot| self.control.slot(slot)).filter(|words| {
            !matches!(words.state(), SlotState::Free | SlotState::Quarantined | SlotState::Dead)
        });
        let spared = occupied.map(|words| words.pid()).chain(self.kept.iter().copied()).collect();
        self.supervisor.clean_up(spared)
    }

    /// In synchronous mode, lets what a dead renderer left stay until the next tick, if it has arrived
    /// at a frame that is not over: the ticking client looks for the measurements of a frame after its
    /// end, and may not have seen this renderer before.
    fn keep_measurements(&mut self, slot: usize) {
        let words = self.control.slot(slot);
        let newest = self.barrier.frame().0;
        let is_unread = words.ack().0 + self.lag(Role::Render) >= newest;
        if self.settings.synchronous != 0 && is_unread {
            self.kept.push(words.pid());
        }
    }

    /// For the begin of a tick: removes what was kept.
    pub(crate) fn clean_up_kept(&mut self) {
        if !self.kept.is_empty() {
            self.kept.clear();
            self.clean_up();
        }
    }

    fn clean_up_dead(&mut self, slot: usize, death: Death) -> Result<(), HostError> {
        let Death { why, has_message } = death;
        let words = self.control.slot(slot);
        let (role, name) = (self.roles.get(&slot).copied(), words.name());
        if role.is_none() && words.state() == SlotState::Leaving {
            // It left before its process ended.
            return self.leave(slot);
        }
        words.set_state(SlotState::Dead);
        // It may have become a member after its death was reported.
        self.control.mark_dead(slot);
        self.journal_from.remove(&slot);
        self.progress.forget(slot);
        let frame = self.barrier.frame();
        // Data of the dead process is received before it is removed.
        self.receive_decided()?;
        self.inbox.drain(&self.ports, true)?;
        if role == Some(Role::Render) {
            self.keep_measurements(slot);
        }
        let stuck = self.clean_up();
        let Some(role) = role else {
            self.barrier.dies(slot);
            self.control.leave_verdict_to_host();
            self.remove_bundles(self.bundles.of(name));
            self.release_tick(slot);
            log::info!("{} client {name:?} died", frame.0);
            let state = if stuck == 0 { SlotState::Free } else { SlotState::Quarantined };
            self.control.slot(slot).reserve(state, 0);
            return Ok(());
        };
        self.barrier.arrive(slot, self.control.slot(slot).ack());
        if role == Role::Traffic
            && let Some(decided) = &self.decided
        {
            // The process may have died between sending the decision and arriving.
            self.barrier.arrive(slot, decided.header().stamp.frame);
        }
        self.barrier.dies(slot);
        let deaths = self.deaths.entry(slot).or_default();
        *deaths = if deaths.0 == frame { (frame, deaths.1 + 1) } else { (frame, 1) };
        let deaths = deaths.1;
        if frame == Frame(0) && has_message {
            return Err(HostError::Start { role: role.name(), why });
        }
        if !self.config.restart || deaths > DEATHS_MAX {
            let participant = role.name().to_owned();
            return Err(HostError::Died { participant, why, deaths, frame });
        }
        log::warn!("{} {} died and is restarted: {why}", frame.0, role.name());
        self.supervisor
            .start(role, slot)
            .map_err(|e| HostError::Start { role: role.name(), why: e.to_string() })
    }
}
