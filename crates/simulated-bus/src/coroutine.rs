//! Stacks on which simulated processes run. They are kept, because a new one costs more than a schedule
//! may.

use std::{
    any::Any,
    cell::{Cell, RefCell},
    mem::ManuallyDrop,
    panic::{AssertUnwindSafe, catch_unwind},
};

use generator::{Generator, Gn};

/// Words of a stack: physics runs on it.
const STACK_WORDS: usize = (2 << 20) / size_of::<usize>();

/// What a process executes.
pub(crate) type Job = Box<dyn FnOnce()>;
/// How a job ended: `Err` holds what it panicked with.
pub(crate) type End = Result<(), Box<dyn Any + Send>>;

thread_local! {
    static IDLE: RefCell<Vec<Stack>> = const { RefCell::new(Vec::new()) };
    static NEXT: RefCell<Option<Job>> = const { RefCell::new(None) };
    static ENDED: Cell<Option<End>> = const { Cell::new(None) };
}

/// Never dropped: a generator that is dropped before its end unwinds its stack.
struct Stack(ManuallyDrop<Generator<'static, (), ()>>);

/// A job on a stack of its own.
pub(crate) struct Coroutine {
    stack: Option<Stack>,
    job: Option<Job>,
}

impl Coroutine {
    pub(crate) fn new(job: Job) -> Coroutine {
        Coroutine { stack: None, job: Some(job) }
    }

    /// Whether the job has begun.
    pub(crate) fn has_begun(&self) -> bool {
        self.job.is_none()
    }

    /// Runs until the job calls [`switch`] or ends.
    pub(crate) fn resume(&mut self) -> Option<End> {
        if let Some(job) = self.job.take() {
            NEXT.set(Some(job));
            let idle = IDLE.with_borrow_mut(Vec::pop);
            self.stack = Some(
                idle.unwrap_or_else(|| Stack(ManuallyDrop::new(Gn::new_opt(STACK_WORDS, work)))),
            );
        }
        self.stack.as_mut()?.0.resume();
        let ended = ENDED.take()?;
        if let Some(stack) = self.stack.take() {
            IDLE.with_borrow_mut(|idle| idle.push(stack));
        }
        Some(ended)
    }
}

/// Executes one job after another.
fn work() {
    while let Some(job) = NEXT.take() {
        let ended = catch_unwind(AssertUnwindSafe(job));
        ENDED.set(Some(ended));
        switch();
    }
}

/// Returns to the caller of [`Coroutine::resume`].
#[expect(deprecated, reason = "the newer form needs a handle in every function up to here")]
pub(crate) fn switch() {
    generator::yield_with(());
}
