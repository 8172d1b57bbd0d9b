//! The memory mapping of the control page.
#![expect(unsafe_code, reason = "a file is mapped and seen as the control page")]

use std::{fs::File, ops::Deref, sync::Arc};

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

use crate::ControlPage;

/// Length of the control file in bytes.
pub const CONTROL_LEN: usize = size_of::<ControlPage>().next_multiple_of(4096);

struct Mapping(*mut std::ffi::c_void);

// SAFETY: the mapping is accessed only as a `ControlPage`, which consists of atomics.
unsafe impl Send for Mapping {}
// SAFETY: as above.
unsafe impl Sync for Mapping {}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the address and length are those that `mmap` returned, and only this drop unmaps them.
        let _ = unsafe { munmap(self.0, CONTROL_LEN) };
    }
}

/// A mapped control page; clones share the mapping.
#[derive(Clone)]
pub struct ControlPageMapping(Arc<Mapping>);

impl ControlPageMapping {
    /// Maps a file of [`CONTROL_LEN`] bytes.
    pub fn map(file: &File) -> std::io::Result<ControlPageMapping> {
        let len = file.metadata()?.len();
        if len != CONTROL_LEN as u64 {
            return Err(std::io::Error::new(
                std::io::ErrorKind::InvalidData,
                format!("the control file has {len} bytes, not {CONTROL_LEN}"),
            ));
        }
        // SAFETY: a new shared mapping of a file of this length, at an address of the kernel's.
        let address = unsafe {
            mmap(
                std::ptr::null_mut(),
                CONTROL_LEN,
                ProtFlags::READ | ProtFlags::WRITE,
                MapFlags::SHARED,
                file,
                0,
            )?
        };
        Ok(ControlPageMapping(Arc::new(Mapping(address))))
    }
}

impl Deref for ControlPageMapping {
    type Target = ControlPage;

    fn deref(&self) -> &ControlPage {
        // SAFETY: the mapping is page-aligned, long enough, lives as long as `self`, and holds
        // nothing but atomics and reserved words, for which every bit pattern is valid.
        unsafe { &*self.0.0.cast::<ControlPage>() }
    }
}
