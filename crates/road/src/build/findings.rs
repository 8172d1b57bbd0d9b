use crate::{MapError, xml::line_of};

/// Contradictions that do not make a map unusable, with their byte offsets in the text.
pub(super) struct Findings {
    most: usize,
    found: Vec<(usize, String)>,
}

impl Findings {
    /// Creates an empty list that keeps the first `most` findings.
    pub(super) fn new(most: usize) -> Findings {
        Findings { most, found: Vec::new() }
    }

    pub(super) fn add(&mut self, offset: usize, reason: String) {
        if self.found.len() < self.most {
            self.found.push((offset, reason));
        }
    }

    /// Returns the findings with line numbers, in the order of the file.
    pub(super) fn with_lines(mut self, text: &str) -> Vec<MapError> {
        self.found.sort();
        let (mut line, mut counted) = (1, 0);
        let of = |(offset, reason): (usize, String)| {
            line += line_of(&text[counted..], offset - counted) - 1;
            counted = offset;
            MapError { line, reason }
        };
        self.found.into_iter().map(of).collect()
    }
}
