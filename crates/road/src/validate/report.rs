//! Findings about a map.

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The file contradicts itself, or describes something that cannot be driven on.
    Error,
    /// It can be driven on, but probably not as intended.
    Warning,
}

/// One inconsistency in a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Line of the text, counted from 1.
    pub line: usize,
    /// Severity of the finding.
    pub severity: Severity,
    /// What is wrong there.
    pub reason: String,
}

impl Severity {
    /// Returns the severity as a word.
    pub fn text(self) -> &'static str {
        match self {
            Severity::Error => "error",
            Severity::Warning => "warning",
        }
    }
}

/// Findings with their byte offsets in the text.
#[derive(Default)]
pub(super) struct Report {
    found: Vec<(usize, Severity, String)>,
}

impl Report {
    pub(super) fn error(&mut self, offset: usize, reason: String) {
        self.found.push((offset, Severity::Error, reason));
    }

    pub(super) fn warn(&mut self, offset: usize, reason: String) {
        self.found.push((offset, Severity::Warning, reason));
    }

    /// Returns the findings with line numbers.
    pub(super) fn with_lines(mut self, text: &str) -> Vec<Finding> {
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
