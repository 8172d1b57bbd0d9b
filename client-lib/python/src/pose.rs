//! Poses between Python's `Pose` and the protocol's.

use client_lib::Pose;
use pyo3::{prelude::*, sync::PyOnceLock};

/// The attributes of a Python `omnibus.Pose`.
#[derive(FromPyObject)]
pub(crate) struct PyPose {
    position_m: [f32; 3],
    rotation_xyzw: [f32; 4],
}

impl From<PyPose> for Pose {
    fn from(pose: PyPose) -> Pose {
        Pose { position_m: pose.position_m, rotation: pose.rotation_xyzw }
    }
}

/// Returns a Python `omnibus.Pose`.
pub(crate) fn object<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyAny>> {
    static POSE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let class = POSE.import(py, "omnibus.pose", "Pose")?;
    class.call1((
        <(f32, f32, f32)>::from(pose.position_m),
        <(f32, f32, f32, f32)>::from(pose.rotation),
    ))
}
