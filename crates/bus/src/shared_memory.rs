//! The room in /dev/shm.

use crate::BusError;

/// The folder of shared memory.
pub(crate) const SHM: &str = "/dev/shm";

/// Shared memory that is left for what other processes write at the same time.
const SPARE_BYTES: u64 = 1 << 20;

/// Free bytes of shared memory.
pub fn free_bytes() -> std::io::Result<u64> {
    let stat = rustix::fs::statvfs(SHM)?;
    Ok(stat.f_bavail * stat.f_frsize)
}

/// Refuses to create or write `what` if its bytes do not fit into shared memory.
///
/// The kernel would kill the process at its first access to a page that does not fit.
pub(crate) fn expect_room(what: &str, bytes: u64) -> Result<(), BusError> {
    let needed = bytes + SPARE_BYTES;
    let free = free_bytes().map_err(|e| BusError::Instance(format!("/dev/shm: {e}")))?;
    if free >= needed {
        return Ok(());
    }
    Err(BusError::SharedMemory { what: what.to_owned(), needed, free })
}
