//! Sixteen rays side by side.
//!
//! One body of code, generic over [`Float`], serves every instruction set: it is compiled into
//! functions that enable AVX-512 or AVX2 with FMA, chosen at run time, and once for any machine.
//! For that to work each generic function is `#[inline(always)]`, and each way in is a
//! `#[target_feature]` function that [`on_each_isa`] makes.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
mod isa;
pub(crate) mod portable;
mod vector;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

pub(crate) use isa::{Isa, on_each_isa};
pub(crate) use vector::V3;

/// How many rays go side by side.
pub(crate) const LANES: usize = 16;

/// Sixteen numbers.
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
    type Eight: Eight;

    fn splat(x: f32) -> Self;
    fn from_array(lanes: [f32; LANES]) -> Self;
    fn to_array(self) -> [f32; LANES];
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn floor(self) -> Self;
    /// `self * a + b`, in one rounding where the machine can.
    fn mul_add(self, a: Self, b: Self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    fn ge(self, other: Self) -> Self::Mask;
    /// `self` where the mask is set, else `other`.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
    /// Towards zero; what does not fit into an i32 gives anything.
    fn to_int(self) -> Self::Word;
    fn bits(self) -> Self::Word;
    fn largest(self) -> f32;
    fn smallest(self) -> f32;

    #[inline(always)]
    fn clamp01(self) -> Self {
        self.max(Self::splat(0.0)).min(Self::splat(1.0))
    }

    /// `self + (to - self) * share`.
    #[inline(always)]
    fn lerp(self, to: Self, share: Self) -> Self {
        (to - self).mul_add(share, self)
    }
}

/// Sixteen words of 32 bits.
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
    /// `self` where the mask is set, else `other`.
    fn or(self, mask: Self::Mask, other: Self) -> Self;
    /// Read as i32.
    fn to_float(self) -> Self::Float;
    /// The same bits.
    fn as_float(self) -> Self::Float;
}

/// Eight numbers: a wide node's children side by side.
pub(crate) trait Eight: Copy {
    fn splat(x: f32) -> Self;
    fn load(from: &[f32; 8]) -> Self;
    fn to_array(self) -> [f32; 8];
    /// `self * a + b`.
    fn mul_add(self, a: Self, b: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    /// One bit for each lane with `self >= other`.
    fn ge(self, other: Self) -> u32;
}

/// Sixteen yes or no.
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

#[cfg(test)]
mod tests;
