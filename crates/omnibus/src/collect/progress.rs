//! What a person sees while it runs: one line that is drawn anew, or a line now and then.

use std::io::{IsTerminal, Write, stderr};

use bus::clock;

use crate::collect::stages::Stages;

const REDRAW_NANOS: u64 = 100_000_000;
const LINE_INTERVAL_NANOS: u64 = 5_000_000_000;
const BAR: u64 = 24;

/// The bar on standard error.
pub(crate) struct Progress {
    is_terminal: bool,
    last_nanos: u64,
}

impl Progress {
    /// Nothing is drawn yet.
    pub(crate) fn new() -> Progress {
        Progress { is_terminal: stderr().is_terminal(), last_nanos: clock::now_nanos() }
    }

    /// Shows that `done` of `wanted` frames are complete, if it is time to. `stages` are of this
    /// run alone.
    pub(crate) fn show(&mut self, done: u64, wanted: u64, stages: &Stages) {
        if self.is_time() {
            self.draw(&line(done, wanted, stages));
        }
    }

    /// Shows how far a resumed run is on the way to where it stopped, if it is time to.
    pub(crate) fn show_resume(&mut self, frame: u64, to: u64) {
        if self.is_time() {
            self.draw(&format!("simulating up to where it stopped: frame {frame} of {to}"));
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
        // Back to the line's begin, and wipe what is left of the last one.
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
    fn the_line_says_how_far_how_fast_and_how_long_still() {
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
    fn before_the_first_frame_there_is_a_line_too() {
        assert!(line(0, 300, &Stages::default()).contains("0/300 frames, 0.0 frames/s"));
    }
}
