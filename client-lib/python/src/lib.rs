//! The compiled part of the Python package `omnibus`: the client library as Python types.
//!
//! SI units and radians, right-handed axes; CARLA's are in the Python module `omnibus.carla_axes`.
//! Every wait releases the interpreter's lock and wakes often enough to notice Ctrl-C. Each object
//! that holds shared memory knows the process that made it: a forked child neither uses nor frees it.
#![expect(unsafe_code, reason = "the macros of pyo3 make functions that the interpreter calls")]
#![expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]

mod array;
mod bundle;
mod client;
mod core;
mod environment;
mod error;
mod fields;
mod keypoints;
mod map;
mod measurement;
mod numpy;
mod owned;
mod pose;
mod projection;
mod radar;
mod recorder;
mod sensor;
mod storage;
mod traffic;
mod wait;
mod world;

use pyo3::prelude::*;

#[pymodule]
mod _omnibus {
    use pyo3::{prelude::*, types::PyTuple};

    #[pymodule_export]
    use super::array::Memory;
    #[pymodule_export]
    use super::bundle::Bundle;
    #[pymodule_export]
    use super::client::Client;
    #[pymodule_export]
    use super::environment::{Environment, EnvironmentMap};
    #[pymodule_export]
    use super::keypoints::Keypoints;
    #[pymodule_export]
    use super::map::{LanePoint, Map};
    #[pymodule_export]
    use super::measurement::{Measurement, Reading};
    #[pymodule_export]
    use super::projection::Projection;
    #[pymodule_export]
    use super::recorder::Recorder;
    #[pymodule_export]
    use super::sensor::lidar_model;
    #[pymodule_export]
    use super::traffic::Traffic;
    #[pymodule_export]
    use super::wait::Cancel;
    #[pymodule_export]
    use super::world::World;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("VERSION", env!("CARGO_PKG_VERSION"))?;
        module.add("KEYPOINTS", PyTuple::new(module.py(), client_lib::KEYPOINTS)?)?;
        let links = client_lib::KEYPOINT_LINKS.map(|[from, to]| (from, to));
        module.add("KEYPOINT_LINKS", PyTuple::new(module.py(), links)?)?;
        module.add("BUILD", client_lib::VERSION)
    }
}
