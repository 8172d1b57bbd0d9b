//! NumPy arrays: read-only ones over memory of the simulator, and writable ones of their own.

use std::sync::Arc;

use pyo3::{
    intern,
    prelude::*,
    sync::PyOnceLock,
    types::{PyByteArray, PyDict, PyList, PyTuple},
};

/// Bytes that live as long as this value.
pub(crate) trait Bytes: Send + Sync {
    fn bytes(&self) -> &[u8];
}

/// The owner of an array's memory: the base of the NumPy array.
#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Memory {
    address: usize,
    shape: Vec<usize>,
    typestr: &'static str,
    _owner: Arc<dyn Bytes>,
}

#[pymethods]
impl Memory {
    /// NumPy's array interface, version 3.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", PyTuple::new(py, &self.shape)?)?;
        interface.set_item("typestr", self.typestr)?;
        // True: read-only.
        interface.set_item("data", (self.address, true))?;
        Ok(interface)
    }
}

/// The part of `owner`'s bytes that begins at `offset`, as a read-only array.
///
/// # Panics
///
/// If the part is not inside.
pub(crate) fn array<'py>(
    py: Python<'py>,
    owner: Arc<dyn Bytes>,
    offset: usize,
    typestr: &'static str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let item: usize = typestr[2..].parse().expect("a size in bytes ends the type");
    let len = shape.iter().product::<usize>() * item;
    let address = owner.bytes()[offset..offset + len].as_ptr() as usize;
    let memory = Memory { address, shape: shape.to_vec(), typestr, _owner: owner };
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    ASARRAY.import(py, "numpy", "asarray")?.call1((memory,))
}

/// A field of a record: name, NumPy's type, shape.
pub(crate) type Field = (&'static str, &'static str, &'static [usize]);

/// A NumPy type of records, made once.
pub(crate) struct RecordType {
    fields: &'static [Field],
    made: PyOnceLock<Py<PyAny>>,
}

impl RecordType {
    pub(crate) const fn new(fields: &'static [Field]) -> RecordType {
        RecordType { fields, made: PyOnceLock::new() }
    }

    pub(crate) fn get<'py>(&self, py: Python<'py>) -> PyResult<&Bound<'py, PyAny>> {
        let made = self.made.get_or_try_init(py, || {
            let list = PyList::empty(py);
            for (name, kind, shape) in self.fields {
                match shape {
                    [] => list.append((name, kind))?,
                    shape => list.append((name, kind, PyTuple::new(py, *shape)?))?,
                }
            }
            PyResult::Ok(py.import("numpy")?.getattr("dtype")?.call1((list,))?.unbind())
        })?;
        Ok(made.bind(py))
    }

    /// `count` records from `offset` on, as a read-only array.
    pub(crate) fn array<'py>(
        &self,
        py: Python<'py>,
        owner: Arc<dyn Bytes>,
        offset: usize,
        count: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let dtype = self.get(py)?;
        let item: usize = dtype.getattr("itemsize")?.extract()?;
        let bytes = array(py, owner, offset, "|u1", &[count * item])?;
        bytes.call_method1("view", (dtype,))
    }
}

/// Numbers as a writable array of one dimension, which owns them: nothing writes into it later.
pub(crate) fn fresh<'py>(py: Python<'py>, numbers: &[f32]) -> PyResult<Bound<'py, PyAny>> {
    static FROMBUFFER: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let bytes = PyByteArray::new(py, bytemuck::cast_slice(numbers));
    FROMBUFFER.import(py, "numpy", "frombuffer")?.call1((bytes, intern!(py, "<f4")))
}

/// Bytes as a writable array of a shape, which owns them: nothing writes into it later.
pub(crate) fn fresh_bytes<'py>(
    py: Python<'py>,
    bytes: &[u8],
    shape: [usize; 3],
) -> PyResult<Bound<'py, PyAny>> {
    static FROMBUFFER: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let bytes = PyByteArray::new(py, bytes);
    let flat = FROMBUFFER.import(py, "numpy", "frombuffer")?.call1((bytes, intern!(py, "|u1")))?;
    flat.call_method1(intern!(py, "reshape"), (PyTuple::new(py, shape)?,))
}
