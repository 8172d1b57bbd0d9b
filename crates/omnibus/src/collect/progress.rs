//! The progress of a run: on standard error one line that is redrawn, or a line every few seconds; or
//! lines of JSON on standard output.

use std::io::{IsTerminal, Write, stderr};

use bus::clock;
use serde_json::{Value, json};

use crate::collect::stages::Stages;

const REDRAW_NANOS: u64 = 100_000_000;
const LINE_INTERVAL_NANOS: u64 = 5_000_000_000;
const JSON_INTERVAL_NANOS: u64 = 500_000_000;
const BAR: u64 = 24;

/// The progress bar on standard error, or lines of JSON.
pub(crate) struct Progress {
    is_json: bool,
    is_terminal: bool,
    last_nanos: u64,
}

impl Progress {
    /// Starts without drawing.
    pub(crate) fn new(is_json: bool) -> Progress {
        Progress { is_json, is_terminal: stderr().is_terminal(), last_nanos: clock::now_nanos() }
    }

    /// Shows at once what is done before the first frame.
    pub(crate) fn show_step(&mut self, what: &str) {
        if self.is_json {
            print_json(&json!({ "event": "step", "step": what }));
        } else {
            self.draw(what);
        }
        self.last_nanos = clock::now_nanos();
    }

    /// Redraws the bar if it is time: `done` of `wanted` frames are complete. `stages` is of this
    /// run alone.
    pub(crate) fn show(&mut self, done: u64, wanted: u64, stages: &Stages) {
        if !self.is_time() {
            return;
        }
        if !self.is_json {
            self.draw(&line(done, wanted, stages));
            return;
        }
        let (limiting_stage, percent) = stages.bound();
        print_json(&json!({
            "event": "progress",
            "frames_complete": done,
            "frames": wanted,
            "frames_per_second": stages.rate_hz(),
            "limiting_stage": limiting_stage,
            "limiting_stage_percent": percent,
            "seconds_left": seconds_left(done, wanted, stages),
        }));
    }

    /// Redraws how far the frames before the first that is kept are, if it is time.
    pub(crate) fn show_frames(&mut self, what: &str, frame: u64, to: u64) {
        if !self.is_time() {
            return;
        }
        if self.is_json {
            print_json(&json!({ "event": "step", "step": what, "frame": frame, "to_frame": to }));
        } else {
            self.draw(&format!("{what}: frame {frame} of {to}"));
        }
    }

    /// Shows how far a collection of scenes is: `text`, if it is time.
    pub(crate) fn show_text(&mut self, text: impl FnOnce() -> String) {
        if !self.is_json && self.is_time() {
            self.draw(&text());
        }
    }

    fn is_time(&mut self) -> bool {
        let now = clock::now_nanos();
        let pause = match (self.is_json, self.is_terminal) {
            (true, _) => JSON_INTERVAL_NANOS,
            (false, true) => REDRAW_NANOS,
            (false, false) => LINE_INTERVAL_NANOS,
        };
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
        if self.is_terminal && !self.is_json {
            let _ = write!(stderr(), "\r\x1b[K");
        }
    }
}

/// Prints a line of JSON to standard output at once.
pub(crate) fn print_json(value: &Value) {
    print_line!("{value}");
    let _ = std::io::stdout().flush();
}

fn seconds_left(done: u64, wanted: u64, stages: &Stages) -> f64 {
    wanted.saturating_sub(done) as f64 / stages.rate_hz().max(1e-3)
}

/// `[=====>    ]`, for a share of the work from 0 to 1.
pub(crate) fn bar(share: f64) -> String {
    let filled = (share * BAR as f64) as u64;
    let mut bar = "=".repeat(filled as usize);
    if filled < BAR {
        bar.push('>');
    }
    let width = BAR as usize;
    format!("[{bar:width$}]")
}

/// `[=====>      ] 123/300 frames, 15.2 frames/s, 12 s left | simulate 4 %, ...`.
fn line(done: u64, wanted: u64, stages: &Stages) -> String {
    let bar = bar(done as f64 / wanted.max(1) as f64);
    let (rate, left) = (stages.rate_hz(), seconds_left(done, wanted, stages));
    format!("{bar} {done}/{wanted} frames, {rate:.1} frames/s, {left:.0} s left | {stages}")
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
