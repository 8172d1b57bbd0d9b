//! The newest decision of traffic, as the host keeps it.

use bus::TrafficSample;
use protocol::{Block, TrafficHeader};

use crate::saved::decision_hash;

/// A decision that was received from traffic or restored from a saved state.
pub(crate) enum Decided {
    Received(TrafficSample),
    Restored(TrafficHeader, Vec<Block>),
}

impl Decided {
    pub(crate) fn header(&self) -> &TrafficHeader {
        match self {
            Decided::Received(sample) => sample.header(),
            Decided::Restored(header, _) => header,
        }
    }

    pub(crate) fn payload(&self) -> &[Block] {
        match self {
            Decided::Received(sample) => sample.payload(),
            Decided::Restored(_, blocks) => blocks,
        }
    }

    /// Returns copies of the header and of the payload's bytes.
    pub(crate) fn to_owned(&self) -> (TrafficHeader, Vec<u8>) {
        (*self.header(), bytemuck::cast_slice(self.payload()).to_vec())
    }

    /// Returns the hash of the decision, which is part of the state hash.
    pub(crate) fn hash(&self) -> u64 {
        decision_hash(bytemuck::cast_slice(self.payload()))
    }
}
