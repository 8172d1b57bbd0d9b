//! Flow control: commands wait while participants read slower than the host applies.

use bus::{Role, SLOTS, Slot, SlotState, clock};
use protocol::BATCH_MAX;

use super::{IDLE_NANOS, Shell};

/// Entries of the journal from which on commands of other clients wait for the next frame, while a
/// frame is in progress: stages read them while the client that requested the frame waits for it.
const TICK_ENTRIES: usize = 512;
/// The same of a frame that comes by itself.
const ASYNCHRONOUS_ENTRIES: usize = 8192;
/// The same of a frame that a client has to request, which may take any time.
const IDLE_ENTRIES: usize = 1 << 18;
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

    /// Returns the most batches that may be applied now, before the coming frame.
    pub(crate) fn batches_between_frames(&mut self) -> usize {
        if self.is_flooded() { 0 } else { self.batches_in_room() }
    }

    /// Returns the batches of one pass for which the journal of the coming frame has room.
    fn batches_in_room(&self) -> usize {
        let entries_max = match (self.settings.synchronous != 0, self.is_ticking) {
            (false, _) => ASYNCHRONOUS_ENTRIES,
            (true, true) => TICK_ENTRIES,
            (true, false) => IDLE_ENTRIES,
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
        if !self.inbox.has_urgent() {
            IDLE_NANOS
        } else if self.batches_between_frames() > 0 {
            0
        } else {
            CHECK_NANOS
        }
    }
}
