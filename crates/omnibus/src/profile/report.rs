//! The result of a profile, as text and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::{
    limit::Limit,
    live::LiveRun,
    spans::{PARTS, lengths},
};
use crate::stage::percentile::percentile_ms;

/// The lengths of one part of a frame, in nanoseconds, in the order of frames.
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) nanos: Vec<u64>,
}

impl Series {
    /// Percentiles 50, 90, 99 and 100, in milliseconds; zeros without a sample.
    pub(crate) fn percentiles_ms(&self) -> [f64; 4] {
        if self.nanos.is_empty() {
            return [0.0; 4];
        }
        let mut sorted = self.nanos.clone();
        sorted.sort_unstable();
        [0.5, 0.9, 0.99, 1.0].map(|share| percentile_ms(&sorted, share))
    }

    pub(crate) fn json(&self) -> Value {
        let [p50, p90, p99, max] = self.percentiles_ms();
        json!({ "n": self.nanos.len(), "p50_ms": p50, "p90_ms": p90, "p99_ms": p99, "max_ms": max,
            "samples_nanos": self.nanos })
    }

    /// A line of a table.
    pub(crate) fn line(&self, indent: &str) -> String {
        let [p50, p90, p99, max] = self.percentiles_ms();
        format!(
            "{:<20} {:>6} {p50:>10.3} {p90:>10.3} {p99:>10.3} {max:>10.3}\n",
            format!("{indent}{}", self.name),
            self.nanos.len()
        )
    }
}

/// The head of a table of [`Series::line`]s.
pub(crate) const HEAD: &str =
    "milliseconds              n        p50        p90        p99    longest\n";

/// What a profile of a simulator has found.
pub(crate) struct Report<'a> {
    run: &'a LiveRun,
    series: Vec<Series>,
    limit: Option<Limit>,
}

impl Report<'_> {
    pub(crate) fn of(run: &LiveRun) -> Report<'_> {
        let series = PARTS
            .iter()
            .map(|part| Series { name: part.name.to_owned(), nanos: lengths(part, &run.clocks) })
            .filter(|series| !series.nanos.is_empty())
            .collect();
        Report { run, series, limit: Limit::of(&run.clocks, &run.settings) }
    }

    fn mode(&self) -> String {
        match (self.run.settings.synchronous, self.run.settings.pipeline) {
            (0, _) => "asynchronous".to_owned(),
            (_, 0) => "synchronous".to_owned(),
            (_, frames) => format!("synchronous, pipelined by {frames}"),
        }
    }

    pub(crate) fn text(&self) -> String {
        let run = self.run;
        let mut text = format!("{}, {}, {} frames", run.map, self.mode(), run.clocks.len());
        if run.skipped > 0 {
            let _ = write!(text, " ({} more were too short to be read)", run.skipped);
        }
        text.push('\n');
        text.push_str(HEAD);
        for series in &self.series {
            text.push_str(&series.line(""));
        }
        let queues = run.queues_max;
        let behind: Vec<String> = run
            .behind_max
            .iter()
            .filter(|(role, _)| matches!(role, bus::Role::Traffic | bus::Role::Render))
            .map(|(role, most)| format!("{} {most} frames behind", role.name()))
            .collect();
        let _ = writeln!(
            text,
            "queues, at most: {} batches of commands, {} parts of the journal, {} recorded frames; {}",
            queues.commands,
            queues.journal_parts,
            queues.recorded_frames,
            behind.join(", "),
        );
        let missed: u64 = run.members.iter().map(|member| member.missed).sum();
        let _ = writeln!(text, "frames that a participant never received: {missed}");
        let limit = self.limit.as_ref();
        text + &limit.map_or_else(
            || "Too few frames are complete to name the stage that limits them.".to_owned(),
            Limit::sentence,
        )
    }

    pub(crate) fn json(&self) -> Value {
        let run = self.run;
        let parts: serde_json::Map<String, Value> =
            self.series.iter().map(|series| (series.name.clone(), series.json())).collect();
        let members: Vec<Value> = run
            .members
            .iter()
            .map(|member| {
                json!({ "role": member.role.name(), "name": member.name, "process": member.pid,
                    "missed": member.missed })
            })
            .collect();
        let behind: serde_json::Map<String, Value> = run
            .behind_max
            .iter()
            .map(|(role, most)| (role.name().to_owned(), (*most).into()))
            .collect();
        let limit = self.limit.as_ref().map(|limit| {
            json!({ "stage": limit.stage.name(), "share": limit.share,
                "frames_per_s_at_double_speed": limit.rate_at_double_speed_hz,
                "sentence": limit.sentence() })
        });
        json!({
            "kind": "live",
            "omnibus_version": env!("CARGO_PKG_VERSION"),
            "map": run.map,
            "mode": self.mode(),
            "n": run.clocks.len(),
            "skipped": run.skipped,
            "frames_per_s": self.limit.as_ref().map(|limit| limit.rate_hz),
            "participants": members,
            "parts": parts,
            "queues_max": { "commands": run.queues_max.commands,
                "journal_parts": run.queues_max.journal_parts,
                "recorded_frames": run.queues_max.recorded_frames, "frames_behind": behind },
            "limit": limit,
        })
    }
}
