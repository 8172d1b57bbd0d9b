use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Eight, Float, LANES, Mask, Word};

/// Sixteen numbers for any machine; the compiler makes of it what it can.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct F([f32; LANES]);

/// Sixteen words for any machine.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct U([u32; LANES]);

/// All ones or all zeros in each lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct M([u32; LANES]);

/// Eight numbers for any machine.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct E([f32; 8]);

impl Eight for E {
    #[inline(always)]
    fn splat(x: f32) -> E {
        E([x; 8])
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> E {
        E(*from)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn mul_add(self, a: E, b: E) -> E {
        E(std::array::from_fn(|i| self.0[i] * a.0[i] + b.0[i]))
    }
    #[inline(always)]
    fn min(self, other: E) -> E {
        E(std::array::from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn max(self, other: E) -> E {
        E(std::array::from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn ge(self, other: E) -> u32 {
        (0..8).fold(0, |bits, i| bits | u32::from(self.0[i] >= other.0[i]) << i)
    }
}

macro_rules! lanewise {
    ($type:ident: $($trait:ident $method:ident($a:ident, $b:ident) $result:expr;)*) => {
        $(impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                $type(std::array::from_fn(|lane| {
                    let ($a, $b) = (self.0[lane], other.0[lane]);
                    $result
                }))
            }
        })*
    };
}

lanewise! { F:
    Add add(a, b) a + b;
    Sub sub(a, b) a - b;
    Mul mul(a, b) a * b;
    Div div(a, b) a / b;
}
lanewise! { U:
    Add add(a, b) a.wrapping_add(b);
    Mul mul(a, b) a.wrapping_mul(b);
    BitAnd bitand(a, b) a & b;
    BitOr bitor(a, b) a | b;
    BitXor bitxor(a, b) a ^ b;
}
lanewise! { M:
    BitAnd bitand(a, b) a & b;
    BitOr bitor(a, b) a | b;
}

impl Neg for F {
    type Output = F;
    #[inline(always)]
    fn neg(self) -> F {
        F(self.0.map(|x| -x))
    }
}

impl Not for M {
    type Output = M;
    #[inline(always)]
    fn not(self) -> M {
        M(self.0.map(|x| !x))
    }
}

/// All ones for yes.
#[inline(always)]
fn ones(yes: bool) -> u32 {
    (yes as u32).wrapping_neg()
}

impl Float for F {
    type Mask = M;
    type Word = U;
    type Eight = E;

    #[inline(always)]
    fn splat(x: f32) -> F {
        F([x; LANES])
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F {
        F(lanes)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        self.0
    }
    #[inline(always)]
    fn min(self, other: F) -> F {
        F(std::array::from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn max(self, other: F) -> F {
        F(std::array::from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn abs(self) -> F {
        F(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> F {
        F(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn floor(self) -> F {
        // The base instruction set has no rounding; this is right below 2³¹.
        F(self.0.map(|x| {
            let whole = x as i32 as f32;
            if whole > x { whole - 1.0 } else { whole }
        }))
    }
    #[inline(always)]
    fn mul_add(self, a: F, b: F) -> F {
        self * a + b
    }
    #[inline(always)]
    fn lt(self, other: F) -> M {
        M(std::array::from_fn(|i| ones(self.0[i] < other.0[i])))
    }
    #[inline(always)]
    fn ge(self, other: F) -> M {
        M(std::array::from_fn(|i| ones(self.0[i] >= other.0[i])))
    }
    #[inline(always)]
    fn or(self, mask: M, other: F) -> F {
        self.bits().or(mask, other.bits()).as_float()
    }
    #[inline(always)]
    fn to_int(self) -> U {
        U(self.0.map(|x| x as i32 as u32))
    }
    #[inline(always)]
    fn bits(self) -> U {
        U(self.0.map(f32::to_bits))
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        self.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        self.0.into_iter().fold(f32::INFINITY, |a, b| if a < b { a } else { b })
    }
}

impl Word for U {
    type Mask = M;
    type Float = F;

    #[inline(always)]
    fn splat(x: u32) -> U {
        U([x; LANES])
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U {
        U(lanes)
    }
    #[inline(always)]
    fn to_array(self) -> [u32; LANES] {
        self.0
    }
    #[inline(always)]
    fn shl<const BITS: u32>(self) -> U {
        U(self.0.map(|x| x << BITS))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self) -> U {
        U(self.0.map(|x| x >> BITS))
    }
    #[inline(always)]
    fn eq(self, other: U) -> M {
        M(std::array::from_fn(|i| ones(self.0[i] == other.0[i])))
    }
    #[inline(always)]
    fn or(self, mask: M, other: U) -> U {
        U(std::array::from_fn(|i| self.0[i] & mask.0[i] | other.0[i] & !mask.0[i]))
    }
    #[inline(always)]
    fn to_float(self) -> F {
        F(self.0.map(|x| x as i32 as f32))
    }
    #[inline(always)]
    fn as_float(self) -> F {
        F(self.0.map(f32::from_bits))
    }
}

impl Mask for M {
    #[inline(always)]
    fn from_bits(bits: u16) -> M {
        M(std::array::from_fn(|lane| ones(bits >> lane & 1 != 0)))
    }
    #[inline(always)]
    fn bits(self) -> u16 {
        self.0.iter().enumerate().fold(0, |bits, (lane, x)| bits | (*x as u16 & 1) << lane)
    }
}
