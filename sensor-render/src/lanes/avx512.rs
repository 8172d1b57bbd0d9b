//! Sixteen lanes in one register.
#![expect(unsafe_code, reason = "intrinsics, behind functions that only enabled code may call")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Float, LANES, Mask, Word};

/// Sixteen numbers.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct F(__m512);

/// Sixteen words.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct U(__m512i);

/// One bit a lane.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct M(__mmask16);

/// Runs an intrinsic of AVX-512.
macro_rules! with_avx512 {
    ($intrinsic:expr) => {{
        // SAFETY: values of these types are only made below functions that enable AVX-512
        // (`on_each_isa`), which run only where the processor has it.
        unsafe { $intrinsic }
    }};
}

macro_rules! operators {
    ($($type:ident $trait:ident $method:ident $intrinsic:ident;)*) => {
        $(impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                $type(with_avx512!($intrinsic(self.0, other.0)))
            }
        })*
    };
}

operators! {
    F Add add _mm512_add_ps;
    F Sub sub _mm512_sub_ps;
    F Mul mul _mm512_mul_ps;
    F Div div _mm512_div_ps;
    U Add add _mm512_add_epi32;
    U Mul mul _mm512_mullo_epi32;
    U BitAnd bitand _mm512_and_si512;
    U BitOr bitor _mm512_or_si512;
    U BitXor bitxor _mm512_xor_si512;
}

impl Neg for F {
    type Output = F;
    #[inline(always)]
    fn neg(self) -> F {
        (self.bits() ^ U::splat(1 << 31)).as_float()
    }
}

impl BitAnd for M {
    type Output = M;
    #[inline(always)]
    fn bitand(self, other: M) -> M {
        M(self.0 & other.0)
    }
}

impl BitOr for M {
    type Output = M;
    #[inline(always)]
    fn bitor(self, other: M) -> M {
        M(self.0 | other.0)
    }
}

impl Not for M {
    type Output = M;
    #[inline(always)]
    fn not(self) -> M {
        M(!self.0)
    }
}

impl Float for F {
    type Mask = M;
    type Word = U;
    type Eight = super::avx2::E;

    #[inline(always)]
    fn splat(x: f32) -> F {
        F(with_avx512!(_mm512_set1_ps(x)))
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F {
        F(with_avx512!(_mm512_loadu_ps(lanes.as_ptr())))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        with_avx512!(_mm512_storeu_ps(lanes.as_mut_ptr(), self.0));
        lanes
    }
    #[inline(always)]
    fn min(self, other: F) -> F {
        F(with_avx512!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: F) -> F {
        F(with_avx512!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> F {
        F(with_avx512!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> F {
        F(with_avx512!(_mm512_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn floor(self) -> F {
        const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
        F(with_avx512!(_mm512_roundscale_ps::<DOWN>(self.0)))
    }
    #[inline(always)]
    fn mul_add(self, a: F, b: F) -> F {
        F(with_avx512!(_mm512_fmadd_ps(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn lt(self, other: F) -> M {
        M(with_avx512!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn ge(self, other: F) -> M {
        M(with_avx512!(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn or(self, mask: M, other: F) -> F {
        F(with_avx512!(_mm512_mask_blend_ps(mask.0, other.0, self.0)))
    }
    #[inline(always)]
    fn to_int(self) -> U {
        U(with_avx512!(_mm512_cvttps_epi32(self.0)))
    }
    #[inline(always)]
    fn bits(self) -> U {
        U(with_avx512!(_mm512_castps_si512(self.0)))
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        with_avx512!(_mm512_reduce_max_ps(self.0))
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        with_avx512!(_mm512_reduce_min_ps(self.0))
    }
}

impl Word for U {
    type Mask = M;
    type Float = F;

    #[inline(always)]
    fn splat(x: u32) -> U {
        U(with_avx512!(_mm512_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U {
        U(with_avx512!(_mm512_loadu_si512(lanes.as_ptr().cast())))
    }
    #[inline(always)]
    fn to_array(self) -> [u32; LANES] {
        let mut lanes = [0; LANES];
        with_avx512!(_mm512_storeu_si512(lanes.as_mut_ptr().cast(), self.0));
        lanes
    }
    #[inline(always)]
    fn shl<const BITS: u32>(self) -> U {
        U(with_avx512!(_mm512_slli_epi32::<BITS>(self.0)))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self) -> U {
        U(with_avx512!(_mm512_srli_epi32::<BITS>(self.0)))
    }
    #[inline(always)]
    fn eq(self, other: U) -> M {
        M(with_avx512!(_mm512_cmpeq_epi32_mask(self.0, other.0)))
    }
    #[inline(always)]
    fn or(self, mask: M, other: U) -> U {
        U(with_avx512!(_mm512_mask_blend_epi32(mask.0, other.0, self.0)))
    }
    #[inline(always)]
    fn to_float(self) -> F {
        F(with_avx512!(_mm512_cvtepi32_ps(self.0)))
    }
    #[inline(always)]
    fn as_float(self) -> F {
        F(with_avx512!(_mm512_castsi512_ps(self.0)))
    }
}

impl Mask for M {
    #[inline(always)]
    fn from_bits(bits: u16) -> M {
        M(bits)
    }
    #[inline(always)]
    fn bits(self) -> u16 {
        self.0
    }
}
