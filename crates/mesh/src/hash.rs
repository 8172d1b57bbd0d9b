//! Hash functions that tell two inputs apart. None of them resists an attacker.

use crate::random::GOLDEN_GAMMA;

/// The offset basis of FNV-1a, 64 bits.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
/// The prime of FNV-1a, 64 bits.
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

/// Returns the FNV-1a hash of `bytes`, 64 bits (draft-eastlake-fnv).
pub const fn fnv1a64(bytes: &[u8]) -> u64 {
    let mut hash = Fnv1a64::new();
    hash.write(bytes);
    hash.value()
}

/// FNV-1a with 64 bits, fed piece by piece. Only the order of the bytes counts, not how they are
/// cut into pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv1a64(u64);

impl Fnv1a64 {
    /// The hash of no bytes.
    pub const fn new() -> Fnv1a64 {
        Fnv1a64(FNV_OFFSET)
    }

    /// Appends `bytes` to the input.
    pub const fn write(&mut self, bytes: &[u8]) {
        let mut at = 0;
        while at < bytes.len() {
            self.0 = (self.0 ^ bytes[at] as u64).wrapping_mul(FNV_PRIME);
            at += 1;
        }
    }

    /// Returns the hash of the input so far.
    pub const fn value(&self) -> u64 {
        self.0
    }
}

impl Default for Fnv1a64 {
    fn default() -> Self {
        Fnv1a64::new()
    }
}

/// Folds one word into a hash with one multiplication; 0 may follow any state. The result's low
/// bits are weak: finish with [`WordHash`]'s shift or with [`crate::mix64`].
#[inline]
pub const fn fold_word(state: u64, word: u64) -> u64 {
    (state.rotate_left(5) ^ word).wrapping_mul(GOLDEN_GAMMA)
}

/// Mixes one word into a hash with one multiplication and two shifts, so that every bit of the result
/// depends on the state: half a round of splitmix64 (Steele, Lea, Flood 2014) after an addition.
/// Needs no finish, unlike [`fold_word`].
#[inline]
pub const fn mix_word(state: u64, word: u64) -> u64 {
    let sum = (state ^ word).wrapping_add(GOLDEN_GAMMA);
    let mixed = (sum ^ (sum >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed ^ (mixed >> 32)
}

/// A 64-bit hash over words, one multiplication each: for state of many megabytes per second.
///
/// Each word is folded by [`fold_word`], and the high bits are shifted down after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WordHash(u64);

impl WordHash {
    /// The hash of no words.
    pub const fn new() -> WordHash {
        WordHash(FNV_OFFSET)
    }

    /// Appends one word to the input.
    #[inline]
    pub const fn word(&mut self, word: u64) {
        let mixed = fold_word(self.0, word);
        self.0 = mixed ^ (mixed >> 29);
    }

    /// Appends bytes as little-endian words, then their number, so that inputs of different
    /// lengths differ.
    pub const fn bytes(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<8>();
        let mut at = 0;
        while at < words.len() {
            self.word(u64::from_le_bytes(words[at]));
            at += 1;
        }
        let mut last = [0; 8];
        let (head, _) = last.split_at_mut(rest.len());
        head.copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
        self.word(bytes.len() as u64);
    }

    /// Returns the hash of the input so far.
    pub const fn value(&self) -> u64 {
        self.0
    }
}

impl Default for WordHash {
    fn default() -> Self {
        WordHash::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of the reference implementation.
    #[test]
    fn fnv1a64_agrees_with_its_published_vectors() {
        assert_eq!(fnv1a64(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a64(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a64(b"foobar"), 0x8594_4171_f739_67e8);
        let mut hash = Fnv1a64::new();
        hash.write(b"foo");
        hash.write(b"bar");
        assert_eq!(hash.value(), fnv1a64(b"foobar"));
    }

    /// The values were computed from the definition outside this crate; saved states hold such sums.
    #[test]
    fn mixing_a_word_gives_the_sums_that_saved_states_hold() {
        assert_eq!(mix_word(0, 0), 0xca00_9717_f87d_8879);
        assert_eq!(mix_word(mix_word(0, 1), 2), 0xd1d7_800d_f750_7833);
        assert_ne!(mix_word(mix_word(0, 1), 2), mix_word(mix_word(0, 2), 1));
    }

    #[test]
    fn a_word_hash_separates_order_and_length() {
        let of = |bytes: &[u8]| {
            let mut hash = WordHash::new();
            hash.bytes(bytes);
            hash.value()
        };
        assert_ne!(of(&[]), of(&[0]));
        assert_ne!(of(&[0; 8]), of(&[0; 16]));
        assert_ne!(of(&[1, 2]), of(&[2, 1]));
        assert_eq!(of(b"0123456789"), of(b"0123456789"));
    }
}
