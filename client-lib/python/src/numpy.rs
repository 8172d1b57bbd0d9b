//! The two functions of NumPy's C interface that make an array over memory of another owner.
//!
//! They are looked up at run time, as `import_array()` of NumPy's headers does, so that the package is
//! built without NumPy and works with every NumPy 2. By calls of Python functions the same takes
//! several times as long.
#![expect(unsafe_code, reason = "calls of C functions")]

use std::ffi::{c_int, c_uint, c_void};

use pyo3::{
    exceptions::PyImportError,
    ffi,
    prelude::*,
    sync::PyOnceLock,
    types::{PyCapsule, PyType},
};

/// `NPY_ABI_VERSION` of NumPy 2.
const ABI: c_uint = 0x0200_0000;

/// Places in the table of functions, fixed by NumPy's ABI (`numpy/_core/code_generators/numpy_api.py`).
const GET_ND_ARRAY_C_VERSION: usize = 0;
const NEW_FROM_DESCR: usize = 94;
const SET_BASE_OBJECT: usize = 282;

type GetNdArrayCVersion = unsafe extern "C" fn() -> c_uint;
type NewFromDescr = unsafe extern "C" fn(
    subtype: *mut ffi::PyTypeObject,
    dtype: *mut ffi::PyObject,
    dimensions: c_int,
    shape: *const ffi::Py_ssize_t,
    strides: *const ffi::Py_ssize_t,
    data: *mut c_void,
    flags: c_int,
    prototype: *mut ffi::PyObject,
) -> *mut ffi::PyObject;
type SetBaseObject =
    unsafe extern "C" fn(array: *mut ffi::PyObject, base: *mut ffi::PyObject) -> c_int;

struct Functions {
    new_from_descr: NewFromDescr,
    set_base_object: SetBaseObject,
    array_type: Py<PyType>,
}

impl Functions {
    fn look_up(py: Python<'_>) -> PyResult<Functions> {
        let module = py.import("numpy._core._multiarray_umath")?;
        let capsule = module.getattr("_ARRAY_API")?.cast_into::<PyCapsule>()?;
        let table = capsule.pointer_checked(None)?.cast::<*const c_void>();
        // SAFETY: NumPy's capsule holds its table of functions, which is never freed. The first one has
        // this type in every version, and the others in those of the ABI that is compared here.
        unsafe {
            let version = table.add(GET_ND_ARRAY_C_VERSION).cast::<GetNdArrayCVersion>().read()();
            if version != ABI {
                return Err(PyImportError::new_err(format!(
                    "the C interface of this NumPy has version {version:#010x}, and omnibus needs \
                     {ABI:#010x}; install NumPy 2: pip install 'numpy>=2.1,<3'"
                )));
            }
            Ok(Functions {
                new_from_descr: table.add(NEW_FROM_DESCR).cast().read(),
                set_base_object: table.add(SET_BASE_OBJECT).cast().read(),
                array_type: module.getattr("ndarray")?.cast_into::<PyType>()?.unbind(),
            })
        }
    }
}

/// Returns a read-only array of items of `dtype` that begin at `data`, row by row. `base` keeps them
/// alive.
///
/// # Safety
///
/// `dtype` is a `numpy.dtype`; as many items as `shape` says lie at `data` while `base` exists, and
/// nothing writes them.
pub(crate) unsafe fn read_only<'py>(
    py: Python<'py>,
    dtype: &Bound<'py, PyAny>,
    shape: &[usize],
    data: *const u8,
    base: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    static FUNCTIONS: PyOnceLock<Functions> = PyOnceLock::new();
    let functions = FUNCTIONS.get_or_try_init(py, || Functions::look_up(py))?;
    // SAFETY: the interpreter's lock is held. The first call takes a reference of `dtype` and the
    // second one of `base`, also when they fail. Without strides the items lie row by row; without
    // the flag NPY_ARRAY_WRITEABLE the array is read-only.
    unsafe {
        let array = (functions.new_from_descr)(
            functions.array_type.as_ptr().cast(),
            dtype.clone().into_ptr(),
            shape.len() as c_int,
            // A length of Rust's slices is at most isize::MAX.
            shape.as_ptr().cast(),
            std::ptr::null(),
            data.cast_mut().cast(),
            0,
            std::ptr::null_mut(),
        );
        let array = Bound::from_owned_ptr_or_err(py, array)?;
        if (functions.set_base_object)(array.as_ptr(), base.into_ptr()) != 0 {
            return Err(PyErr::fetch(py));
        }
        Ok(array)
    }
}
