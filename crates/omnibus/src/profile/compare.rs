//! Compares two results, part by part.
//!
//! The effect is the ratio of the medians, with a confidence interval instead of a test, as Kalibera
//! and Jones recommend ("Rigorous Benchmarking in Reasonable Time", ISMM 2013). The interval is that
//! of the moving-block bootstrap (Künsch, "The Jackknife and the Bootstrap for General Stationary
//! Observations", Annals of Statistics 17, 1989), because the times of successive frames depend on
//! each other; blocks have the square root of the number of frames.

use std::path::Path;

use anyhow::{Context, ensure};
use mesh::RandomStream;
use serde_json::{Value, json};

/// Resamples of each side.
const RESAMPLES: usize = 1000;
/// Confidence of an interval.
const CONFIDENCE: f64 = 0.99;
/// Samples of a part below which nothing is said.
const SAMPLES_MIN: usize = 20;
/// A smaller change of the median is not shown: where a run lies in memory changes as much.
const EFFECT_MIN: f64 = 0.01;

/// What is said of one part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Faster,
    Slower,
    NoDifferenceShown,
    TooFewSamples,
}

impl Verdict {
    fn text(self) -> &'static str {
        match self {
            Verdict::Faster => "faster",
            Verdict::Slower => "slower",
            Verdict::NoDifferenceShown => "no difference shown",
            Verdict::TooFewSamples => "too few samples",
        }
    }
}

/// One part of both results.
struct Part {
    name: String,
    medians_ms: [f64; 2],
    /// The second median divided by the first.
    ratio: f64,
    interval: [f64; 2],
    verdict: Verdict,
}

/// The comparison of two results.
pub(crate) struct Comparison {
    parts: Vec<Part>,
}

impl Comparison {
    /// Reads two results of `omnibus profile --output` or `--json`.
    pub(crate) fn of_files(first: &Path, second: &Path) -> anyhow::Result<Comparison> {
        let [a, b] = [read(first)?, read(second)?];
        ensure!(
            subject(&a) == subject(&b),
            "{} measures {}, {} measures {}; compare results of the same kind",
            first.display(),
            subject(&a),
            second.display(),
            subject(&b),
        );
        let mut parts = Vec::new();
        for (name, part) in parts_of(&a, first)? {
            let Some(other) = b["parts"].get(name) else { continue };
            parts.push(Part::of(name, &samples(part, first)?, &samples(other, second)?));
        }
        ensure!(
            !parts.is_empty(),
            "{} and {} have no part in common",
            first.display(),
            second.display()
        );
        Ok(Comparison { parts })
    }

    pub(crate) fn text(&self) -> String {
        let mut text =
            "milliseconds, p50         first     second    ratio      99 % interval  verdict\n"
                .to_owned();
        for part in &self.parts {
            let [a, b] = part.medians_ms;
            let [low, high] = part.interval;
            text.push_str(&format!(
                "{:<20} {a:>10.3} {b:>10.3} {:>8.3}   {low:>7.3} to {high:<7.3}  {}\n",
                part.name,
                part.ratio,
                part.verdict.text()
            ));
        }
        text + &self.sentence()
    }

    /// One sentence over all parts.
    fn sentence(&self) -> String {
        let named = |verdict: Verdict| -> Vec<String> {
            let parts = self.parts.iter().filter(|part| part.verdict == verdict);
            parts
                .map(|part| {
                    let percent = (part.ratio - 1.0) * 100.0;
                    format!("{} ({percent:+.1} %)", part.name.trim())
                })
                .collect()
        };
        let [faster, slower] = [named(Verdict::Faster), named(Verdict::Slower)];
        match (faster.is_empty(), slower.is_empty()) {
            (true, true) => "No difference shown in any part.".to_owned(),
            (false, true) => format!("The second run is faster in {}.", faster.join(", ")),
            (true, false) => format!("The second run is slower in {}.", slower.join(", ")),
            (false, false) => format!(
                "The second run is faster in {}, and slower in {}.",
                faster.join(", "),
                slower.join(", ")
            ),
        }
    }

    pub(crate) fn json(&self) -> Value {
        let parts: Vec<Value> = self
            .parts
            .iter()
            .map(|part| {
                json!({ "part": part.name, "p50_ms": part.medians_ms, "ratio": part.ratio,
                    "interval": part.interval, "confidence": CONFIDENCE,
                    "verdict": part.verdict.text() })
            })
            .collect();
        json!({ "parts": parts, "sentence": self.sentence() })
    }
}

fn read(path: &Path) -> anyhow::Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| {
        format!("{} is not a result of `omnibus profile --output`", path.display())
    })
}

/// What a result measures.
fn subject(result: &Value) -> String {
    match result["stage"].as_str() {
        Some(stage) => format!("{stage} alone"),
        None => "a whole simulator".to_owned(),
    }
}

fn parts_of<'a>(
    result: &'a Value,
    path: &Path,
) -> anyhow::Result<impl Iterator<Item = (&'a String, &'a Value)>> {
    let parts = result["parts"].as_object().with_context(|| {
        format!("{} has no \"parts\"; it is not a result of `omnibus profile`", path.display())
    })?;
    Ok(parts.iter())
}

fn samples(part: &Value, path: &Path) -> anyhow::Result<Vec<f64>> {
    let list = part["samples_nanos"].as_array();
    let numbers = list.and_then(|list| list.iter().map(Value::as_f64).collect());
    numbers.with_context(|| format!("{}: a part has no \"samples_nanos\"", path.display()))
}

impl Part {
    fn of(name: &str, a: &[f64], b: &[f64]) -> Part {
        let medians_ms = [a, b].map(|side| median(&mut side.to_vec()) / 1e6);
        let ratio = medians_ms[1] / medians_ms[0];
        let mut part = Part {
            name: name.to_owned(),
            medians_ms,
            ratio,
            interval: [f64::NAN; 2],
            verdict: Verdict::TooFewSamples,
        };
        if a.len() < SAMPLES_MIN || b.len() < SAMPLES_MIN || medians_ms[0] <= 0.0 {
            return part;
        }
        let resampled = [resampled_medians(a, 1), resampled_medians(b, 2)];
        let mut ratios: Vec<f64> =
            resampled[0].iter().zip(&resampled[1]).map(|(a, b)| b / a).collect();
        ratios.sort_by(f64::total_cmp);
        let at = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
        let tail = (1.0 - CONFIDENCE) / 2.0;
        part.interval = [at(tail), at(1.0 - tail)];
        let [low, high] = part.interval;
        part.verdict = match ratio {
            ratio if low > 1.0 && ratio > 1.0 + EFFECT_MIN => Verdict::Slower,
            ratio if high < 1.0 && ratio < 1.0 - EFFECT_MIN => Verdict::Faster,
            _ => Verdict::NoDifferenceShown,
        };
        part
    }
}

/// Medians of resamples, each made of blocks of successive samples that begin at random.
fn resampled_medians(samples: &[f64], seed: u64) -> Vec<f64> {
    let mut random = RandomStream::from_state(seed);
    let block = (samples.len() as f64).sqrt().ceil() as usize;
    let mut resample = Vec::with_capacity(samples.len() + block);
    let mut medians = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        resample.clear();
        while resample.len() < samples.len() {
            let begin = random.below(samples.len() - block + 1);
            resample.extend_from_slice(&samples[begin..begin + block]);
        }
        resample.truncate(samples.len());
        medians.push(median(&mut resample));
    }
    medians
}

fn median(samples: &mut [f64]) -> f64 {
    let middle = samples.len() / 2;
    if samples.is_empty() {
        return 0.0;
    }
    *samples.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of a run whose frames depend on each other, around 10 ms.
    fn run(seed: u64, scale: f64) -> Vec<f64> {
        let mut random = RandomStream::from_state(seed);
        let mut drift = 0.0;
        let mut next = || {
            drift = 0.7 * drift + random.below(2001) as f64 / 1000.0 - 1.0;
            scale * (10.0 + 0.2 * drift) * 1e6
        };
        (0..400).map(|_| next()).collect()
    }

    #[test]
    fn a_run_equals_itself_and_not_one_that_is_a_fifth_slower() {
        let verdict = |a: &[f64], b: &[f64]| Part::of("frame", a, b).verdict;
        let first = run(1, 1.0);
        assert_eq!(verdict(&first, &first), Verdict::NoDifferenceShown);
        assert_eq!(verdict(&first, &run(1, 1.2)), Verdict::Slower);
        assert_eq!(verdict(&first, &run(2, 1.2)), Verdict::Slower);
        assert_eq!(verdict(&run(2, 1.2), &first), Verdict::Faster);
        assert_eq!(verdict(&first[..10], &first), Verdict::TooFewSamples);
    }

    #[test]
    fn runs_of_the_same_program_are_rarely_called_different() {
        let wrong = (0..40)
            .filter(|seed| {
                let part = Part::of("frame", &run(100 + seed, 1.0), &run(200 + seed, 1.0));
                part.verdict != Verdict::NoDifferenceShown
            })
            .count();
        assert!(wrong <= 1, "{wrong} of 40 pairs of equal runs are called different");
    }
}
