//! Simulated processes as the supervisor starts and watches them.

use std::{
    cell::{Cell, RefCell, RefMut},
    collections::BTreeMap,
    io,
    rc::Rc,
};

use bus::{BusNode, Role, scheduler};

use super::{Shared, stages};
use crate::supervisor::{Occupant, Processes, Reports};

/// The processes of stages, and those that are watched.
pub(super) struct SimulatedProcesses {
    shared: Rc<Shared>,
    reports: Reports,
    watched: Rc<Watched>,
}

/// The watched processes.
#[derive(Default)]
struct Watched {
    /// The number and the process id of each slot's.
    by_slot: RefCell<BTreeMap<usize, (u64, u32)>>,
    /// Whether the watcher holds the lock.
    is_locked: Cell<bool>,
}

impl Watched {
    /// Waits for the lock, which is free until this process lets another one run.
    fn by_slot(&self) -> RefMut<'_, BTreeMap<usize, (u64, u32)>> {
        while self.is_locked.get() {
            scheduler::point("locked");
        }
        self.by_slot.borrow_mut()
    }

    /// Returns a watched process that has ended.
    fn ended(&self) -> Option<Occupant> {
        let by_slot = self.by_slot.borrow();
        let mut ended = by_slot.iter().filter(|(_, (_, pid))| !scheduler::lives(*pid));
        ended.next().map(|(slot, (number, _))| Occupant { slot: *slot, number: *number })
    }
}

impl SimulatedProcesses {
    /// Starts the watcher.
    pub(super) fn new(reports: Reports, shared: Rc<Shared>) -> SimulatedProcesses {
        let watched = Rc::new(Watched::default());
        let (table, sender) = (Rc::clone(&watched), reports.clone());
        scheduler::spawn("watcher", move || watch(&table, &sender));
        SimulatedProcesses { shared, reports, watched }
    }
}

/// Reports each watched process that has ended, as `processes.rs` of this crate does; the host may run between
/// the end and the report.
fn watch(watched: &Watched, reports: &Reports) {
    loop {
        let Some(occupant) = watched.ended() else {
            scheduler::park();
            continue;
        };
        for _ in 0..scheduler::random(30) {
            scheduler::point("death unnoticed");
        }
        let number = watched.by_slot.borrow().get(&occupant.slot).map(|(number, _)| *number);
        if number == Some(occupant.number) {
            watched.is_locked.set(true);
            watched.by_slot.borrow_mut().remove(&occupant.slot);
            reports.report(occupant);
            watched.is_locked.set(false);
        }
    }
}

impl Processes for SimulatedProcesses {
    fn start(&mut self, role: Role, occupant: Occupant, _start_index: u64) -> io::Result<()> {
        let slot = occupant.slot;
        let shared = Rc::clone(&self.shared);
        let pid = scheduler::spawn(role.name(), move || stages::run(&shared, role, slot));
        self.shared.stages.borrow_mut()[slot] = pid;
        let kills = &self.shared.kills_left;
        if kills.get() > 0 && scheduler::random(4) == 0 {
            kills.set(kills.get() - 1);
            scheduler::kill(pid, scheduler::random(200));
        }
        scheduler::point("started");
        if !self.watch(occupant, pid, 0) {
            self.reports.report(occupant);
        }
        Ok(())
    }

    fn kill(&mut self, slot: usize) -> bool {
        scheduler::kill(self.shared.stages.borrow()[slot], 0);
        true
    }

    fn processor_ticks(&self, _slot: usize) -> Option<u64> {
        Some(0)
    }

    fn watch(&self, occupant: Occupant, pid: u32, _start_time: u64) -> bool {
        if !scheduler::lives(pid) {
            return false;
        }
        self.watched.by_slot().insert(occupant.slot, (occupant.number, pid));
        // It may have ended meanwhile.
        scheduler::unpark();
        true
    }

    fn unwatch(&self, slot: usize) {
        self.watched.by_slot().remove(&slot);
    }

    fn status(&mut self, _slot: usize) -> Option<String> {
        Some("killed".into())
    }

    fn clean_up(&self, spared: Vec<u32>) -> u64 {
        BusNode.clean(&spared).1
    }

    fn shut_down(&mut self) {}
}
