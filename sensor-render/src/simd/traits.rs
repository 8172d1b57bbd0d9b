use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

/// Rays that one packet traces side by side.
pub(crate) const LANES: usize = 16;

/// Sixteen `f32`, one per lane.
pub(crate) trait Float:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type Mask: Mask;
    type Word: Word<Mask = Self::Mask, Float = Self>;
    type Float8: Float8;

    /// Returns `x` in every lane.
    fn splat(x: f32) -> Self;
    fn from_array(lanes: [f32; LANES]) -> Self;
    fn to_array(self) -> [f32; LANES];
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn floor(self) -> Self;
    /// Returns `self * a + b`, with a single rounding where the processor has FMA.
    fn mul_add(self, a: Self, b: Self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn ge(self, other: Self) -> Self::Mask;
    /// Returns `self` where the mask is set, else `other`.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
    /// Rounds toward zero; the result is unspecified for values outside of `i32`.
    fn to_int(self) -> Self::Word;
    /// Returns the bit patterns.
    fn bits(self) -> Self::Word;
    /// Returns the largest lane.
    fn largest(self) -> f32;
    /// Returns the smallest lane.
    fn smallest(self) -> f32;

    #[inline(always)]
    fn clamp01(self) -> Self {
        self.max(Self::splat(0.0)).min(Self::splat(1.0))
    }

    /// Returns `self + (to - self) * share`.
    #[inline(always)]
    fn lerp(self, to: Self, share: Self) -> Self {
        (to - self).mul_add(share, self)
    }
}

/// Sixteen `u32`, one per lane.
pub(crate) trait Word:
    Copy
    + Debug
    + Add<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
{
    type Mask: Mask;
    type Float: Float;

    fn splat(x: u32) -> Self;
    fn from_array(lanes: [u32; LANES]) -> Self;
    fn to_array(self) -> [u32; LANES];
    fn shl<const BITS: u32>(self) -> Self;
    fn shr<const BITS: u32>(self) -> Self;
    fn eq(self, other: Self) -> Self::Mask;
    /// Returns `self` where the mask is set, else `other`.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
    /// Converts lanes read as `i32` to `f32`.
    fn to_float(self) -> Self::Float;
    /// Reinterprets the bit patterns as `f32`.
    fn as_float(self) -> Self::Float;
}

/// Eight `f32`: one bound of the eight children of a [`crate::wide::WideNode`].
pub(crate) trait Float8: Copy {
    fn splat(x: f32) -> Self;
    fn load(from: &[f32; 8]) -> Self;
    fn to_array(self) -> [f32; 8];
    /// Returns `self * a + b`.
    fn mul_add(self, a: Self, b: Self) -> Self;
    fn min(self, other: Self) -> Self;
    /// Returns one bit per lane, set where `self >= other`.
    fn ge(self, other: Self) -> u32;
}

/// Sixteen booleans, one per lane.
pub(crate) trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    fn from_bits(bits: u16) -> Self;
    fn bits(self) -> u16;

    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}
