//! How the values of a word are counted: neighbours differ by 1.

use crate::bits::ordered;

/// Maps values to numbers and back.
pub(crate) trait Space {
    fn number(bits: u32) -> u32;
    fn bits(number: u32) -> u32;
    /// Continues a straight line through these two numbers.
    fn beyond(before: u32, last: u32) -> u32;
}

/// Whole numbers.
pub(crate) enum Whole {}

impl Space for Whole {
    #[inline(always)]
    fn number(bits: u32) -> u32 {
        bits
    }

    #[inline(always)]
    fn bits(number: u32) -> u32 {
        number
    }

    #[inline(always)]
    fn beyond(before: u32, last: u32) -> u32 {
        last.wrapping_add(last.wrapping_sub(before))
    }
}

/// Floats in the order of their values.
pub(crate) enum Floats {}

impl Space for Floats {
    #[inline(always)]
    fn number(bits: u32) -> u32 {
        ordered(bits)
    }

    #[inline(always)]
    fn bits(number: u32) -> u32 {
        ordered(number)
    }

    #[inline(always)]
    fn beyond(before: u32, last: u32) -> u32 {
        let [before, last] = [before, last].map(|number| f32::from_bits(ordered(number)));
        ordered((last + (last - before)).to_bits())
    }
}

/// Floats that are whole multiples of 1 / `PARTS`, a power of two.
pub(crate) enum Grid<const PARTS: u32> {}

impl<const PARTS: u32> Grid<PARTS> {
    /// Returns whether this value is on the grid, and its number gives the same bits.
    pub(crate) fn has(bits: u32) -> bool {
        Self::bits(Self::number(bits)) == bits
    }
}

impl<const PARTS: u32> Space for Grid<PARTS> {
    #[inline(always)]
    fn number(bits: u32) -> u32 {
        let parts = f32::from_bits(bits) * PARTS as f32;
        (parts + 0.5f32.copysign(parts)) as i32 as u32
    }

    #[inline(always)]
    fn bits(number: u32) -> u32 {
        (number as i32 as f32 * (1.0 / PARTS as f32)).to_bits()
    }

    #[inline(always)]
    fn beyond(before: u32, last: u32) -> u32 {
        Whole::beyond(before, last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_on_a_grid_are_restored_and_others_are_not_on_it() {
        type Quarters = Grid<4>;
        for value in [0.0f32, 0.25, -7.75, 4096.5, 1_048_575.75, -1e6] {
            assert!(Quarters::has(value.to_bits()), "{value}");
        }
        for value in [-0.0f32, 0.1, 0.250_001, f32::NAN, f32::INFINITY, 3e9, f32::MIN_POSITIVE] {
            assert!(!Quarters::has(value.to_bits()), "{value}");
        }
        assert_eq!(Quarters::beyond(5, 7), 9);
    }
}
