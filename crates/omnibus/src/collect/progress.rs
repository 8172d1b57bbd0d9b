//! The progress of a run on standard error: one line that is redrawn, or a line every few seconds.

use std::io::{IsTerminal, Write, stderr};

use bus::clock;

use crate::collect::stages::Stages;

const REDRAW_NANOS: u64 = 100_000_000;
const LINE_INTERVAL_NANOS: u64 = 5_000_000_000;
const BAR: u64 = 24;

/// The progress bar on standard error.
pub(crate) struct Progress {
    is_terminal: bool,
    last_nanos: u64,
}

impl Progress {
    /// Starts without drawing.
    pub(crate) fn new() -> Progress {
        Progress { is_terminal: stderr().is_terminal(), last_nanos: clock::now_nanos() }
    }

    /// Redraws the bar if it is time: `done` of `wanted` frames are complete. `stages` is of this
    /// run alone.
    pub(crate) fn show(&mut self, done: u64, wanted: u64, stages: &Stages) {
        if self.is_time() {
            self.draw(&line(done, wanted, stages));
        }
    }

    /// Redraws how far a resumed run is from the frame where it stopped, if it is time.
    pub(crate) fn show_resume(&mut self, frame: u64, to: u64) {
        if self.is_time() {
            self.draw(&format!("simulating up to the last complete frame: {frame} of {to}"));
        }
    }

    fn is_time(&mut self) -> bool {
        let now = clock::now_nanos();
        let pause = if self.is_terminal { REDRAW_NANOS } else { LINE_INTERVAL_NANOS };
        let is_time = now - self.last_nanos >= pause;
        if is_time {
            self.last_nanos = now;
        }
        is_time
    }

    fn draw(&self, text: &str) {
        // Returns to the start of the line and clears the last text.
        let (begin, end) = if self.is_terminal { ("\r\x1b[K", "") } else { ("", "\n") };
        let _ = write!(stderr(), "{begin}{text}{end}");
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.is_terminal {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

/// `[=====>      ] 123/300 frames, 15.2 frames/s, 12 s left | simulate 4 %, ...`.
fn line(done: u64, wanted: u64, stages: &Stages) -> String {
    let wanted = wanted.max(1);
    let filled = done * BAR / wanted;
    let mut bar = "=".repeat(filled as usize);
    if filled < BAR {
        bar.push('>');
    }
    let rate = stages.rate_hz();
    let left = wanted.saturating_sub(done) as f64 / rate.max(1e-3);
    let width = BAR as usize;
    format!(
        "[{bar:width$}] {done}/{wanted} frames, {rate:.1} frames/s, {left:.0} s left | {stages}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_holds_progress_rate_and_time_left() {
        let stages = Stages { frames: 30, wall_nanos: 2_000_000_000, ..Stages::default() };
        let text = line(75, 300, &stages);
        assert!(
            text.starts_with(
                "[======>                 ] 75/300 frames, 15.0 frames/s, 15 s left |"
            ),
            "{text}"
        );
        assert!(line(300, 300, &stages).starts_with("[========================] 300/300"));
    }

    #[test]
    fn there_is_a_line_before_the_first_frame() {
        assert!(line(0, 300, &Stages::default()).contains("0/300 frames, 0.0 frames/s"));
    }
}
