//! Threads that are to run as soon as they are woken.
#![expect(unsafe_code, reason = "two system calls that have no safe wrapper")]

/// The time slice that such a thread asks for: the shortest that Linux grants. Nanoseconds.
const SLICE_NANOS: u64 = 100_000;

/// Asks the kernel for a short time slice for this thread, so that it runs at once when it is woken
/// while threads that compute, those of the renderer for instance, occupy every core; or, with false,
/// for the usual slice. While nothing computes, processes that yield to each other take turns faster
/// with the usual one.
///
/// Linux 6.12 and later grant it without privileges; others ignore it. Threads and processes that this
/// thread starts do not inherit it.
pub fn prefer_latency(is_preferred: bool) {
    // SAFETY: a struct of integers, for which zeros are values.
    let mut attributes: libc::sched_attr = unsafe { std::mem::zeroed() };
    let size = size_of::<libc::sched_attr>();
    // SAFETY: the kernel writes at most `size` bytes to the struct of this length.
    let read = unsafe {
        libc::syscall(libc::SYS_sched_getattr, 0, &raw mut attributes, size as libc::c_uint, 0)
    };
    if read != 0 || attributes.sched_policy != libc::SCHED_OTHER as u32 {
        return;
    }
    attributes.sched_runtime = if is_preferred { SLICE_NANOS } else { 0 };
    attributes.sched_flags |= libc::SCHED_FLAG_RESET_ON_FORK as u64;
    // SAFETY: the kernel reads a struct of the length that it names. A refusal changes nothing.
    unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attributes, 0) };
}
