//! The recording in progress.

use record::{Profile, Recorder};

/// The recording in progress.
pub(crate) struct Recording {
    pub recorder: Recorder,
    pub profile: Profile,
    /// Simulated time at which the whole world is recorded next; `None` for never.
    pub next_world_nanos: Option<u64>,
}
