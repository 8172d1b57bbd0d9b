//! NumPy arrays: read-only ones over memory of the simulator, and writable ones of their own.

use std::sync::Arc;

use pyo3::{
    intern,
    prelude::*,
    sync::PyOnceLock,
    types::{PyByteArray, PyList, PyTuple},
};

use crate::numpy;

/// Bytes that live as long as this value, and at one place.
pub(crate) trait Bytes: Send + Sync {
    fn bytes(&self) -> &[u8];
}

/// The owner of an array's memory: the base of the NumPy array.
#[pyclass(frozen, module = "omnibus._omnibus")]
pub(crate) struct Memory {
    _owner: Arc<dyn Bytes>,
}

/// A field of a record: name, NumPy's type, shape.
pub(crate) type Field = (&'static str, &'static str, &'static [usize]);

enum Items {
    Numbers(&'static str),
    Records(&'static [Field]),
}

/// A NumPy type of numbers or records, made once.
pub(crate) struct ItemType {
    items: Items,
    made: PyOnceLock<(Py<PyAny>, usize)>,
}

pub(crate) static U8: ItemType = ItemType::new(Items::Numbers("|u1"));
pub(crate) static U32: ItemType = ItemType::new(Items::Numbers("<u4"));
pub(crate) static F32: ItemType = ItemType::new(Items::Numbers("<f4"));

impl ItemType {
    const fn new(items: Items) -> ItemType {
        ItemType { items, made: PyOnceLock::new() }
    }

    pub(crate) const fn records(fields: &'static [Field]) -> ItemType {
        ItemType::new(Items::Records(fields))
    }

    /// The `numpy.dtype`, and its size in bytes.
    fn get<'py>(&self, py: Python<'py>) -> PyResult<(&Bound<'py, PyAny>, usize)> {
        let (dtype, size) = self.made.get_or_try_init(py, || {
            let make = py.import("numpy")?.getattr("dtype")?;
            let dtype = match self.items {
                Items::Numbers(kind) => make.call1((kind,))?,
                Items::Records(fields) => {
                    let list = PyList::empty(py);
                    for (name, kind, shape) in fields {
                        match shape {
                            [] => list.append((name, kind))?,
                            shape => list.append((name, kind, PyTuple::new(py, *shape)?))?,
                        }
                    }
                    make.call1((list,))?
                }
            };
            let size = dtype.getattr("itemsize")?.extract()?;
            PyResult::Ok((dtype.unbind(), size))
        })?;
        Ok((dtype.bind(py), *size))
    }

    /// The items that begin at `offset` of `owner`'s bytes, as a read-only array.
    ///
    /// # Panics
    ///
    /// If they are not inside.
    pub(crate) fn array<'py>(
        &self,
        py: Python<'py>,
        owner: Arc<dyn Bytes>,
        offset: usize,
        shape: &[usize],
    ) -> PyResult<Bound<'py, PyAny>> {
        let (dtype, size) = self.get(py)?;
        let len = shape.iter().product::<usize>() * size;
        let data = owner.bytes()[offset..offset + len].as_ptr();
        let base = Bound::new(py, Memory { _owner: owner })?.into_any();
        // SAFETY: the bytes lie at the same place while `base` has their owner, and nothing writes
        // what a reader has borrowed; they were just found to be as many.
        unsafe { numpy::read_only(py, dtype, shape, data, base) }
    }
}

/// Numbers as a writable array of one dimension, which owns them: nothing writes into it later.
pub(crate) fn fresh<'py>(py: Python<'py>, numbers: &[f32]) -> PyResult<Bound<'py, PyAny>> {
    static FROMBUFFER: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let bytes = PyByteArray::new(py, bytemuck::cast_slice(numbers));
    FROMBUFFER.import(py, "numpy", "frombuffer")?.call1((bytes, intern!(py, "<f4")))
}

/// Values of NumPy's type `typestr` as a writable array of a shape, which owns them: nothing writes
/// into it later.
pub(crate) fn fresh_values<'py>(
    py: Python<'py>,
    bytes: &[u8],
    typestr: &'static str,
    shape: [usize; 3],
) -> PyResult<Bound<'py, PyAny>> {
    static FROMBUFFER: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let bytes = PyByteArray::new(py, bytes);
    let flat = FROMBUFFER.import(py, "numpy", "frombuffer")?.call1((bytes, typestr))?;
    flat.call_method1(intern!(py, "reshape"), (PyTuple::new(py, shape)?,))
}
