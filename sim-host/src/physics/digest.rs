//! The digest of a physics state. It tells states apart; it does not resist an attacker.

use glam::Vec3;
use mesh::mix_word;
use postcard::ser_flavors::Flavor;
use serde::Serialize;

/// A digest over words ([`mesh::mix_word`]).
#[derive(Default)]
pub(super) struct Digest {
    sum: u64,
    /// The bytes of an incomplete word, and their number.
    partial: u64,
    bytes: u32,
}

impl Digest {
    /// Returns the digest of the input so far.
    pub(super) fn sum(&self) -> u64 {
        self.sum
    }

    /// Appends one word.
    #[inline]
    pub(super) fn word(&mut self, word: u64) {
        self.sum = mix_word(self.sum, word);
    }

    /// Appends two half words as one word.
    #[inline]
    pub(super) fn pair(&mut self, low: u32, high: u32) {
        self.word(u64::from(low) | u64::from(high) << 32);
    }

    /// Appends the bits of a vector.
    #[inline]
    pub(super) fn vector(&mut self, v: Vec3) {
        self.pair(v.x.to_bits(), v.y.to_bits());
        self.word(u64::from(v.z.to_bits()));
    }

    /// Appends every field of a value that is saved, in the order of its serialisation.
    pub(super) fn all_of(&mut self, value: &impl Serialize) {
        postcard::serialize_with_flavor(value, Bytes(self))
            .expect("serialising into a digest cannot fail");
        let (partial, bytes) = (self.partial, self.bytes);
        (self.partial, self.bytes) = (0, 0);
        self.word(partial ^ u64::from(bytes) << 56);
    }
}

/// Returns the digest of bytes.
pub(super) fn digest(bytes: &[u8]) -> u64 {
    let mut digest = Digest::default();
    let (words, rest) = bytes.as_chunks::<8>();
    for word in words {
        digest.word(u64::from_le_bytes(*word));
    }
    for byte in rest {
        digest.word(u64::from(*byte));
    }
    digest.sum
}

struct Bytes<'a>(&'a mut Digest);

impl Flavor for Bytes<'_> {
    type Output = ();

    #[inline]
    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        let digest = &mut *self.0;
        digest.partial = digest.partial << 8 | u64::from(byte);
        digest.bytes += 1;
        if digest.bytes == 8 {
            let word = digest.partial;
            (digest.partial, digest.bytes) = (0, 0);
            digest.word(word);
        }
        Ok(())
    }

    #[inline]
    fn try_extend(&mut self, data: &[u8]) -> postcard::Result<()> {
        // Floats come as four bytes.
        if let Ok(bytes) = <[u8; 4]>::try_from(data)
            && self.0.bytes <= 4
        {
            let digest = &mut *self.0;
            digest.partial = digest.partial << 32 | u64::from(u32::from_be_bytes(bytes));
            digest.bytes += 4;
            if digest.bytes == 8 {
                let word = digest.partial;
                (digest.partial, digest.bytes) = (0, 0);
                digest.word(word);
            }
            return Ok(());
        }
        data.iter().try_for_each(|byte| self.try_push(*byte))
    }

    fn finalize(self) -> postcard::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hides from a digest that bytes come together.
    struct OneByOne<'a>(Bytes<'a>);

    impl Flavor for OneByOne<'_> {
        type Output = ();

        fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
            self.0.try_push(byte)
        }

        fn finalize(self) -> postcard::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn bytes_that_come_together_are_those_that_come_one_by_one() {
        let value = (1.5_f32, 7_u8, -2.25_f32, true, [3.0_f32; 5], "text", 4e9_f64, 9_u16, 0.1_f32);
        let (mut together, mut single) = (Digest::default(), Digest::default());
        postcard::serialize_with_flavor(&value, Bytes(&mut together)).unwrap();
        postcard::serialize_with_flavor(&value, OneByOne(Bytes(&mut single))).unwrap();
        let parts = |digest: &Digest| (digest.sum, digest.partial, digest.bytes);
        assert_eq!(parts(&together), parts(&single));
        assert_ne!(single.sum, 0);
    }
}
