//! Stages that live but make no progress are started again.

use bus::{SlotState, clock, process};

use super::Shell;

impl Shell {
    /// Kills the stages of `mask`, so that they are started again. Returns whether there was one.
    pub(crate) fn restart_stalled(&mut self, mask: u64) -> bool {
        let slots: Vec<usize> = self.roles.keys().copied().collect();
        let stalled = slots.into_iter().filter(|slot| mask & (1 << slot) != 0);
        let killed: Vec<bool> = stalled.map(|slot| self.kill_stalled(slot)).collect();
        killed.contains(&true)
    }

    fn kill_stalled(&mut self, slot: usize) -> bool {
        let is_killed = self.config.restart && self.supervisor.kill(slot);
        let action = if is_killed {
            "it is killed"
        } else if self.config.restart {
            "it is a thread, which cannot be killed; end this process"
        } else {
            "--no-restart leaves it as it is"
        };
        log::warn!(
            "{} {} has made no progress for {:.1} s; {action}",
            self.barrier.frame().0,
            self.barrier.names(1 << slot),
            self.config.deadline_nanos.unwrap_or(0) as f64 / 1e9,
        );
        is_killed
    }

    /// In asynchronous mode: kills stages that have stalled.
    pub(crate) fn restart_without_progress(&mut self) {
        let Some(deadline) = self.config.deadline_nanos else { return };
        if self.settings.synchronous != 0 {
            self.progress.clear();
            return;
        }
        let (now, newest) = (clock::now_nanos(), self.barrier.frame());
        let slots: Vec<usize> = self.roles.keys().copied().collect();
        for slot in slots {
            let words = self.control.slot(slot);
            let pid = words.pid();
            let ticks = || process::processor_ticks(pid).unwrap_or(0);
            if words.state() == SlotState::Live
                && self.progress.is_stalled(slot, (words.ack(), newest), (now, deadline), ticks)
            {
                self.progress.forget(slot);
                self.kill_stalled(slot);
            }
        }
    }
}
