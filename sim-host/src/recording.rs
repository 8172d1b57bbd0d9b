//! A recording that goes on.

use record::{Profile, Recorder};

/// A recording that goes on.
pub(crate) struct Recording {
    pub recorder: Recorder,
    pub profile: Profile,
    /// Simulated time at which the whole world is kept again; `None`: never.
    pub next_world_nanos: Option<u64>,
}
