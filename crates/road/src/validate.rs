//! What does not fit together in a map: everything that a drawer of maps would like to be told.
//!
//! The network that is judged is the one that everybody drives on. Where its parts stand in the
//! text comes from a second reading, so that those who only drive do not pay for it.

mod geometry;
mod links;
mod places;
mod report;
mod subject;
mod words;

use crate::{MapError, build::built};
use places::Places;
use report::Report;
use subject::Judged;

pub use report::{Finding, Severity};

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
