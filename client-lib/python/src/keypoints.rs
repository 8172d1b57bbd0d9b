//! Keypoints of walkers.

use client_lib::{ImageKeypoint, KEYPOINT_COUNT};
use pyo3::{prelude::*, types::PyTuple};

use crate::{array::fresh, measurement::Reading};

#[pyclass(frozen, module = "omnibus")]
pub(crate) struct Keypoints(pub(crate) client_lib::Keypoints);

/// Returns three numbers of each keypoint as an array of 17 × 3.
fn array<'py>(
    py: Python<'py>,
    numbers: &[[f32; 3]; KEYPOINT_COUNT],
) -> PyResult<Bound<'py, PyAny>> {
    let shape = PyTuple::new(py, [KEYPOINT_COUNT, 3])?;
    fresh(py, numbers.as_flattened())?.call_method1("reshape", (shape,))
}

#[pymethods]
impl Keypoints {
    #[getter]
    fn actor_id(&self) -> u32 {
        self.0.actor_id.0
    }

    #[getter]
    fn in_world<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, &self.0.in_world.map(|at| at.to_array()))
    }

    fn in_sensor<'py>(&self, py: Python<'py>, reading: &Reading) -> PyResult<Bound<'py, PyAny>> {
        let found = self.found(reading)?;
        array(py, &found.map(|one| one.in_sensor.to_array()))
    }

    fn in_image<'py>(&self, py: Python<'py>, reading: &Reading) -> PyResult<Bound<'py, PyAny>> {
        let found = self.found(reading)?;
        array(py, &found.map(|one| [one.px.x, one.px.y, f32::from(one.visibility as u8)]))
    }

    fn __repr__(&self) -> String {
        format!("Keypoints(actor_id={})", self.0.actor_id.0)
    }
}

impl Keypoints {
    fn found(&self, reading: &Reading) -> PyResult<[ImageKeypoint; KEYPOINT_COUNT]> {
        reading.with_keypoint_view(|view| self.0.in_image(view))
    }
}
