//! A figure: what was measured, its spread, and the peer's value in the same run.

use std::{fmt, fs::File, io::Write, path::Path};

use anyhow::Context;
use serde_json::json;

use crate::machine::Machine;

/// Another program that did the same, on the same machine, in the same run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Peer {
    pub(crate) name: &'static str,
    /// The value, in the figure's unit.
    pub(crate) value: f64,
}

/// One line of the results.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Figure {
    /// The name, which never changes.
    pub(crate) name: &'static str,
    /// The workload, with its sizes.
    pub(crate) workload: String,
    /// The unit of all numbers here.
    pub(crate) unit: Unit,
    /// The value: the median over the rounds.
    pub(crate) value: f64,
    /// The spread of single measurements.
    pub(crate) spread: Spread,
    pub(crate) peer: Option<Peer>,
}

/// The unit of a figure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Lower is better.
    Micros,
    /// Lower is better.
    Millis,
    /// Lower is better.
    MegabytesAnHour,
    /// Higher is better.
    TimesRealTime,
    /// Higher is better.
    PerSecond(&'static str),
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Unit::Micros => f.write_str("us"),
            Unit::Millis => f.write_str("ms"),
            Unit::MegabytesAnHour => f.write_str("MB/h"),
            Unit::TimesRealTime => f.write_str("x real time"),
            Unit::PerSecond(what) => write!(f, "{what}/s"),
        }
    }
}

/// Percentiles of single measurements. For a rate, the values that 50, 90 and 99 % reach.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spread {
    pub(crate) p50: f64,
    pub(crate) p90: f64,
    pub(crate) p99: f64,
    /// The number of measurements over all rounds.
    pub(crate) n: usize,
}

impl Spread {
    /// Returns the percentiles of rounds of nanoseconds, in units of `scale_nanos`; each is the
    /// median over the rounds.
    pub(crate) fn of_rounds(rounds: &[Vec<u64>], scale_nanos: f64) -> Spread {
        let at = |share: f64| {
            let of_round = |round: &Vec<u64>| percentile(round, share) / scale_nanos;
            median(&rounds.iter().filter(|r| !r.is_empty()).map(of_round).collect::<Vec<_>>())
        };
        let n = rounds.iter().map(Vec::len).sum();
        Spread { p50: at(0.5), p90: at(0.9), p99: at(0.99), n }
    }

    /// Converts times to rates: `amount` of something in each.
    pub(crate) fn as_rates(self, amount: f64) -> Spread {
        let rate = |time: f64| if time > 0.0 { amount / time } else { 0.0 };
        Spread { p50: rate(self.p50), p90: rate(self.p90), p99: rate(self.p99), n: self.n }
    }
}

/// Returns the measured time that the fraction `share` of all did not exceed.
fn percentile(nanos: &[u64], share: f64) -> f64 {
    let mut sorted = nanos.to_vec();
    sorted.sort_unstable();
    let index = (sorted.len() as f64 * share).ceil() as usize;
    sorted[index.clamp(1, sorted.len()) - 1] as f64
}

/// Returns the median; 0 for no values.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        len if len % 2 == 1 => sorted[len / 2],
        len => (sorted[len / 2 - 1] + sorted[len / 2]) * 0.5,
    }
}

impl Figure {
    /// Returns how many times better the figure is than its peer.
    fn ratio(&self) -> Option<f64> {
        let peer = self.peer.as_ref()?.value;
        let (more, less) = match self.unit {
            Unit::Micros | Unit::Millis | Unit::MegabytesAnHour => (peer, self.value),
            Unit::TimesRealTime | Unit::PerSecond(_) => (self.value, peer),
        };
        (less > 0.0).then(|| more / less)
    }

    fn json(&self, machine: &Machine) -> serde_json::Value {
        let peer = self.peer.as_ref().map(|p| json!({ "name": p.name, "value": round(p.value) }));
        json!({
            "name": self.name,
            "workload": self.workload,
            "value": round(self.value),
            "unit": self.unit.to_string(),
            "p50": round(self.spread.p50),
            "p90": round(self.spread.p90),
            "p99": round(self.spread.p99),
            "n": self.spread.n,
            "peer": peer,
            "ratio": self.ratio().map(round),
            "commit": machine.commit,
            "machine": machine.json(),
        })
    }
}

/// `tick.processes: 4.9 us (p50 4.9, p90 5.4, p99 9.1, n 100000), 41 x loopback TCP (203 us): …`.
impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Spread { p50, p90, p99, n } = self.spread;
        let [value, p50, p90, p99] = [self.value, p50, p90, p99].map(brief);
        write!(f, "{}: {value} {} (p50 {p50}, p90 {p90}, p99 {p99}, n {n})", self.name, self.unit)?;
        if let (Some(peer), Some(ratio)) = (&self.peer, self.ratio()) {
            write!(f, ", {} x {} ({} {})", brief(ratio), peer.name, brief(peer.value), self.unit)?;
        }
        write!(f, ": {}", self.workload)
    }
}

/// Formats a number with three digits.
pub(crate) fn brief(value: f64) -> String {
    match value.abs() {
        size if size >= 100.0 => format!("{value:.0}"),
        size if size >= 10.0 => format!("{value:.1}"),
        size if size >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.3}"),
    }
}

/// Rounds to six digits, more than a clock resolves.
fn round(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let scale = 10f64.powi(5 - value.abs().log10().floor() as i32);
    (value * scale).round() / scale
}

/// Where figures are written.
pub(crate) struct Sink {
    file: Option<File>,
}

impl Sink {
    /// Opens standard output, and a new file if one is named.
    pub(crate) fn open(json: Option<&Path>) -> anyhow::Result<Sink> {
        let open = |path: &Path| {
            if let Some(dir) = path.parent() {
                std::fs::create_dir_all(dir)
                    .with_context(|| format!("--json {}", path.display()))?;
            }
            File::create(path).with_context(|| format!("--json {}", path.display()))
        };
        Ok(Sink { file: json.map(open).transpose()? })
    }

    /// Writes a figure. `machine` was sampled before the measurement.
    pub(crate) fn put(&mut self, figure: &Figure, machine: &Machine) -> anyhow::Result<()> {
        println!("{figure}");
        if let Some(file) = &mut self.file {
            writeln!(file, "{}", figure.json(machine)).context("--json")?;
        }
        Ok(())
    }

    /// Reports why a figure is missing.
    pub(crate) fn skip(&mut self, name: &str, why: &str) {
        println!("{name}: {why}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(unit: Unit, value: f64, peer: f64) -> Figure {
        Figure {
            name: "some.thing",
            workload: "nothing".to_owned(),
            unit,
            value,
            spread: Spread::default(),
            peer: Some(Peer { name: "loopback TCP", value: peer }),
        }
    }

    #[test]
    fn a_ratio_is_how_many_times_better() {
        assert_eq!(figure(Unit::Micros, 2.0, 100.0).ratio(), Some(50.0));
        assert_eq!(figure(Unit::PerSecond("images"), 2.0, 100.0).ratio(), Some(0.02));
        assert_eq!(figure(Unit::Millis, 0.0, 100.0).ratio(), None);
    }

    #[test]
    fn a_percentile_is_a_measured_time_and_the_median_over_the_rounds() {
        let round = |shift: u64| (1..=100).rev().map(|n| n * 1000 + shift).collect::<Vec<_>>();
        let spread = Spread::of_rounds(&[round(0), round(900_000), round(1)], 1000.0);
        assert_eq!([spread.p50, spread.p90, spread.p99], [50.001, 90.001, 99.001]);
        assert_eq!(spread.n, 300);
        assert_eq!(spread.as_rates(100.002).p50, 2.0);
    }

    #[test]
    fn rounding_keeps_six_digits() {
        assert_eq!(round(0.001_234_567_8), 0.001_234_57);
        assert_eq!(round(1_234_567.8), 1_234_570.0);
    }
}
