//! The stages, with the loops of `traffic/src/run.rs` and `sensor-render/src/run.rs` around a planner
//! and a renderer of a few lines.

use std::{collections::BTreeMap, rc::Rc};

use bus::{
    BusError, Event, Instance, Participant, RenderPorts, Role, Snapshot, TrafficPorts, Writer,
};
use protocol::{
    BundleHeader, BundleId, Command, Frame, JournalEntry, Name, Page, SnapshotHeader,
    TrafficHeader, TrafficParts, param, status,
};

use super::{
    Shared,
    truth::{Folded, PlannerState},
};

/// Runs a stage until the host ends.
pub(super) fn run(shared: &Rc<Shared>, role: Role, slot: usize) {
    let ended = match role {
        Role::Traffic => Traffic::run(shared, slot),
        _ => Renderer::run(shared, slot),
    };
    match ended {
        Ok(()) | Err(BusError::HostEnds) => {}
        Err(error) => panic!("{}: {error}", role.name()),
    }
}

struct Traffic<'a> {
    shared: &'a Shared,
    participant: Participant,
    ports: TrafficPorts,
    number: u32,
    planner: PlannerState,
    done: Frame,
    /// Its work was done up to here when it joined.
    joined_at: Frame,
    /// The journal was received up to here.
    known: Frame,
}

impl Traffic<'_> {
    fn run(shared: &Shared, slot: usize) -> Result<(), BusError> {
        let name = Name::new(Role::Traffic.name());
        let participant = Participant::join(&Instance, Role::Traffic, name, Some(slot), true)?;
        let (number, _) = Instance.numbered_episode()?;
        let ports = TrafficPorts::open(participant.node()?)?;
        participant.ready()?;
        let done = participant.words().ack();
        let mut planner = PlannerState::default();
        while let Some(own) = ports.resume.receive()? {
            if let Some(parts) = own.header().parts(own.payload()) {
                planner = bytemuck::pod_read_unaligned(parts.planner);
            }
        }
        let (joined_at, known) = (done, done);
        let mut stage =
            Traffic { shared, participant, ports, number, planner, done, joined_at, known };
        loop {
            let newest =
                stage.participant.next_stage_frame(stage.done, &mut stage.ports.journal)?;
            stage.plan_until(newest)?;
        }
    }

    fn plan_until(&mut self, newest: Frame) -> Result<(), BusError> {
        while self.done < newest {
            let Traffic { participant, ports, done, .. } = &mut *self;
            if let Some(snapshot) = participant.next_snapshot(&ports.snapshot, *done, |_| {})? {
                self.plan(&snapshot)?;
            } else {
                participant.arrive_without(*done, newest);
                *done = newest;
            }
        }
        Ok(())
    }

    fn plan(&mut self, snapshot: &Snapshot) -> Result<(), BusError> {
        let header = snapshot.header();
        let frame = header.stamp.frame;
        self.participant.begin(frame);
        let mut journal = self.journal_of(header)?;
        journal.retain(|(at, entry)| *at > self.done || !applies_once(entry));
        if self.begin_episode(frame, &mut journal)? {
            self.shared.truth.borrow_mut().set_done(0, frame);
            self.done = frame;
            self.participant.arrive(frame);
            return Ok(());
        }
        journal.iter().for_each(|(_, entry)| self.planner.apply(entry));
        let planner = bytemuck::bytes_of(&self.planner);
        let parts = TrafficParts { planner, ..TrafficParts::default() };
        let decided =
            TrafficHeader { stamp: header.stamp, ..TrafficHeader::default() }.counting(&parts);
        let mut loan = self.ports.decided.loan(decided.layout().blocks)?;
        decided.fill(loan.payload_mut(), &parts);
        loan.send(decided)?;
        self.done = frame;
        self.participant.arrive(frame);
        Ok(())
    }

    fn begin_episode(
        &mut self,
        frame: Frame,
        journal: &mut Vec<(Frame, JournalEntry)>,
    ) -> Result<bool, BusError> {
        let is_map = |(_, entry): &(Frame, JournalEntry)| {
            entry.outcome.status == status::DONE
                && matches!(entry.command.decode(), Some(Command::LoadMap(_)))
        };
        let Some(last) = journal.iter().rposition(is_map) else { return Ok(false) };
        let (at, entry) = journal[last];
        journal.drain(..=last);
        if entry.outcome.id != self.number {
            self.number = Instance.numbered_episode()?.0;
            self.planner = PlannerState::default();
        }
        Ok(at == frame)
    }

    fn journal_of(
        &mut self,
        snapshot: &SnapshotHeader,
    ) -> Result<Vec<(Frame, JournalEntry)>, BusError> {
        let Traffic { participant, ports, .. } = self;
        participant.receive_journal(&mut ports.journal, snapshot.journal_serial)?;
        let frame = snapshot.stamp.frame;
        let events = ports.journal.until(frame).into_iter();
        let entries: Vec<_> = events
            .filter_map(|event| match event {
                Event::Entry(at, entry) => Some((at, entry)),
                Event::Reset => None,
            })
            .collect();
        let own = entries.iter().filter(|(at, _)| *at > self.joined_at).map(|(_, entry)| *entry);
        self.shared.truth.borrow_mut().check_entries("traffic", self.known, frame, own);
        self.known = frame;
        Ok(entries)
    }
}

fn applies_once(entry: &JournalEntry) -> bool {
    match entry.command.decode() {
        Some(Command::TrafficParam(set)) => param::is_once(set.param),
        _ => false,
    }
}

struct Renderer<'a> {
    shared: &'a Shared,
    participant: Participant,
    ports: RenderPorts,
    folded: Folded,
    writers: BTreeMap<BundleId, Writer<BundleHeader, Page>>,
    done: Frame,
    joined_at: Frame,
    known: Frame,
}

impl Renderer<'_> {
    fn run(shared: &Shared, slot: usize) -> Result<(), BusError> {
        let name = Name::new(Role::Render.name());
        let participant = Participant::join(&Instance, Role::Render, name, Some(slot), true)?;
        let ports = RenderPorts::open(participant.node()?)?;
        participant.ready()?;
        let done = participant.words().ack();
        let (joined_at, known) = (done, done);
        let (folded, writers) = (Folded::default(), BTreeMap::new());
        let mut stage =
            Renderer { shared, participant, ports, folded, writers, done, joined_at, known };
        loop {
            let newest =
                stage.participant.next_stage_frame(stage.done, &mut stage.ports.journal)?;
            stage.work_up_to(newest)?;
        }
    }

    fn work_up_to(&mut self, newest: Frame) -> Result<(), BusError> {
        while self.done < newest {
            let Renderer { participant, ports, done, .. } = &mut *self;
            if let Some(snapshot) = participant.next_snapshot(&ports.snapshot, *done, |_| {})? {
                self.measure(&snapshot)?;
            } else {
                participant.arrive_without(*done, newest);
                *done = newest;
            }
        }
        Ok(())
    }

    fn measure(&mut self, snapshot: &Snapshot) -> Result<(), BusError> {
        let header = snapshot.header();
        let frame = header.stamp.frame;
        self.participant.begin(frame);
        self.apply_journal(header)?;
        for (id, writer) in &self.writers {
            let header =
                BundleHeader { stamp: header.stamp, bundle: *id, ..BundleHeader::default() };
            writer.send(header, &[])?;
        }
        self.shared.truth.borrow_mut().set_done(1, frame);
        self.done = frame;
        self.participant.arrive(frame);
        Ok(())
    }

    fn apply_journal(&mut self, snapshot: &SnapshotHeader) -> Result<(), BusError> {
        let Renderer { participant, ports, .. } = self;
        participant.receive_journal(&mut ports.journal, snapshot.journal_serial)?;
        let frame = snapshot.stamp.frame;
        let mut own = Vec::new();
        for event in self.ports.journal.until(frame) {
            match event {
                Event::Reset => {
                    self.folded = Folded::default();
                    self.writers.clear();
                }
                Event::Entry(at, entry) => {
                    if at > self.joined_at {
                        own.push(entry);
                    }
                    self.apply(&entry)?;
                }
            }
        }
        let mut truth = self.shared.truth.borrow_mut();
        truth.check_entries("the renderer", self.known, frame, own.into_iter());
        truth.check_fold(frame, snapshot.stamp, &self.folded);
        self.known = frame;
        Ok(())
    }

    fn apply(&mut self, entry: &JournalEntry) -> Result<(), BusError> {
        self.folded.apply(entry);
        if entry.outcome.status != status::DONE {
            return Ok(());
        }
        let id = BundleId(entry.outcome.id);
        match entry.command.decode() {
            Some(Command::Sensor(_)) => match self.ports.bundle(id, 4096) {
                Ok(writer) => drop(self.writers.insert(id, writer)),
                Err(error) if error.is_missing_channel() => {}
                Err(error) => return Err(error),
            },
            Some(Command::DestroyBundle(id)) => drop(self.writers.remove(&id)),
            _ => {}
        }
        Ok(())
    }
}
