//! Recordings: written and replayed.

use std::{path::PathBuf, sync::Arc};

use client_lib::{Profile, Replay};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::core::Core;

#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Recorder {
    pub(crate) core: Arc<Core>,
}

#[pymethods]
impl Recorder {
    #[pyo3(signature = (name, *, profile="state"))]
    fn start(&self, py: Python<'_>, name: PathBuf, profile: &str) -> PyResult<PathBuf> {
        let profile = match profile {
            "state" => Profile::State,
            "inputs" => Profile::Inputs,
            "compact" => Profile::Compact,
            other => {
                return Err(PyValueError::new_err(format!(
                    "profile is {other:?}; use state, inputs or compact"
                )));
            }
        };
        let name = name.to_string_lossy();
        self.core.with(py, |client| client.start_recorder(&name, profile))
    }

    /// Closes the recording; the number of its frames.
    fn stop(&self, py: Python<'_>) -> PyResult<u64> {
        self.core.with(py, client_lib::Client::stop_recorder)
    }

    #[pyo3(signature = (name, *, from_secs=0.0, duration_secs=0.0, time_factor=1.0, ignore_hero=false))]
    fn replay(
        &self,
        py: Python<'_>,
        name: PathBuf,
        from_secs: f64,
        duration_secs: f64,
        time_factor: f32,
        ignore_hero: bool,
    ) -> PyResult<()> {
        let name = name.to_string_lossy();
        let replay =
            Replay { from_s: from_secs, duration_s: duration_secs, time_factor, ignore_hero };
        self.core.with(py, |client| client.start_replay(&name, replay))
    }

    #[pyo3(signature = (*, keep_actors=false))]
    fn stop_replay(&self, py: Python<'_>, keep_actors: bool) -> PyResult<()> {
        self.core.with(py, |client| client.stop_replay(keep_actors))
    }
}
