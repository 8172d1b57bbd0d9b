use std::fmt;

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// A short UTF-8 text of at most 32 bytes, padded with zeros.
#[derive(
    Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Pod, Zeroable, ZeroCopySend,
)]
#[type_name("Name")]
#[repr(C)]
pub struct Name(pub [u8; 32]);

impl Name {
    /// Keeps the first 32 bytes of `text`, cut at a character's edge.
    pub fn new(text: &str) -> Name {
        let mut bytes = [0; 32];
        let mut end = text.len().min(32);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
        Name(bytes)
    }

    /// The text, or an empty one if a stranger wrote something that is not UTF-8.
    pub fn as_str(&self) -> &str {
        let end = self.0.iter().position(|&b| b == 0).unwrap_or(32);
        std::str::from_utf8(&self.0[..end]).unwrap_or("")
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
