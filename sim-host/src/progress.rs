//! The progress of stages while the world runs without waiting for them.

use std::collections::BTreeMap;

use protocol::Frame;

/// Deadlines after which a stage that uses its processor counts as stalled too.
const BUSY_DEADLINES: u64 = 6;

/// A stage is busy if it uses more than this share of the time, as a divisor.
const BUSY_DIVISOR: u64 = 20;

/// A clock tick of processor time.
const NANOS_PER_TICK: u64 = 10_000_000;

/// The last progress of one stage.
#[derive(Clone, Copy, Debug)]
struct Progress {
    done: Frame,
    /// When it was noticed, on the host's clock.
    nanos: u64,
    /// Processor time that the stage had used then, in clock ticks.
    processor_ticks: u64,
}

/// The last progress of every stage.
#[derive(Debug, Default)]
pub(crate) struct StageProgress(BTreeMap<usize, Progress>);

impl StageProgress {
    /// Returns whether the stage of a slot, whose work is done up to `done`, is stalled: it has
    /// finished no frame for `deadline_nanos` although there are newer ones, and uses no processor;
    /// after several deadlines, whether it uses one or not.
    pub(crate) fn is_stalled(
        &mut self,
        slot: usize,
        (done, newest): (Frame, Frame),
        (now, deadline_nanos): (u64, u64),
        processor_ticks: impl FnOnce() -> u64,
    ) -> bool {
        if let Some(last) = self.0.get(&slot).copied() {
            let waited = now.saturating_sub(last.nanos);
            let is_waiting = last.done == done && done < newest;
            // To read the processor time takes longer than a frame may.
            if waited < if is_waiting { deadline_nanos } else { deadline_nanos / 4 } {
                return false;
            }
            if is_waiting {
                let used = processor_ticks().saturating_sub(last.processor_ticks);
                let is_busy = used * NANOS_PER_TICK > waited / BUSY_DIVISOR;
                return !is_busy || waited >= BUSY_DEADLINES * deadline_nanos;
            }
        }
        let progress = Progress { done, nanos: now, processor_ticks: processor_ticks() };
        self.0.insert(slot, progress);
        false
    }

    /// Forgets a stage that has ended or was told to.
    pub(crate) fn forget(&mut self, slot: usize) {
        self.0.remove(&slot);
    }

    /// Forgets all stages, in synchronous mode.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reports a stage at `done` of 100 frames each second, with `ticks` of processor time more each
    /// second, and returns the second in which it is found stalled. The deadline is 10 s.
    fn stalled_after(newest: u64, ticks: u64) -> Option<u64> {
        let mut progress = StageProgress::default();
        (0..100).find(|second| {
            let times = (second * 1_000_000_000, 10_000_000_000);
            progress.is_stalled(1, (Frame(5), Frame(newest)), times, || second * ticks)
        })
    }

    #[test]
    fn an_idle_stage_is_stalled_after_the_deadline_and_a_busy_one_after_six() {
        assert_eq!(stalled_after(9, 0), Some(10));
        assert_eq!(stalled_after(9, 100), Some(60));
    }

    #[test]
    fn a_stage_that_has_done_the_newest_frame_is_not_stalled() {
        assert_eq!(stalled_after(5, 0), None);
    }

    #[test]
    fn a_stage_that_finishes_a_frame_now_and_then_is_not_stalled() {
        let mut progress = StageProgress::default();
        for second in 0..100 {
            let times = (second * 1_000_000_000, 10_000_000_000);
            let frames = (Frame(second / 6), Frame(1000));
            assert!(!progress.is_stalled(1, frames, times, || 0), "second {second}");
        }
    }
}
