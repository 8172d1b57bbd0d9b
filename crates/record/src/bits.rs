//! Packs numbers of few bits.

use crate::error::Damage;

/// A number with more leading zeros than this is stored whole.
const ZEROS_MAX: u32 = 16;

/// Packs numbers from the lowest bit on.
#[derive(Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    open: u64,
    count: u32,
}

impl BitWriter {
    /// Appends the lowest `bits` (at most 32) of `value`; the other bits must be 0.
    #[inline]
    fn push(&mut self, value: u32, bits: u32) {
        self.open |= u64::from(value) << self.count;
        self.count += bits;
        if self.count >= 32 {
            self.bytes.extend_from_slice(&(self.open as u32).to_le_bytes());
            self.open >>= 32;
            self.count -= 32;
        }
    }

    /// Appends a number: the lowest `width` (at most 31) bits as they are, the rest as that many
    /// zeros before a one, or the whole number if there were too many zeros.
    #[inline]
    pub(crate) fn push_rice(&mut self, number: u32, width: u32) {
        let rest = number >> width;
        if rest >= ZEROS_MAX {
            self.push(0, ZEROS_MAX);
            self.push(number, 32);
            return;
        }
        self.push(1 << rest, rest + 1);
        self.push(number & ((1 << width) - 1), width);
    }

    /// Returns the bytes, padded so that eight can be read at a time.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.bytes.extend_from_slice(&self.open.to_le_bytes());
        self.bytes.extend_from_slice(&[0; 8]);
        self.bytes
    }
}

/// The number of bit streams that are read side by side.
pub(crate) const STREAMS: usize = 4;

/// Unpacks several streams side by side, so that they do not wait for each other.
#[derive(Default)]
pub(crate) struct BitReader<'a> {
    bytes: &'a [u8],
    at: [usize; STREAMS],
    has_ended: bool,
}

impl<'a> BitReader<'a> {
    /// Reads consecutive streams of these lengths in bytes.
    pub(crate) fn new(bytes: &'a [u8], lens: [usize; STREAMS]) -> BitReader<'a> {
        let mut end = 0usize;
        let at = lens.map(|len| {
            let begin = end;
            end = end.saturating_add(len);
            begin.saturating_mul(8)
        });
        BitReader { bytes, at, has_ended: false }
    }

    /// Returns the next number of that width; 0 past the end, which [`BitReader::check`] reports.
    #[inline(always)]
    pub(crate) fn pull_rice(&mut self, stream: usize, width: u32) -> u32 {
        let at = &mut self.at[stream];
        let byte = *at >> 3;
        let Some(window) = self.bytes.get(byte..).and_then(|rest| rest.first_chunk::<8>()) else {
            self.has_ended = true;
            return 0;
        };
        // At least 57 bits; only numbers that are stored whole have more than 47.
        let window = u64::from_le_bytes(*window) >> (*at & 7);
        let zeros = window.trailing_zeros();
        if zeros >= ZEROS_MAX {
            *at += (ZEROS_MAX + 32) as usize;
            return (window >> ZEROS_MAX) as u32;
        }
        *at += (zeros + 1 + width) as usize;
        let low = (window >> (zeros + 1)) & ((1 << width) - 1);
        (low | u64::from(zeros) << width) as u32
    }

    /// Returns an error if a number was read past the end.
    pub(crate) fn check(&self) -> Result<(), Damage> {
        if self.has_ended { Err(Damage("its bits end early")) } else { Ok(()) }
    }
}

/// Returns the width at which the numbers take the least room.
pub(crate) fn best_width<I: Iterator<Item = u32>>(numbers: impl Fn() -> I) -> u32 {
    let cost = |width: u32| -> u32 {
        let of = |n: u32| {
            let rest = n >> width;
            if rest >= ZEROS_MAX { ZEROS_MAX + 32 } else { rest + 1 + width }
        };
        numbers().map(of).sum()
    };
    let (count, bits) = numbers().fold((0, 0), |(count, bits), n| (count + 1, bits + class(n)));
    let middle = bits / u32::max(count, 1);
    let near = middle.saturating_sub(3)..=(middle + 2).min(31);
    near.min_by_key(|width| cost(*width)).unwrap_or(0)
}

/// Maps small differences of either sign to small numbers.
#[inline]
pub(crate) fn fold(difference: i32) -> u32 {
    ((difference << 1) ^ (difference >> 31)) as u32
}

/// Inverts [`fold`].
#[inline]
pub(crate) fn unfold(number: u32) -> i32 {
    ((number >> 1) as i32) ^ -((number & 1) as i32)
}

/// Returns the number of bits of a number.
#[inline]
pub(crate) fn class(number: u32) -> u32 {
    32 - number.leading_zeros()
}

/// Maps floats to integers in the order of their values: neighbours differ by 1.
#[inline]
pub(crate) fn ordered(bits: u32) -> u32 {
    bits ^ ((((bits as i32) >> 31) as u32) >> 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_numbers_are_unpacked() {
        let numbers = [(5u32, 3u32), (0, 0), (u32::MAX, 31), (1, 1), (0x1234, 9), (7, 0), (16, 0)];
        let [first, second] = [0, 3].map(|skipped| {
            let mut writer = BitWriter::default();
            numbers
                .iter()
                .skip(skipped)
                .for_each(|(value, width)| writer.push_rice(*value, *width));
            writer.finish()
        });
        let bytes = [&first[..], &second[..]].concat();
        let mut reader = BitReader::new(&bytes, [first.len(), second.len(), 0, 0]);
        for (index, (value, width)) in numbers.into_iter().enumerate() {
            assert_eq!(reader.pull_rice(0, width), value);
            if index >= 3 {
                assert_eq!(reader.pull_rice(1, width), value);
            }
        }
        assert_eq!(reader.check(), Ok(()));
        let mut empty = BitReader::new(&[], [0, usize::MAX, 1, 0]);
        empty.pull_rice(2, 1);
        assert_eq!(empty.check(), Err(Damage("its bits end early")));
    }

    #[test]
    fn the_best_width_is_near_the_width_of_the_numbers() {
        for (numbers, width) in [(&[0, 0, 0][..], 0), (&[900, 1000, 1100], 9), (&[u32::MAX], 30)] {
            let found = best_width(|| numbers.iter().copied());
            assert!(found.abs_diff(width) <= 1, "{numbers:?}: {found}");
        }
    }

    #[test]
    fn folding_and_ordering_can_be_undone() {
        for difference in [0, 1, -1, i32::MAX, i32::MIN, 12345] {
            assert_eq!(unfold(fold(difference)), difference);
        }
        for value in [0.0f32, -0.0, 1.5, -1.5, f32::MAX, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(ordered(ordered(value.to_bits())), value.to_bits());
        }
        let next = |v: f32| ordered(v.to_bits()) as i32;
        assert!(next(-1.0) < next(-0.5) && next(-0.5) < next(0.5) && next(0.5) < next(1.0));
    }
}
