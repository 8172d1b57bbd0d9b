//! Executions of a target, one after the other.

use std::{
    fmt,
    panic::{AssertUnwindSafe, catch_unwind},
    thread,
    time::Instant,
};

use mesh::RandomStream;

use crate::{
    corpus::{is_soak, real_maps, seeds},
    mutation::mutate,
    running::{Running, keep, set_running, watch},
    target::Target,
};

/// The longest input.
const LEN_MAX: usize = 1 << 16;

/// What a session has done.
#[derive(Clone, Copy, Debug, Default)]
pub struct Summary {
    /// Executions, those of the corpus included.
    pub executions: u64,
    /// Inputs that were accepted.
    pub accepted: u64,
    /// The most bytes that one execution allocated.
    pub allocated_most: u64,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Summary { executions, accepted, allocated_most } = self;
        let most = allocated_most.div_ceil(1024);
        write!(f, "{executions} executions, {accepted} accepted, at most {most} KiB allocated")
    }
}

/// A series of executions of one target. A process has one session at a time.
pub struct Session {
    target: &'static Target,
    summary: Summary,
}

impl Session {
    /// Begins a session. With `watched`, an execution that lasts longer than a minute ends the
    /// process; its input is kept.
    pub fn new(target: &'static Target, watched: bool) -> Session {
        if watched {
            let _ = thread::Builder::new().name("fuzz-watch".to_owned()).spawn(watch);
        }
        Session { target, summary: Summary::default() }
    }

    /// Executes the target on every file of its corpus, then on `count` mutations of them, which
    /// follow from `seed`.
    ///
    /// # Errors
    /// The corpus cannot be read, or an execution failed: why, and the command that repeats it.
    pub fn run(&mut self, count: u64, seed: u64) -> Result<Summary, String> {
        let name = self.target.name;
        let seeds = seeds(name).map_err(|e| format!("corpus/{name}: {e}"))?;
        for (path, bytes) in &seeds {
            self.execute(bytes).map_err(|why| format!("{}: {why}", path.display()))?;
        }
        let mut more = self.target.made.map_or_else(Vec::new, |made| made());
        if self.target.is_markup && is_soak() {
            more.extend(real_maps(LEN_MAX));
        }
        for bytes in &more {
            self.execute(bytes).map_err(|why| self.kept(bytes, &why))?;
        }
        let of_corpus = seeds.iter().map(|(_, bytes)| bytes.as_slice());
        let seeds: Vec<&[u8]> = of_corpus.chain(more.iter().map(Vec::as_slice)).collect();
        for nth in 0..count {
            let mut random = RandomStream::from_state(seed.wrapping_mul(1 << 32) + nth + 1);
            let mut bytes = mutate(&seeds, self.target.is_markup, &mut random);
            bytes.truncate(LEN_MAX);
            if let Some(seal) = self.target.seal.filter(|_| random.below(8) > 0) {
                seal(&mut bytes);
            }
            self.execute(&bytes).map_err(|why| self.kept(&bytes, &why))?;
        }
        Ok(self.summary)
    }

    /// Executes the target once.
    ///
    /// # Errors
    /// The reason why the execution failed.
    pub fn execute(&mut self, bytes: &[u8]) -> Result<(), String> {
        set_running(Some(Running {
            target: self.target.name,
            bytes: bytes.to_vec(),
            begun: Instant::now(),
        }));
        let result = catch_unwind(AssertUnwindSafe(|| self.target.check(bytes)));
        set_running(None);
        let (is_accepted, allocated) = result.map_err(|_| "it panicked".to_owned())?;
        self.summary.executions += 1;
        self.summary.accepted += u64::from(is_accepted);
        self.summary.allocated_most = self.summary.allocated_most.max(allocated);
        Ok(())
    }

    /// Returns what was done so far.
    pub fn summary(&self) -> Summary {
        self.summary
    }

    fn kept(&self, bytes: &[u8], why: &str) -> String {
        format!("{}: {why}; {}", self.target.name, keep(self.target.name, bytes))
    }
}
