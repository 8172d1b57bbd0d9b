//! Pointers to texts and arrays of C, and places for results.
//!
//! What C promises about its pointers is in the head of the header (`header.rs`).
#![expect(unsafe_code, reason = "C passes addresses, which Rust cannot check")]

use std::{
    ffi::{CStr, c_char},
    mem::MaybeUninit,
};

use crate::status::Fault;

/// A text of C; `None` for NULL.
pub(crate) fn optional_text<'a>(text: *const c_char, what: &str) -> Result<Option<&'a str>, Fault> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller promises a zero byte at the end, and that the text stays as it is during
    // the call.
    let text = unsafe { CStr::from_ptr(text) };
    let text = text.to_str().map_err(|e| Fault::argument(format!("{what}: {e}")))?;
    Ok(Some(text))
}

/// A text of C that must not be NULL.
pub(crate) fn text<'a>(text: *const c_char, what: &str) -> Result<&'a str, Fault> {
    optional_text(text, what)?.ok_or_else(|| Fault::null(what))
}

/// `count` values of C; the pointer may be NULL if there are none.
pub(crate) fn values<'a, T>(first: *const T, what: &str, count: usize) -> Result<&'a [T], Fault> {
    if count == 0 {
        return Ok(&[]);
    }
    check(first, what, count)?;
    // SAFETY: the caller promises `count` values there until the call returns; address and size
    // were checked.
    Ok(unsafe { std::slice::from_raw_parts(first, count) })
}

/// Writes as many of `values` as there is room for; the pointer may be NULL if `capacity` is 0.
pub(crate) fn fill<T: Copy>(
    room: *mut MaybeUninit<T>,
    what: &str,
    capacity: usize,
    values: &[T],
) -> Result<(), Fault> {
    let count = capacity.min(values.len());
    if count == 0 {
        return Ok(());
    }
    check(room, what, count)?;
    // SAFETY: the caller promises room for `capacity` values, which nothing else uses during the
    // call; address and size were checked.
    let room = unsafe { std::slice::from_raw_parts_mut(room, count) };
    for (place, value) in room.iter_mut().zip(values) {
        place.write(*value);
    }
    Ok(())
}

fn check<T>(first: *const T, what: &str, count: usize) -> Result<(), Fault> {
    if first.is_null() {
        return Err(Fault::null(what));
    }
    if !first.is_aligned() {
        return Err(Fault::argument(format!("{what} is not aligned to {} bytes", align_of::<T>())));
    }
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Fault::argument(format!("{what}: {count} values, more than memory can hold")));
    }
    Ok(())
}

/// The place for a result, which must be there.
pub(crate) fn place<'a, T>(
    out: Option<&'a mut MaybeUninit<T>>,
    what: &str,
) -> Result<&'a mut MaybeUninit<T>, Fault> {
    out.ok_or_else(|| Fault::null(what))
}
