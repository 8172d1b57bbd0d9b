//! The processes of the stages: start, death, clean-up.

use std::{collections::BTreeMap, io, process::Child, thread::JoinHandle};

use bus::{ControlPageMapping, Instance, Role, SLOTS, SlotState};
use crossbeam::channel::{Receiver, Sender, bounded};

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

/// What the supervisor needs of the operating system.
pub(crate) trait Processes {
    /// Starts a stage and reports its end.
    fn start(&mut self, role: Role, occupant: Occupant, start_index: u64) -> io::Result<()>;

    /// Kills the process of a stage. Returns false if the stage is a thread, which cannot be killed.
    fn kill(&mut self, slot: usize) -> bool;

    /// Returns the processor time that the process of a stage has used, in clock ticks of 10 ms; `None`
    /// for a thread, whose time is not known apart from that of its process.
    fn processor_ticks(&self, slot: usize) -> Option<u64>;

    /// Reports the end of a process that the host did not start. Returns whether it is alive.
    fn watch(&self, occupant: Occupant, pid: u32, start_time: u64) -> bool;

    /// Stops watching the process of a slot. Afterwards its end does not change the control page.
    fn unwatch(&self, slot: usize);

    /// Returns how the stage of a slot ended, which has ended; `None` if it was no process.
    fn status(&mut self, slot: usize) -> Option<String>;

    /// Removes what dead processes left on the bus, except those in `spared`. Returns the number of
    /// items that could not be removed.
    fn clean_up(&self, spared: Vec<u32>) -> u64;

    /// Waits for the end of all stages; kills those that do not end.
    fn shut_down(&mut self);
}

/// The end of a process.
pub(crate) struct Death {
    pub(crate) why: String,
    /// Whether `why` is the process's own exit message.
    pub(crate) has_message: bool,
}

/// A process in a slot. The number tells it from those that had the slot before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Occupant {
    pub(crate) slot: usize,
    pub(crate) number: u64,
}

/// Where the ends of processes are reported.
#[derive(Clone)]
pub(crate) struct Reports {
    control: ControlPageMapping,
    deaths: Sender<Occupant>,
}

impl Reports {
    /// Reports the end of a process. The barrier is updated before anything else.
    pub(crate) fn report(&self, occupant: Occupant) {
        self.control.mark_dead(occupant.slot);
        let _ = self.deaths.try_send(occupant);
        self.control.host.notify();
    }
}

/// Watches every process on the bus. Dropping it ends all stages and waits for them.
pub(crate) struct Supervisor {
    instance: Instance,
    control: ControlPageMapping,
    processes: Box<dyn Processes>,
    starts: BTreeMap<usize, u64>,
    /// The number of the watched process of each slot.
    occupants: BTreeMap<usize, u64>,
    last_occupant: u64,
    deaths: Receiver<Occupant>,
}

impl Supervisor {
    /// Creates a supervisor of the processes that `processes` returns.
    pub(crate) fn new(
        instance: &Instance,
        control: &ControlPageMapping,
        processes: impl FnOnce(Reports) -> io::Result<Box<dyn Processes>>,
    ) -> io::Result<Supervisor> {
        let (sender, deaths) = bounded(4 * SLOTS);
        Ok(Supervisor {
            instance: instance.clone(),
            control: control.clone(),
            processes: processes(Reports { control: control.clone(), deaths: sender })?,
            starts: BTreeMap::new(),
            occupants: BTreeMap::new(),
            last_occupant: 0,
            deaths,
        })
    }

    /// Starts a stage in `slot`.
    pub(crate) fn start(&mut self, role: Role, slot: usize) -> io::Result<()> {
        let start_index = *self.starts.entry(slot).and_modify(|n| *n += 1).or_insert(0);
        self.control.slot(slot).reserve(SlotState::Claimed, 0);
        let occupant = self.next_occupant(slot);
        self.processes.start(role, occupant, start_index)
    }

    fn next_occupant(&mut self, slot: usize) -> Occupant {
        self.last_occupant += 1;
        let number = self.last_occupant;
        self.occupants.insert(slot, number);
        Occupant { slot, number }
    }

    /// Kills the process of a stage. Returns false if the stage is a thread, which cannot be killed.
    pub(crate) fn kill(&mut self, slot: usize) -> bool {
        self.processes.kill(slot)
    }

    /// Returns the processor time that the process of a stage has used, in clock ticks of 10 ms, if it
    /// is known.
    pub(crate) fn processor_ticks(&self, slot: usize) -> Option<u64> {
        self.processes.processor_ticks(slot)
    }

    /// Watches a process that the host did not start. Returns whether it is alive.
    pub(crate) fn watch(&mut self, slot: usize) -> bool {
        let occupant = self.next_occupant(slot);
        let words = self.control.slot(slot);
        self.processes.watch(occupant, words.pid(), words.start_time())
    }

    /// Stops watching a process that has left.
    pub(crate) fn unwatch(&mut self, slot: usize) {
        self.processes.unwatch(slot);
        // Its end may have been reported meanwhile, and the slot has another process soon.
        self.occupants.remove(&slot);
    }

    /// Returns the next slot whose process has ended, and the cause.
    pub(crate) fn next_death(&mut self) -> Option<(usize, Death)> {
        let slot = loop {
            let Occupant { slot, number } = self.deaths.try_recv().ok()?;
            if self.occupants.get(&slot) == Some(&number) {
                break slot;
            }
        };
        let status = self.processes.status(slot);
        // The file of a message is there without its text where memory ended.
        let words = self.instance.take_exit_message(slot).map(|words| match &*words {
            "" => "its message could not be written; is /dev/shm full?".to_owned(),
            _ => words,
        });
        let has_message = words.is_some();
        let why = words.or(status).unwrap_or_else(|| "its thread ended".to_owned());
        Some((slot, Death { why, has_message }))
    }

    /// Removes what dead processes left on the bus, except those in `spared`. Returns the number of
    /// items that could not be removed.
    pub(crate) fn clean_up(&self, spared: Vec<u32>) -> u64 {
        self.processes.clean_up(spared)
    }
}

/// Ends all stages and waits for them, also of a host that does not start.
impl Drop for Supervisor {
    fn drop(&mut self) {
        self.control.end();
        self.processes.shut_down();
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, rc::Rc};

    use super::*;

    /// Processes that do nothing but note their end.
    #[derive(Clone, Default)]
    struct Idle {
        has_ended: Rc<Cell<bool>>,
    }

    impl Processes for Idle {
        fn start(&mut self, _: Role, _: Occupant, _: u64) -> io::Result<()> {
            Ok(())
        }

        fn kill(&mut self, _: usize) -> bool {
            false
        }

        fn processor_ticks(&self, _: usize) -> Option<u64> {
            None
        }

        fn watch(&self, _: Occupant, _: u32, _: u64) -> bool {
            true
        }

        fn unwatch(&self, _: usize) {}

        fn status(&mut self, _: usize) -> Option<String> {
            None
        }

        fn clean_up(&self, _: Vec<u32>) -> u64 {
            0
        }

        fn shut_down(&mut self) {
            self.has_ended.set(true);
        }
    }

    #[test]
    fn the_death_of_a_process_that_had_left_does_not_concern_the_next_one_in_its_slot() {
        let instance = Instance::create(None).unwrap();
        let mut sender = None;
        let mut supervisor =
            Supervisor::new(instance.instance(), &instance.control().unwrap(), |reports| {
                sender = Some(reports);
                Ok(Box::<Idle>::default())
            })
            .unwrap();
        let reports = sender.unwrap();
        supervisor.watch(5);
        reports.report(Occupant { slot: 5, number: 1 });
        supervisor.unwatch(5);
        supervisor.watch(5);
        assert!(supervisor.next_death().is_none());
        reports.report(Occupant { slot: 5, number: 2 });
        assert_eq!(supervisor.next_death().map(|(slot, _)| slot), Some(5));
    }

    #[test]
    fn the_stages_of_a_host_that_does_not_start_are_ended() {
        let owned_instance = Instance::create(None).unwrap();
        let control = owned_instance.control().unwrap();
        control.initialise(0, 1, bus::Strategy::BATCH);
        let idle = Idle::default();
        let processes = |_| -> io::Result<Box<dyn Processes>> { Ok(Box::new(idle.clone())) };
        drop(Supervisor::new(owned_instance.instance(), &control, processes).unwrap());
        assert!(control.is_ending() && idle.has_ended.get());
    }
}
