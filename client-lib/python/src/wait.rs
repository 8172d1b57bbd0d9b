//! Waits without the interpreter's lock that notice Ctrl-C.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use client_lib::ClientError;
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::error::{CancelledError, SimulatorTimeoutError, error};

/// How long a wait runs before it looks at the interpreter's signals and at `Cancel`.
const SLICE: Duration = Duration::from_millis(50);

/// Ends a wait of another thread.
#[pyclass(frozen, module = "omnibus._omnibus")]
#[derive(Clone, Default)]
pub(crate) struct Cancel {
    is_set: Arc<AtomicBool>,
}

#[pymethods]
impl Cancel {
    #[new]
    fn new() -> Cancel {
        Cancel::default()
    }

    fn set(&self) {
        self.is_set.store(true, Ordering::Release);
    }

    fn is_set(&self) -> bool {
        self.is_set.load(Ordering::Acquire)
    }
}

/// When a wait ends without what is awaited.
pub(crate) struct Limit {
    timeout: Option<Duration>,
    end: Option<Instant>,
    cancel: Option<Cancel>,
}

impl Limit {
    pub(crate) fn of(timeout: Duration) -> Limit {
        Limit { timeout: Some(timeout), end: Instant::now().checked_add(timeout), cancel: None }
    }

    /// The optional arguments of a Python call.
    pub(crate) fn new(timeout_secs: Option<f64>, cancel: Option<&Cancel>) -> PyResult<Limit> {
        let timeout = timeout_secs.map(|secs| seconds("timeout_secs", secs)).transpose()?;
        let end = timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        Ok(Limit { timeout, end, cancel: cancel.cloned() })
    }
}

/// Waits in slices, without the interpreter's lock, until `wait` returns a value or the limit is
/// reached; without one, until the simulator ends. `what` is awaited.
pub(crate) fn wait<T: Send>(
    py: Python<'_>,
    what: &str,
    limit: &Limit,
    mut wait: impl FnMut(Duration) -> Result<Option<T>, ClientError> + Send,
) -> PyResult<T> {
    loop {
        let left = limit.end.map_or(SLICE, |end| end.saturating_duration_since(Instant::now()));
        if let Some(value) = py.detach(|| wait(left.min(SLICE))).map_err(error)? {
            return Ok(value);
        }
        py.check_signals()?;
        if limit.cancel.as_ref().is_some_and(Cancel::is_set) {
            return Err(CancelledError::new_err(format!("the wait for {what} was cancelled")));
        }
        if limit.end.is_some_and(|end| Instant::now() >= end) {
            let secs = limit.timeout.unwrap_or_default().as_secs_f64();
            return Err(SimulatorTimeoutError::new_err(format!(
                "timeout: {what} did not come within {secs} s; is the simulator stopped, or does \
                 no client tick?"
            )));
        }
    }
}

/// A time in seconds.
pub(crate) fn seconds(name: &str, secs: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(secs)
        .map_err(|_| PyValueError::new_err(format!("{name} is {secs}, not a time in seconds")))
}
