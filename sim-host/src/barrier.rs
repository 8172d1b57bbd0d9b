//! The tick barrier as pure bookkeeping: who takes part, who has arrived, what a death means.
//!
//! It neither waits nor sends nor reads a clock, so it is tested by scripts. The host feeds it
//! from the control page and does what it says.

use std::collections::BTreeMap;

use protocol::Frame;

/// What the host does when a participant dies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnDeath {
    /// Starts it anew, serves it what it missed, and completes the tick.
    Respawn,
    /// Goes on without it; a tick that it owed ends degraded.
    Drop,
}

/// One participant.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Member {
    name: String,
    on_death: OnDeath,
    /// How many frames it may trail.
    lag: u64,
    /// Its work up to this frame is done.
    done: Frame,
}

/// How a frame stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Not everybody has arrived; the deadline has not passed.
    Open,
    /// Everybody has arrived.
    Complete,
    /// The deadline passed; these slots have not arrived.
    Late(u64),
    /// These slots died in this frame and will not come back; all others have arrived.
    Degraded(u64),
}

/// Who must arrive at the current frame, and who has.
#[derive(Debug, Default)]
pub(crate) struct Barrier {
    frame: Frame,
    members: BTreeMap<usize, Member>,
    /// Slots that died in this frame and will not come back.
    lost: u64,
}

impl Barrier {
    /// From the current frame on, `slot` is waited for; it has done `done`.
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

    /// From now on, `slot` is not waited for, by its own will.
    pub(crate) fn leave(&mut self, slot: usize) {
        self.members.remove(&slot);
    }

    /// The process in `slot` is gone.
    pub(crate) fn dies(&mut self, slot: usize) {
        if self.members.get(&slot).is_some_and(|m| m.on_death == OnDeath::Drop) {
            if self.owes(slot) {
                self.lost |= 1 << slot;
            }
            self.members.remove(&slot);
        }
    }

    /// Work up to this frame was done in `slot`. Never goes back.
    pub(crate) fn arrive(&mut self, slot: usize, done: Frame) {
        if let Some(member) = self.members.get_mut(&slot) {
            member.done = member.done.max(done);
        }
    }

    /// Every slot that takes part.
    pub(crate) fn slots(&self) -> impl ExactSizeIterator<Item = usize> {
        self.members.keys().copied()
    }

    /// The same, a bit per slot.
    pub(crate) fn mask(&self) -> u64 {
        self.slots().fold(0, |mask, slot| mask | 1 << slot)
    }

    /// How far `slot` has come.
    pub(crate) fn done(&self, slot: usize) -> Option<Frame> {
        self.members.get(&slot).map(|m| m.done)
    }

    /// How many frames `slot` may trail from now on.
    pub(crate) fn set_lag(&mut self, slot: usize, lag: u64) {
        if let Some(member) = self.members.get_mut(&slot) {
            member.lag = lag;
        }
    }

    /// Opens the next frame.
    pub(crate) fn advance(&mut self) -> Frame {
        self.frame = self.frame.next();
        self.lost = 0;
        self.frame
    }

    /// The current frame.
    pub(crate) fn frame(&self) -> Frame {
        self.frame
    }

    fn owes(&self, slot: usize) -> bool {
        self.members.get(&slot).is_some_and(|m| m.done.0 + m.lag < self.frame.0)
    }

    /// Those the current frame still waits for, a bit per slot.
    pub(crate) fn missing(&self) -> u64 {
        let owing = self.members.keys().filter(|&&slot| self.owes(slot));
        owing.fold(0, |mask, slot| mask | 1 << slot)
    }

    /// How the current frame stands; `is_late`: its deadline has passed.
    pub(crate) fn verdict(&self, is_late: bool) -> Verdict {
        match (self.missing(), self.lost) {
            (0, 0) => Verdict::Complete,
            (0, lost) => Verdict::Degraded(lost),
            (missing, _) if is_late => Verdict::Late(missing),
            _ => Verdict::Open,
        }
    }

    /// `traffic (last arrival: frame 411)`, for each slot of the mask.
    pub(crate) fn names(&self, mask: u64) -> String {
        let named = self.members.iter().filter(|(slot, _)| mask & (1 << **slot) != 0);
        let texts: Vec<_> =
            named.map(|(_, m)| format!("{} (last arrival: {})", m.name, m.done)).collect();
        texts.join(", ")
    }
}

#[cfg(test)]
mod tests;
