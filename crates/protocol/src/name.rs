use std::fmt;

use bytemuck::{Pod, Zeroable};

/// A short UTF-8 text of at most 40 bytes, padded with zeros.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable)]
#[repr(C)]
pub struct Name(pub [u8; 40]);

impl Name {
    /// The first 40 bytes of `text`, cut at a character boundary.
    pub fn new(text: &str) -> Name {
        let mut bytes = [0; 40];
        let mut end = text.len().min(40);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Name(bytes)
    }

    /// The text; empty if the bytes are not UTF-8.
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|&b| b == 0).unwrap_or(40);
        std::str::from_utf8(&self.0[..end]).unwrap_or("")
    }
}

impl Default for Name {
    fn default() -> Name {
        Name([0; 40])
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.as_str())
    }
}
