//! The tick barrier as pure bookkeeping: participants, arrivals and deaths.
//!
//! It does not wait, send or read a clock, so that it is tested by scripts. The host feeds it from
//! the control page.

use std::collections::BTreeMap;

use protocol::Frame;

/// The consequence of a participant's death.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnDeath {
    /// The participant is restarted, served what it missed, and completes the tick.
    Respawn,
    /// The tick continues without the participant; a frame that it owed ends degraded.
    Drop,
}

/// A participant.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Member {
    name: String,
    on_death: OnDeath,
    /// Number of frames that it may trail.
    lag: u64,
    /// Its work up to this frame is done.
    done: Frame,
}

/// The status of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Participants are missing, and the deadline has not passed.
    Open,
    /// All participants have arrived.
    Complete,
    /// The deadline passed and these slots have not arrived.
    Late(u64),
    /// These slots died in this frame and are not restarted; all others have arrived.
    Degraded(u64),
}

/// The participants of the current frame and their arrivals.
#[derive(Debug, Default)]
pub(crate) struct Barrier {
    frame: Frame,
    members: BTreeMap<usize, Member>,
    /// Slots that died in this frame and are not restarted.
    lost: u64,
}

impl Barrier {
    /// Adds a participant at the current frame, with its work done up to `done`.
    pub(crate) fn join(
        &mut self,
        slot: usize,
        name: &str,
        on_death: OnDeath,
        lag: u64,
        done: Frame,
    ) {
        let member = Member { name: name.to_owned(), on_death, lag, done };
        self.members.insert(slot, member);
    }

    /// Removes a participant that leaves.
    pub(crate) fn leave(&mut self, slot: usize) {
        self.members.remove(&slot);
    }

    /// Records the death of the process in `slot`.
    pub(crate) fn dies(&mut self, slot: usize) {
        if self.members.get(&slot).is_some_and(|m| m.on_death == OnDeath::Drop) {
            if self.owes(slot) {
                self.lost |= 1 << slot;
            }
            self.members.remove(&slot);
        }
    }

    /// Records that the work of `slot` is done up to a frame. An earlier frame changes nothing.
    pub(crate) fn arrive(&mut self, slot: usize, done: Frame) {
        if let Some(member) = self.members.get_mut(&slot) {
            member.done = member.done.max(done);
        }
    }

    /// Returns the slots of all participants.
    pub(crate) fn slots(&self) -> impl ExactSizeIterator<Item = usize> {
        self.members.keys().copied()
    }

    /// Returns the slots of all participants as bits.
    pub(crate) fn mask(&self) -> u64 {
        self.slots().fold(0, |mask, slot| mask | 1 << slot)
    }

    /// Returns the frame up to which the work of `slot` is done.
    pub(crate) fn done(&self, slot: usize) -> Option<Frame> {
        self.members.get(&slot).map(|m| m.done)
    }

    /// Returns the number of frames that `slot` may trail.
    pub(crate) fn lag(&self, slot: usize) -> Option<u64> {
        self.members.get(&slot).map(|m| m.lag)
    }

    /// Sets the number of frames that `slot` may trail.
    pub(crate) fn set_lag(&mut self, slot: usize, lag: u64) {
        if let Some(member) = self.members.get_mut(&slot) {
            member.lag = lag;
        }
    }

    /// Opens the next frame and returns it.
    pub(crate) fn advance(&mut self) -> Frame {
        self.frame = self.frame.next();
        self.lost = 0;
        self.frame
    }

    /// Returns the current frame.
    pub(crate) fn frame(&self) -> Frame {
        self.frame
    }

    fn owes(&self, slot: usize) -> bool {
        self.members.get(&slot).is_some_and(|m| m.done.0 + m.lag < self.frame.0)
    }

    /// Returns the slots that the current frame waits for, as bits.
    pub(crate) fn missing(&self) -> u64 {
        let owing = self.members.keys().filter(|&&slot| self.owes(slot));
        owing.fold(0, |mask, slot| mask | 1 << slot)
    }

    /// Returns the status of the current frame; `is_late` if its deadline has passed.
    pub(crate) fn verdict(&self, is_late: bool) -> Verdict {
        match (self.missing(), self.lost) {
            (0, 0) => Verdict::Complete,
            (0, lost) => Verdict::Degraded(lost),
            (missing, _) if is_late => Verdict::Late(missing),
            _ => Verdict::Open,
        }
    }

    /// Returns `traffic (last arrival: frame 411)` for each slot of the mask.
    pub(crate) fn names(&self, mask: u64) -> String {
        let named = self.members.iter().filter(|(slot, _)| mask & (1 << **slot) != 0);
        let texts: Vec<_> =
            named.map(|(_, m)| format!("{} (last arrival: {})", m.name, m.done)).collect();
        texts.join(", ")
    }
}

#[cfg(test)]
mod tests;
