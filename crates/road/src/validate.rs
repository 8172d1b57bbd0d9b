//! What does not fit together in a map: everything that a drawer of maps would like to be told.
//!
//! The network that is judged is the one that everybody drives on. Where its parts stand in the
//! text comes from a second reading, so that those who only drive do not pay for it.

mod geometry;
mod links;
mod places;
mod words;

use crate::MapError;
use crate::build::built;
use crate::network::Network;
use places::Places;

/// How much it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The file contradicts itself, or what it says is nothing that could be driven on.
    Error,
    /// It can be driven on, but hardly as it was meant.
    Warning,
}

/// One thing that does not fit together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The line of the text, counted from 1.
    pub line: usize,
    /// How much it matters.
    pub severity: Severity,
    /// What is wrong there.
    pub reason: String,
}

impl Severity {
    /// One word for it.
    pub fn text(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// Everything in an OpenDRIVE text that does not fit together, by line; an error if it is no map
/// at all.
pub fn validate(xml: &str) -> Result<Vec<Finding>, MapError> {
    let mut network = built(xml, usize::MAX, 1)?;
    let unresolved = std::mem::take(&mut network.findings);
    let mut report = Report::default();
    let mut unreadable = None;
    match Places::read(xml, &mut report) {
        Ok(places) => {
            let judged = Judged { network: &network, places: &places };
            judged.geometry(&mut report);
            judged.joints(&mut report);
            judged.links(&mut report);
        }
        // In a part that drivers pass over.
        Err(error) => unreadable = Some(error),
    }
    let mut findings = report.with_lines(xml);
    let unresolved = unresolved.into_iter().chain(unreadable);
    findings.extend(unresolved.map(|MapError { line, reason }| Finding {
        line,
        severity: Severity::Error,
        reason,
    }));
    findings.sort_by(|a, b| (a.line, a.severity, &a.reason).cmp(&(b.line, b.severity, &b.reason)));
    findings.dedup();
    Ok(findings)
}

/// A network and where its parts stand in the text.
struct Judged<'a> {
    network: &'a Network,
    places: &'a Places,
}

/// Findings by their places in the text.
#[derive(Default)]
struct Report {
    found: Vec<(usize, Severity, String)>,
}

impl Report {
    fn error(&mut self, offset: usize, reason: String) {
        self.found.push((offset, Severity::Error, reason));
    }

    fn warn(&mut self, offset: usize, reason: String) {
        self.found.push((offset, Severity::Warning, reason));
    }

    /// The findings with lines for bytes.
    fn with_lines(mut self, text: &str) -> Vec<Finding> {
        self.found.sort_by_key(|found| found.0);
        let (mut line, mut counted) = (1, 0);
        let of = |(offset, severity, reason): (usize, Severity, String)| {
            let offset = offset.clamp(counted, text.len());
            let between = &text.as_bytes()[counted..offset];
            line += between.iter().filter(|byte| **byte == b'\n').count();
            counted = offset;
            Finding { line, severity, reason }
        };
        self.found.into_iter().map(of).collect()
    }
}
