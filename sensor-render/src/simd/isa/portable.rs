//! Sixteen lanes in plain Rust, for processors without the instruction sets above.
//!
//! On x86-64, where processors without AVX2 are older than 2013, each operation is a call: inlined into the
//! kernels as those of the other sets, this one would take most of the time in which the crate compiles.

use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use crate::simd::traits::{Float, Float8, LANES, Mask, Word};

/// Sixteen `f32` in plain Rust, which the compiler vectorizes for the target.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct F32x16([f32; LANES]);

/// Sixteen `u32` in plain Rust.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct U32x16([u32; LANES]);

/// All bits set or all bits clear in each lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Mask16([u32; LANES]);

/// Eight `f32` in plain Rust.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct F32x8([f32; 8]);

impl Float8 for F32x8 {
    #[inline(always)]
    fn splat(x: f32) -> F32x8 {
        F32x8([x; 8])
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> F32x8 {
        F32x8(*from)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn mul_add(self, a: F32x8, b: F32x8) -> F32x8 {
        F32x8(std::array::from_fn(|i| self.0[i] * a.0[i] + b.0[i]))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn min(self, other: F32x8) -> F32x8 {
        F32x8(std::array::from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn ge(self, other: F32x8) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(self.0[i] >= other.0[i]) << i)
    }
}

macro_rules! lanewise {
    ($type:ident: $($trait:ident $method:ident($a:ident, $b:ident) $result:expr;)*) => {
        $(impl $trait for $type {
            type Output = $type;
            #[cfg_attr(target_arch = "x86_64", inline(never))]
            #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
            fn $method(self, other: $type) -> $type {
                $type(std::array::from_fn(|lane| {
                    let ($a, $b) = (self.0[lane], other.0[lane]);
                    $result
                }))
            }
        })*
    };
}

lanewise! { F32x16:
    Add add(a, b) a + b;
    Sub sub(a, b) a - b;
    Mul mul(a, b) a * b;
    Div div(a, b) a / b;
}
lanewise! { U32x16:
    Add add(a, b) a.wrapping_add(b);
    Mul mul(a, b) a.wrapping_mul(b);
    BitAnd bitand(a, b) a & b;
    BitOr bitor(a, b) a | b;
    BitXor bitxor(a, b) a ^ b;
}
lanewise! { Mask16:
    BitAnd bitand(a, b) a & b;
    BitOr bitor(a, b) a | b;
}

impl Neg for F32x16 {
    type Output = F32x16;
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn neg(self) -> F32x16 {
        F32x16(self.0.map(|x| -x))
    }
}

impl Not for Mask16 {
    type Output = Mask16;
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn not(self) -> Mask16 {
        Mask16(self.0.map(|x| !x))
    }
}

/// Returns all bits set if `yes`, else 0.
#[inline(always)]
fn ones(yes: bool) -> u32 {
    (yes as u32).wrapping_neg()
}

impl Float for F32x16 {
    type Mask = Mask16;
    type Word = U32x16;
    type Float8 = F32x8;

    #[inline(always)]
    fn splat(x: f32) -> F32x16 {
        F32x16([x; LANES])
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F32x16 {
        F32x16(lanes)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.0
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn min(self, other: F32x16) -> F32x16 {
        F32x16(std::array::from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn max(self, other: F32x16) -> F32x16 {
        F32x16(std::array::from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn abs(self) -> F32x16 {
        F32x16(self.0.map(f32::abs))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn sqrt(self) -> F32x16 {
        F32x16(self.0.map(f32::sqrt))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn floor(self) -> F32x16 {
        // The x86-64 baseline has no rounding instruction; this is exact below 2³¹.
        F32x16(self.0.map(|x| {
            let whole = x as i32 as f32;
            if whole > x { whole - 1.0 } else { whole }
        }))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn mul_add(self, a: F32x16, b: F32x16) -> F32x16 {
        self * a + b
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn lt(self, other: F32x16) -> Mask16 {
        Mask16(std::array::from_fn(|i| ones(self.0[i] < other.0[i])))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn ge(self, other: F32x16) -> Mask16 {
        Mask16(std::array::from_fn(|i| ones(self.0[i] >= other.0[i])))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn or(self, mask: Mask16, other: F32x16) -> F32x16 {
        self.bits().or(mask, other.bits()).as_float()
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn to_int(self) -> U32x16 {
        U32x16(self.0.map(|x| x as i32 as u32))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn bits(self) -> U32x16 {
        U32x16(self.0.map(f32::to_bits))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn largest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if a > b { a } else { b })
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn smallest(self) -> f32 {
        self.0.into_iter().fold(f32::INFINITY, |a, b| if a < b { a } else { b })
    }
}

impl Word for U32x16 {
    type Mask = Mask16;
    type Float = F32x16;

    #[inline(always)]
    fn splat(x: u32) -> U32x16 {
        U32x16([x; LANES])
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U32x16 {
        U32x16(lanes)
    }
    #[inline(always)]
    fn to_array(self) -> [u32; LANES] {
        self.0
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn shl<const BITS: u32>(self) -> U32x16 {
        U32x16(self.0.map(|x| x << BITS))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn shr<const BITS: u32>(self) -> U32x16 {
        U32x16(self.0.map(|x| x >> BITS))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn eq(self, other: U32x16) -> Mask16 {
        Mask16(std::array::from_fn(|i| ones(self.0[i] == other.0[i])))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn or(self, mask: Mask16, other: U32x16) -> U32x16 {
        U32x16(std::array::from_fn(|i| self.0[i] & mask.0[i] | other.0[i] & !mask.0[i]))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn to_float(self) -> F32x16 {
        F32x16(self.0.map(|x| x as i32 as f32))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn as_float(self) -> F32x16 {
        F32x16(self.0.map(f32::from_bits))
    }
}

impl Mask for Mask16 {
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn from_bits(bits: u16) -> Mask16 {
        Mask16(std::array::from_fn(|lane| ones(bits >> lane & 1 != 0)))
    }
    #[cfg_attr(target_arch = "x86_64", inline(never))]
    #[cfg_attr(not(target_arch = "x86_64"), inline(always))]
    fn bits(self) -> u16 {
        self.0.iter().enumerate().fold(0, |bits, (lane, x)| bits | (*x as u16 & 1) << lane)
    }
}
