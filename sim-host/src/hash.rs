//! The state hash: 64 bits over everything that decides the future.

/// Takes words in, in a fixed order. Not for secrets: for telling two runs apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StateHash(u64);

impl StateHash {
    /// An empty one.
    pub(crate) fn new() -> StateHash {
        StateHash(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in one word.
    pub(crate) fn word(&mut self, word: u64) {
        let mixed = (self.0.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 29);
    }

    /// Takes in bytes, and how many they are.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        for word in words {
            self.word(u64::from_le_bytes(*word));
        }
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
        self.word(bytes.len() as u64);
    }

    /// The hash so far.
    pub(crate) fn value(&self) -> u64 {
        self.0
    }
}

impl Default for StateHash {
    fn default() -> Self {
        StateHash::new()
    }
}
