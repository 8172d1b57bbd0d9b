//! Validation: everything in a map that is inconsistent, for authors of maps.
//!
//! The network under validation is the one that simulations use. Positions in the text come from a
//! second reading, so that a simulation does not pay for them.

mod geometry;
mod links;
mod positions;
mod report;
mod subject;
mod words;

use crate::{MapError, build::built};
use positions::Positions;
use report::Report;
use subject::Subject;

pub use report::{Finding, Severity};

/// Returns every inconsistency in an OpenDRIVE text, by line.
///
/// # Errors
///
/// Returns the error that makes the text unusable as a map.
pub fn validate(xml: &str) -> Result<Vec<Finding>, MapError> {
    let mut network = built(xml, usize::MAX, 1)?;
    let unresolved = std::mem::take(&mut network.findings);
    let mut report = Report::default();
    let mut unreadable = None;
    match Positions::read(xml, &mut report) {
        Ok(positions) => {
            let subject = Subject { network: &network, positions: &positions };
            subject.geometry(&mut report);
            subject.joints(&mut report);
            subject.links(&mut report);
        }
        // In a part of the file that a simulation does not read.
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
