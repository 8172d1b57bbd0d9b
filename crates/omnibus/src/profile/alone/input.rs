//! What a stage that runs alone is fed with.

use protocol::{ActorState, Stamp, StandingState, WalkerLimbs};

use crate::profile::report::Series;

/// A frame of the recording, simulated again.
pub(crate) struct RecordedInput {
    pub(crate) stamp: Stamp,
    pub(crate) delta_nanos: u64,
    pub(crate) actors: Vec<ActorState>,
    pub(crate) limbs: Vec<WalkerLimbs>,
    pub(crate) standing: StandingState,
}

/// Returns a series of this name.
pub(crate) fn series(name: &str, nanos: impl Iterator<Item = u64>) -> Series {
    Series { name: name.to_owned(), nanos: nanos.collect() }
}
