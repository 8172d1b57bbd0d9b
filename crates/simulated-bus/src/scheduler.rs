//! The scheduler of simulated processes.
//!
//! A process runs until it has executed a number of visible operations, sleeps or ends; then the
//! scheduler picks the next one. All choices come from the seed.

use std::{
    any::Any,
    cell::{Cell, RefCell},
    fmt::Write,
    panic::{Location, resume_unwind},
};

use crate::coroutine::{Coroutine, End, Job, switch};

/// Simulated time of a visible operation, in nanoseconds.
const STEP_NANOS: u64 = 100;

/// Visible operations after which a schedule counts as endless.
const STEPS_MAX: u64 = 3_000_000;

/// Simulated time after which a schedule counts as endless, in nanoseconds.
const END_NANOS: u64 = 30_000_000_000;

/// A process never dies by itself.
const NEVER: u64 = u64::MAX;

/// The address on which [`park`] sleeps.
const PARKED: usize = 1;

/// The address on which [`sleep`] sleeps: nothing wakes it.
const TIMER: usize = 2;

/// Random numbers from a seed.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The numbers of a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    fn number(&mut self) -> u64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `end`.
    pub fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.number()) * u128::from(end)) >> 64) as u64
    }
}

/// What the process that runs touches at every visible operation.
struct Running {
    /// Visible operations until the scheduler runs; outside of a schedule, too many to count.
    left: Cell<u64>,
    /// Visible operations that were given.
    slice: Cell<u64>,
    /// Time when the process began to run.
    began_nanos: Cell<u64>,
    /// Whether the process is killed: nothing that its destructors do is visible.
    is_dying: Cell<bool>,
    is_traced: Cell<bool>,
    process: Cell<usize>,
}

thread_local! {
    static RUNNING: Running = const {
        Running {
            left: Cell::new(u64::MAX),
            slice: Cell::new(u64::MAX),
            began_nanos: Cell::new(0),
            is_dying: Cell::new(false),
            is_traced: Cell::new(false),
            process: Cell::new(0),
        }
    };
    static SCHEDULE: RefCell<Option<Schedule>> = const { RefCell::new(None) };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Ready,
    /// Sleeps on an address until a time.
    Asleep(usize, u64),
    Ended,
}

struct Process {
    name: String,
    coroutine: Coroutine,
    state: State,
    /// Visible operations until it is killed.
    dies_in: u64,
    /// Stopped until this time.
    stopped_until: u64,
    /// How much more often than others it is picked.
    weight: u64,
}

struct Schedule {
    random: Random,
    processes: Vec<Process>,
    /// Mean number of visible operations between two switches.
    slice_mean: u64,
    steps: u64,
    /// Time that passed while all processes slept and none was stopped.
    idle_nanos: u64,
    trace: String,
}

/// What a schedule came to.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Visible operations of all processes.
    pub steps: u64,
    /// Processes that were killed.
    pub deaths: u64,
}

/// Panics of a killed process unwind with this.
struct Killed;

/// Runs `first` as a process and whatever it starts, until it ends; the others are killed then.
/// With `trace`, every visible operation is printed.
///
/// # Errors
///
/// The first panic of a process; all processes sleep for ever; the schedule is endless.
pub fn run(seed: u64, trace: bool, first: impl FnOnce() + 'static) -> Result<Report, String> {
    let mut random = Random::new(seed);
    let slice_mean = 1 << (1 + random.below(8));
    SCHEDULE.set(Some(Schedule {
        random,
        processes: Vec::new(),
        slice_mean,
        steps: 0,
        idle_nanos: 0,
        trace: String::new(),
    }));
    RUNNING.with(|running| {
        running.began_nanos.set(1_000_000_000);
        running.is_traced.set(trace);
        running.left.set(u64::MAX);
        running.slice.set(u64::MAX);
    });
    spawn("host", first);
    let mut report = Report::default();
    let result = loop {
        let Some(next) = with(Schedule::pick) else {
            break Err("all processes sleep for ever".to_owned());
        };
        let ended = resume(next, false);
        match ended {
            None => {}
            Some(Err(panic)) if panic.is::<Killed>() => report.deaths += 1,
            Some(Err(panic)) => {
                break Err(with(|s| s.processes[next].name.clone()) + ": " + message(&*panic));
            }
            Some(Ok(())) if next == 0 => break Ok(()),
            Some(Ok(())) => {}
        }
        report.steps = with(|schedule| schedule.steps);
        if report.steps > STEPS_MAX || now_nanos() > END_NANOS {
            break Err(format!("no end after {} steps and {} ns", report.steps, now_nanos()));
        }
    };
    for index in 0..with(|schedule| schedule.processes.len()) {
        if with(|schedule| schedule.processes[index].state) != State::Ended {
            resume(index, true);
        }
    }
    RUNNING.with(|running| {
        running.left.set(u64::MAX);
        running.slice.set(u64::MAX);
    });
    if let Some(schedule) = SCHEDULE.take() {
        print!("{}", schedule.trace);
    }
    result.map(|()| report)
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("a panic")
}

fn with<T>(act: impl FnOnce(&mut Schedule) -> T) -> T {
    SCHEDULE.with_borrow_mut(|schedule| act(schedule.as_mut().expect("a schedule runs")))
}

/// Runs a process until it switches back, or kills it.
fn resume(index: usize, is_killed: bool) -> Option<End> {
    let now = now_nanos();
    let (mut coroutine, slice, is_killed) = with(|schedule| {
        let mean = schedule.slice_mean;
        let slice = 1 + schedule.random.below(2 * mean);
        let process = &mut schedule.processes[index];
        process.state = State::Ready;
        let is_killed = is_killed || process.dies_in == 0;
        let coroutine = std::mem::replace(&mut process.coroutine, Coroutine::new(Box::new(|| {})));
        (coroutine, slice.min(process.dies_in), is_killed)
    });
    RUNNING.with(|running| {
        running.began_nanos.set(now);
        running.slice.set(slice);
        running.left.set(slice);
        running.is_dying.set(is_killed);
        running.process.set(index);
    });
    let ended = if is_killed && !coroutine.has_begun() {
        Some(Err(Box::new(Killed) as Box<dyn Any + Send>))
    } else {
        coroutine.resume()
    };
    let now = now_nanos();
    let used = RUNNING.with(|running| {
        let used = running.slice.get() - running.left.get();
        running.is_dying.set(false);
        running.began_nanos.set(now);
        running.left.set(u64::MAX);
        running.slice.set(u64::MAX);
        used
    });
    with(|schedule| {
        schedule.steps += used + 1;
        let process = &mut schedule.processes[index];
        if process.dies_in != NEVER {
            process.dies_in = process.dies_in.saturating_sub(used);
        }
        process.coroutine = coroutine;
        if ended.is_some() {
            process.state = State::Ended;
            schedule.wake_all(PARKED);
        }
    });
    ended
}

impl Schedule {
    /// Picks the process that runs next, and lets time pass if all of them sleep.
    fn pick(&mut self) -> Option<usize> {
        loop {
            let now = now_nanos();
            let can_run = |process: &Process| match process.state {
                _ if process.dies_in == 0 => process.state != State::Ended,
                _ if process.stopped_until > now => false,
                State::Ready => true,
                State::Asleep(_, until) => until <= now,
                State::Ended => false,
            };
            let total: u64 = self.processes.iter().filter(|p| can_run(p)).map(|p| p.weight).sum();
            if total > 0 {
                let mut at = self.random.below(total);
                return self.processes.iter().position(|process| {
                    if !can_run(process) {
                        return false;
                    }
                    let is_picked = at < process.weight;
                    at = at.saturating_sub(process.weight);
                    is_picked
                });
            }
            let wakes = |process: &Process| match process.state {
                State::Ended => u64::MAX,
                State::Ready => process.stopped_until,
                State::Asleep(_, until) => until.max(process.stopped_until),
            };
            let next = self.processes.iter().map(wakes).min().filter(|next| *next < u64::MAX)?;
            let is_idle =
                |process: &Process| process.state == State::Ended || process.stopped_until <= now;
            if self.processes.iter().all(is_idle) {
                self.idle_nanos += next - now;
            }
            if RUNNING.with(|running| running.is_traced.get()) {
                let _ = writeln!(self.trace, "{:12} all sleep until {next}", now);
            }
            RUNNING.with(|running| running.began_nanos.set(next));
        }
    }

    fn wake_all(&mut self, address: usize) {
        for process in &mut self.processes {
            if matches!(process.state, State::Asleep(at, _) if at == address) {
                process.state = State::Ready;
            }
        }
    }
}

/// Passes a visible operation. Returns false if the process is dying: the operation has no effect.
#[inline]
pub(crate) fn visible(caller: &'static Location<'static>) -> bool {
    RUNNING.with(|running| {
        if running.is_traced.get() {
            let file = caller.file().rsplit('/').next().unwrap_or("");
            trace(running, format_args!("{file}:{}", caller.line()));
        }
        pass(running)
    })
}

/// Passes a visible operation with a name.
pub fn point(name: &str) -> bool {
    RUNNING.with(|running| {
        if running.is_traced.get() {
            trace(running, format_args!("{name}"));
        }
        pass(running)
    })
}

#[inline]
fn pass(running: &Running) -> bool {
    let left = running.left.get();
    if left > 0 && !running.is_dying.get() {
        running.left.set(left - 1);
        return true;
    }
    pass_slowly(running)
}

#[cold]
fn pass_slowly(running: &Running) -> bool {
    if is_unwinding(running) {
        return false;
    }
    leave();
    running.left.set(running.left.get().saturating_sub(1));
    true
}

/// Whether the process is killed or has panicked. No other process may run before it has unwound.
fn is_unwinding(running: &Running) -> bool {
    running.is_dying.get() || std::thread::panicking()
}

/// Lets the scheduler run. Does not return to a process that is killed.
fn leave() {
    switch();
    if RUNNING.with(|running| running.is_dying.get()) {
        resume_unwind(Box::new(Killed));
    }
}

fn trace(running: &Running, what: std::fmt::Arguments<'_>) {
    if running.slice.get() == u64::MAX || running.is_dying.get() {
        return;
    }
    let now = now_nanos();
    with(|schedule| {
        let name = &schedule.processes[running.process.get()].name;
        let _ = writeln!(schedule.trace, "{now:12} {name:16} {what}");
    });
}

/// Adds a line to the trace, if the schedule is traced.
pub fn note(text: impl FnOnce() -> String) {
    RUNNING.with(|running| {
        if running.is_traced.get() {
            trace(running, format_args!("{}", text()));
        }
    });
}

/// Nanoseconds of the simulated clock.
pub fn now_nanos() -> u64 {
    RUNNING.with(|running| {
        let used = running.slice.get() - running.left.get();
        running.began_nanos.get() + used * STEP_NANOS
    })
}

/// Starts a process and returns its id.
pub fn spawn(name: &str, job: impl FnOnce() + 'static) -> u32 {
    let job: Job = Box::new(job);
    with(|schedule| {
        let weight = 1 << schedule.random.below(4);
        let pid = schedule.processes.len() as u32 + 1;
        schedule.processes.push(Process {
            name: format!("{name}.{pid}"),
            coroutine: Coroutine::new(job),
            state: State::Ready,
            dies_in: NEVER,
            stopped_until: 0,
            weight,
        });
        pid
    })
}

/// The id of the process that runs; 0 outside of a schedule.
pub fn own_pid() -> u32 {
    SCHEDULE.with_borrow(|schedule| match schedule {
        Some(_) => RUNNING.with(|running| running.process.get() as u32 + 1),
        None => 0,
    })
}

/// Whether a process has not ended.
pub fn lives(pid: u32) -> bool {
    SCHEDULE.with_borrow(|schedule| {
        let process =
            schedule.as_ref().and_then(|s| s.processes.get((pid as usize).checked_sub(1)?));
        process.is_some_and(|process| process.state != State::Ended)
    })
}

/// Kills a process after so many of its visible operations.
pub fn kill(pid: u32, operations: u64) {
    with(|schedule| {
        if let Some(process) = schedule.processes.get_mut(pid as usize - 1) {
            process.dies_in = process.dies_in.min(operations);
        }
    });
}

/// Takes back what [`kill`] was to do, for all processes that live.
pub fn spare_all() {
    with(|schedule| {
        for process in schedule.processes.iter_mut().filter(|process| process.dies_in > 0) {
            process.dies_in = NEVER;
        }
    });
}

/// Stops a process for a time. Nanoseconds.
pub fn stop(pid: u32, nanos: u64) {
    let now = now_nanos();
    with(|schedule| {
        if let Some(process) = schedule.processes.get_mut(pid as usize - 1) {
            process.stopped_until = now + nanos;
        }
    });
}

/// A random number below `end`, from the schedule's seed.
pub fn random(end: u64) -> u64 {
    with(|schedule| schedule.random.below(end))
}

/// Time that passed while all processes slept and none was stopped. Nanoseconds.
pub fn idle_nanos() -> u64 {
    with(|schedule| schedule.idle_nanos)
}

/// Sleeps until a process ends.
pub fn park() {
    sleep_on(PARKED, None);
}

/// Wakes the processes that called [`park`].
pub fn unpark() {
    wake_all(PARKED);
}

/// Sleeps for a time. Nanoseconds.
pub fn sleep(nanos: u64) {
    sleep_on(TIMER, Some(nanos));
}

/// Sleeps on an address until it is woken, at most for a time.
pub(crate) fn sleep_on(address: usize, at_most: Option<u64>) {
    if RUNNING.with(is_unwinding) {
        return;
    }
    let until = at_most.map_or(u64::MAX, |nanos| now_nanos().saturating_add(nanos));
    set_state(State::Asleep(address, until));
    leave();
}

/// Wakes all processes that sleep on an address.
pub(crate) fn wake_all(address: usize) {
    if point("wake") {
        with(|schedule| schedule.wake_all(address));
    }
}

/// Lets other processes run.
pub(crate) fn yield_core() {
    if RUNNING.with(|running| !is_unwinding(running) && running.slice.get() != u64::MAX) {
        leave();
    }
}

fn set_state(state: State) {
    let process = RUNNING.with(|running| running.process.get());
    with(|schedule| schedule.processes[process].state = state);
}
