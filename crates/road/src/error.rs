use thiserror::Error;

/// Why a text cannot be used as a road network.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("line {line}: {reason}")]
pub struct MapError {
    /// Line of the text, counted from 1.
    pub line: usize,
    /// What is wrong there, and what to try.
    pub reason: String,
}
