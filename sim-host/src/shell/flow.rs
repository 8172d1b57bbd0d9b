//! Flow control: commands wait while participants read slower than the host applies.

use bus::{Role, SLOTS, Slot, SlotState, clock};

use super::{IDLE_NANOS, Shell};

/// Entries of the journal of a frame in progress from which on commands wait for the next frame:
/// the stages read them while the client waits for the frame.
const TICK_ENTRIES: usize = 2048;
/// The same of a frame that comes by itself.
const ASYNCHRONOUS_ENTRIES: usize = 8192;
/// The same of a frame that a client has to request, which may take any time.
const IDLE_ENTRIES: usize = 1 << 18;
/// Parts of the journal that stages have not been sent, from which on commands wait.
const BACKLOG_PARTS: usize = 4096;
/// Parts of outcomes that one pass of commands may need.
const PASS_PARTS: u64 = 64;
/// Time between two checks whether there is room again.
const CHECK_NANOS: u64 = 1_000_000;

impl Shell {
    /// Whether commands of clients may be applied now: the journal of the coming frame is not too
    /// long, stages keep up with it, and no client loses outcomes that it waits for. A client that
    /// has read nothing for a time is not waited for.
    pub(crate) fn has_room_for_commands(&mut self) -> bool {
        let entries_max = match (self.settings.synchronous != 0, self.is_ticking) {
            (false, _) => ASYNCHRONOUS_ENTRIES,
            (true, true) => TICK_ENTRIES,
            (true, false) => IDLE_ENTRIES,
        };
        if self.journal.len() >= entries_max || self.journal.backlog() >= BACKLOG_PARTS {
            return false;
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
                return false;
            }
        }
        true
    }

    /// Returns how long the host may sleep while nothing arrives: not at all while commands wait that
    /// can be applied.
    pub(crate) fn pause_nanos(&mut self) -> u64 {
        if !self.inbox.has_urgent() {
            IDLE_NANOS
        } else if self.has_room_for_commands() {
            0
        } else {
            CHECK_NANOS
        }
    }
}
