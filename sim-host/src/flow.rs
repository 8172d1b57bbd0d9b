//! How far clients have read the outcomes that they wait for.

use bus::{SLOTS, Slot};

/// How long commands wait for a client that waits for outcomes and does not read them.
const PATIENCE_NANOS: u64 = 500_000_000;

/// For each slot, how far its client had read when it was last seen to lag, and since when.
#[derive(Debug)]
pub(crate) struct FlowControl([(u64, u64); SLOTS]);

impl Default for FlowControl {
    fn default() -> FlowControl {
        FlowControl([(Slot::READS_NOTHING, 0); SLOTS])
    }
}

impl FlowControl {
    /// Returns whether commands wait for the client of a slot, which lags and has read up to `read`.
    pub(crate) fn is_awaited(&mut self, slot: usize, read: u64, now: u64) -> bool {
        let seen = &mut self.0[slot];
        if seen.0 != read {
            *seen = (read, now);
        }
        now - seen.1 < PATIENCE_NANOS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_that_reads_nothing_is_awaited_for_half_a_second() {
        let mut flow = FlowControl::default();
        let awaited =
            [0, 1, 499, 500, 900].map(|ms| flow.is_awaited(3, 7, (1000 + ms) * 1_000_000));
        assert_eq!(awaited, [true, true, true, false, false]);
        assert!(flow.is_awaited(3, 8, 2_000_000_000));
    }
}
