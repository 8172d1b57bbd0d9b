use std::sync::Arc;

use rayon::ThreadPool;

use crate::error::TraceError;

/// Thread pool of one tracer.
#[derive(Clone, Debug)]
pub(crate) struct Workers(Arc<ThreadPool>);

impl Workers {
    /// Starts `threads` threads; 0 means one per core that this process may use.
    pub(crate) fn new(threads: usize) -> Result<Workers, TraceError> {
        let available = || std::thread::available_parallelism().map_or(1, |cores| cores.get());
        let threads = if threads == 0 { available() } else { threads };
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("render-{index}"))
            .build()
            .map(|pool| Workers(Arc::new(pool)))
            .map_err(|why| TraceError::Threads { threads, why: why.to_string() })
    }

    /// Runs `work` on the pool and waits for its result.
    pub(crate) fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.0.install(work)
    }

    /// Returns the number of threads.
    pub(crate) fn count(&self) -> usize {
        self.0.current_num_threads()
    }
}
