//! Flow control: commands wait while participants read slower than the host applies.

use bus::{Role, SLOTS, Slot, SlotState, clock};
use protocol::BATCH_MAX;

use super::{IDLE_NANOS, Shell};

/// Entries of the journal from which on commands of other clients wait for the next frame, while a
/// frame is in progress: stages read them while the client that requested the frame waits for it.
const TICK_ENTRIES: usize = 512;
/// The same of a frame that comes by itself.
const ASYNCHRONOUS_ENTRIES: usize = 8192;
/// The same between two frames, for [`PAUSE_NANOS`] after the first: a client that goes on requesting
/// frames does not wait for what others send meanwhile.
const BETWEEN_ENTRIES: usize = 2048;
/// The same of a world that stands still for longer, for any time perhaps.
const IDLE_ENTRIES: usize = 1 << 18;
/// Time after a frame from which on its world stands still.
const PAUSE_NANOS: u64 = 100_000_000;
/// Batches of commands that one pass applies, over all clients, of which each has at least one.
const PASS_BATCHES: usize = 16;
/// Parts of the journal that stages have not been sent, from which on commands wait.
const BACKLOG_PARTS: usize = 4096;
/// Parts of outcomes that one pass of commands may need: of its batches, one of which may be a bundle
/// with the most sensors.
const PASS_PARTS: u64 = 128;
/// Time between two checks whether there is room again.
const CHECK_NANOS: u64 = 1_000_000;

impl Shell {
    /// Returns the most batches that the coming frame may have of clients that do not request it: at
    /// least one, so that none of them waits forever behind commands between frames.
    pub(crate) fn batches_of_frame(&mut self) -> usize {
        if self.is_flooded() { 0 } else { self.batches_in_room().max(1) }
    }

    /// Returns the most batches that may be applied now, before the coming frame: of the client that
    /// requests frames, and of others. Between two frames it waits for its own commands itself.
    pub(crate) fn batches_between_frames(&mut self) -> [usize; 2] {
        if self.is_flooded() {
            return [0; 2];
        }
        let others = self.batches_in_room();
        [if self.is_ticking { others } else { PASS_BATCHES }, others]
    }

    /// Returns the batches of one pass for which the journal of the coming frame has room.
    fn batches_in_room(&self) -> usize {
        let stands_still = || clock::now_nanos() > self.closed_nanos.saturating_add(PAUSE_NANOS);
        let entries_max = match (self.settings.synchronous != 0, self.is_ticking) {
            (false, _) => ASYNCHRONOUS_ENTRIES,
            (true, true) => TICK_ENTRIES,
            (true, false) if stands_still() => IDLE_ENTRIES,
            (true, false) => BETWEEN_ENTRIES,
        };
        entries_max.saturating_sub(self.journal.len()).div_ceil(BATCH_MAX).min(PASS_BATCHES)
    }

    /// Whether commands wait because stages do not keep up with the journal, or a client does not
    /// with the outcomes that it waits for. A client that has read nothing for a time is not waited
    /// for.
    fn is_flooded(&mut self) -> bool {
        if self.journal.backlog() >= BACKLOG_PARTS {
            return true;
        }
        let sent = self.journal.outcome_serial();
        let depth = bus::channel("outcome").depth as u64;
        let mut now = 0;
        for slot in 0..SLOTS {
            let words = self.control.slot(slot);
            let read = words.journal_read();
            if read == Slot::READS_NOTHING
                || sent.saturating_sub(read) + PASS_PARTS <= depth
                || words.role() != Some(Role::Client)
                || words.state() != SlotState::Live
            {
                continue;
            }
            now = if now == 0 { clock::now_nanos() } else { now };
            if self.flow.is_awaited(slot, read, now) {
                return true;
            }
        }
        false
    }

    /// Returns how long the host may sleep while nothing arrives: not at all while commands wait that
    /// can be applied.
    pub(crate) fn pause_nanos(&mut self) -> u64 {
        let ticking = self.ticking();
        let [own, others] = self.batches_between_frames();
        let is_own = |client| Some(client) == ticking;
        if !self.inbox.has_urgent(|_| true) {
            IDLE_NANOS
        } else if own > 0 && self.inbox.has_urgent(is_own)
            || others > 0 && self.inbox.has_urgent(|client| !is_own(client))
        {
            0
        } else {
            CHECK_NANOS
        }
    }
}
