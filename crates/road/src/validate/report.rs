//! Findings about a map.

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

/// Findings by their places in the text.
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

    /// The findings with lines for bytes.
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
