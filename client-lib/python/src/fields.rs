//! The fields of Python's dataclasses.

use client_lib::glam::Vec3;
use pyo3::{exceptions::PyValueError, prelude::*};

/// Reads an attribute of a dataclass.
pub(crate) struct Fields<'a, 'py>(pub(crate) &'a Bound<'py, PyAny>);

impl Fields<'_, '_> {
    pub(crate) fn get<T>(&self, name: &str) -> PyResult<T>
    where
        T: for<'a, 'py> FromPyObject<'a, 'py, Error = PyErr>,
    {
        let value = self.0.getattr(name)?;
        value.extract().map_err(|e: PyErr| {
            let kind = self.0.get_type();
            PyValueError::new_err(format!("{kind}: {name} is {value}: {e}"))
        })
    }

    pub(crate) fn vector(&self, name: &str) -> PyResult<Vec3> {
        self.0.getattr(name)?.extract::<[f32; 3]>().map(Vec3::from_array)
    }

    pub(crate) fn names(&self, name: &str) -> PyResult<Vec<String>> {
        self.0.getattr(name)?.extract()
    }
}
