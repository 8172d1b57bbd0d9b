//! The traffic process: reads snapshots and writes the decisions of the planner.

use std::sync::Arc;

use bus::{
    BusError, Event, Instance, Participant, Role, SlotInstant, Snapshot, TrafficPorts, clock, fault,
};
use protocol::{
    ActorId, Command, Episode, Frame, JournalEntry, Name, SnapshotHeader, TrafficHeader, param,
    status,
};

use crate::{Planner, QueueHead, RestoreError};

/// Why the traffic process ended before its host.
#[derive(Debug, thiserror::Error)]
pub enum TrafficError {
    /// An error of the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The planner state that the host returned does not fit.
    #[error(transparent)]
    Planner(#[from] RestoreError),
    /// The map could not be read.
    #[error("{0}")]
    Map(String),
}

/// Plans for the host of `instance` until the host ends.
///
/// # Errors
///
/// [`TrafficError`] if the bus, the map or a saved planner state cannot be read.
pub fn run(instance: &Instance, slot: usize, in_process: bool) -> Result<(), TrafficError> {
    let name = Name::new(Role::Traffic.name());
    let participant = Participant::join(instance, Role::Traffic, name, Some(slot), in_process)?;
    fault::joining(Role::Traffic);
    let (number, episode) = instance.numbered_episode()?;
    let mut planner = new_planner(&episode)?;
    let ports = TrafficPorts::open(participant.node()?)?;
    participant.ready()?;
    let done = participant.words().ack();
    let blank = planner.save();
    while let Some(own) = ports.resume.receive()? {
        if let Some(parts) = own.header().parts(own.payload()) {
            planner.restore(parts.planner)?;
        }
    }
    let mut stage = TrafficStage {
        participant,
        ports,
        number,
        episode,
        planner,
        blank,
        saved: Vec::new(),
        done,
        first: done.next(),
    };
    loop {
        match stage.plan_next() {
            Err(TrafficError::Bus(BusError::HostEnds)) => return Ok(()),
            planned => planned?,
        }
    }
}

/// Creates a planner for the map of an episode.
fn new_planner(episode: &Episode) -> Result<Planner, TrafficError> {
    let cache = bake::Cache::from_environment();
    let network = cache
        .network(&episode.map, &episode.open_drive)
        .map_err(|e| TrafficError::Map(e.to_string()))?;
    let Episode { open_drive, seed, .. } = episode;
    let mut planner = Planner::with_cached_town(&cache, Arc::new(network), open_drive, *seed);
    planner.set_threads(0);
    Ok(planner)
}

/// Returns whether the command of an entry may be applied once only.
fn applies_once(entry: &JournalEntry) -> bool {
    match entry.command.decode() {
        Some(Command::TrafficParam(set)) => param::is_once(set.param),
        Some(Command::RouteCommand(_)) => true,
        _ => false,
    }
}

/// The state of the process between frames.
struct TrafficStage {
    participant: Participant,
    ports: TrafficPorts,
    /// Number of the episode within its host.
    number: u32,
    episode: Episode,
    planner: Planner,
    /// The state of a new planner on this map.
    blank: Vec<u8>,
    /// Buffer of the planner's state.
    saved: Vec<u8>,
    /// The last frame that is planned.
    done: Frame,
    /// The first frame of this process.
    first: Frame,
}

impl TrafficStage {
    /// Waits for a frame and plans on it.
    fn plan_next(&mut self) -> Result<(), TrafficError> {
        let TrafficStage { participant, ports, done, .. } = &mut *self;
        let newest = participant.next_stage_frame(*done, &mut ports.journal)?;
        self.plan_until(newest)
    }

    /// Plans on every frame up to `newest`; in asynchronous mode only on the newest.
    fn plan_until(&mut self, newest: Frame) -> Result<(), TrafficError> {
        while self.done < newest {
            let TrafficStage { participant, ports, done, .. } = &mut *self;
            if let Some(snapshot) = participant.next_snapshot(&ports.snapshot, *done, |_| {})? {
                self.plan(&snapshot)?;
            } else {
                participant.arrive_without(*done, newest);
                *done = newest;
            }
        }
        Ok(())
    }

    fn plan(&mut self, snapshot: &Snapshot) -> Result<(), TrafficError> {
        let header = snapshot.header();
        let frame = header.stamp.frame;
        self.participant.begin(frame);
        let begin_nanos = clock::now_nanos();
        fault::delay(Role::Traffic, frame);
        let mut journal = self.journal_of(header)?;
        // A restored planner has applied these already.
        journal.retain(|(at, entry)| *at > self.done || !applies_once(entry));
        if self.begin_episode(frame, &mut journal)? {
            // This is the world as loaded; planning starts on the next frame.
            self.done = frame;
            self.participant.arrive(frame);
            return Ok(());
        }
        let mut journal = journal.into_iter().map(|(_, entry)| entry).collect();
        self.restore_saved(&mut journal)?;
        self.planner.plan(header.delta_nanos, snapshot.actors(), &journal);
        self.participant.mark(SlotInstant::Worked, frame);
        for wait in self.planner.new_prop_waits() {
            let why = if wait.has_lane_beside {
                "the lane beside it is not free"
            } else {
                "its road has no other lane in its direction"
            };
            log::info!(
                "{} vehicle {} waits behind prop {}: {why}; move or destroy the prop",
                frame.0,
                wait.vehicle,
                wait.prop
            );
        }
        for standstill in self.planner.new_standstills() {
            let QueueHead { vehicle, cause, waits_for } = standstill.head;
            let of = if waits_for == ActorId::NONE {
                String::new()
            } else {
                format!(" (actor {})", waits_for.0)
            };
            log::info!(
                "{} vehicle {} has stood for 120 s: vehicle {}, the head of its queue, waits for {cause}{of}",
                frame.0,
                standstill.vehicle.0,
                vehicle.0
            );
        }
        self.saved.clear();
        self.planner.save_into(&mut self.saved);
        let parts = self.planner.parts(&self.saved);
        let decided = TrafficHeader {
            stamp: header.stamp,
            begin_nanos,
            end_nanos: clock::now_nanos(),
            ..TrafficHeader::default()
        };
        let decided = decided.counting(&parts);
        let mut loan = self.ports.decided.loan(decided.layout().blocks)?;
        decided.fill(loan.payload_mut(), &parts);
        fault::point(Role::Traffic, "loan_held", frame, self.first);
        loan.send(decided)?;
        fault::point(Role::Traffic, "sent", frame, self.first);
        self.done = frame;
        self.participant.arrive(frame);
        fault::point(Role::Traffic, "acked", frame, self.first);
        Ok(())
    }

    /// Switches to the last map that was loaded; earlier commands are dropped. Returns whether it
    /// was loaded in this very frame.
    fn begin_episode(
        &mut self,
        frame: Frame,
        journal: &mut Vec<(Frame, JournalEntry)>,
    ) -> Result<bool, TrafficError> {
        let is_map = |(_, entry): &(Frame, JournalEntry)| {
            entry.outcome.status == status::DONE
                && matches!(entry.command.decode(), Some(Command::LoadMap(_)))
        };
        let Some(last) = journal.iter().rposition(is_map) else { return Ok(false) };
        let (at, entry) = journal[last];
        journal.drain(..=last);
        // A process started since then has read the map already.
        if entry.outcome.id != self.number {
            let (number, episode) = self.participant.instance().numbered_episode()?;
            if episode == self.episode {
                self.planner.restore(&self.blank)?;
            } else {
                self.planner = new_planner(&episode)?;
                self.blank = self.planner.save();
            }
            (self.number, self.episode) = (number, episode);
        }
        Ok(at == frame)
    }

    /// Restores the planner if the world continued from a saved state; earlier commands are
    /// dropped.
    fn restore_saved(&mut self, journal: &mut Vec<JournalEntry>) -> Result<(), TrafficError> {
        let is_load = |entry: &JournalEntry| {
            entry.outcome.status == status::DONE
                && matches!(entry.command.decode(), Some(Command::LoadState(_)))
        };
        let Some(last) = journal.iter().rposition(is_load) else { return Ok(()) };
        journal.drain(..=last);
        while let Some(own) = self.ports.resume.receive()? {
            match own.header().parts(own.payload()) {
                Some(parts) if !parts.planner.is_empty() => self.planner.restore(parts.planner)?,
                _ => self.planner.restore(&self.blank)?,
            }
        }
        Ok(())
    }

    /// Returns the journal up to the frame of a snapshot.
    fn journal_of(
        &mut self,
        snapshot: &SnapshotHeader,
    ) -> Result<Vec<(Frame, JournalEntry)>, TrafficError> {
        let TrafficStage { participant, ports, .. } = self;
        participant.receive_journal(&mut ports.journal, snapshot.journal_serial)?;
        let events = ports.journal.until(snapshot.stamp.frame).into_iter();
        // The planner starts from its own saved state, so that a keyframe resets nothing here.
        let entries = events.filter_map(|event| match event {
            Event::Entry(at, entry) => Some((at, entry)),
            Event::Reset => None,
        });
        Ok(entries.collect())
    }
}
