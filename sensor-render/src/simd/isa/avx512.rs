//! Sixteen lanes in one AVX-512 register.
#![expect(unsafe_code, reason = "intrinsics, reached only where the processor has them")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use crate::simd::traits::{Float, LANES, Mask, Word};

/// Sixteen `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct F32x16(__m512);

/// Sixteen `u32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct U32x16(__m512i);

/// One bit per lane.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Mask16(__mmask16);

/// Evaluates an expression of AVX-512 intrinsics.
macro_rules! with_avx512 {
    ($intrinsic:expr) => {{
        // SAFETY: the types of this module are private to `isa`. Code outside reaches them only as
        // the `F` of `Kernel::run`, which `Isa::run` calls only where AVX-512 was detected.
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
    F32x16 Add add _mm512_add_ps;
    F32x16 Sub sub _mm512_sub_ps;
    F32x16 Mul mul _mm512_mul_ps;
    F32x16 Div div _mm512_div_ps;
    U32x16 Add add _mm512_add_epi32;
    U32x16 Mul mul _mm512_mullo_epi32;
    U32x16 BitAnd bitand _mm512_and_si512;
    U32x16 BitOr bitor _mm512_or_si512;
    U32x16 BitXor bitxor _mm512_xor_si512;
}

impl Neg for F32x16 {
    type Output = F32x16;
    #[inline(always)]
    fn neg(self) -> F32x16 {
        (self.bits() ^ U32x16::splat(1 << 31)).as_float()
    }
}

impl BitAnd for Mask16 {
    type Output = Mask16;
    #[inline(always)]
    fn bitand(self, other: Mask16) -> Mask16 {
        Mask16(self.0 & other.0)
    }
}

impl BitOr for Mask16 {
    type Output = Mask16;
    #[inline(always)]
    fn bitor(self, other: Mask16) -> Mask16 {
        Mask16(self.0 | other.0)
    }
}

impl Not for Mask16 {
    type Output = Mask16;
    #[inline(always)]
    fn not(self) -> Mask16 {
        Mask16(!self.0)
    }
}

impl Float for F32x16 {
    type Mask = Mask16;
    type Word = U32x16;
    type Float8 = super::avx2::F32x8;

    #[inline(always)]
    fn splat(x: f32) -> F32x16 {
        F32x16(with_avx512!(_mm512_set1_ps(x)))
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F32x16 {
        F32x16(with_avx512!(_mm512_loadu_ps(lanes.as_ptr())))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        with_avx512!(_mm512_storeu_ps(lanes.as_mut_ptr(), self.0));
        lanes
    }
    #[inline(always)]
    fn min(self, other: F32x16) -> F32x16 {
        F32x16(with_avx512!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: F32x16) -> F32x16 {
        F32x16(with_avx512!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> F32x16 {
        F32x16(with_avx512!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> F32x16 {
        F32x16(with_avx512!(_mm512_sqrt_ps(self.0)))
    }
    #[inline(always)]
    fn floor(self) -> F32x16 {
        const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
        F32x16(with_avx512!(_mm512_roundscale_ps::<DOWN>(self.0)))
    }
    #[inline(always)]
    fn mul_add(self, a: F32x16, b: F32x16) -> F32x16 {
        F32x16(with_avx512!(_mm512_fmadd_ps(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn lt(self, other: F32x16) -> Mask16 {
        Mask16(with_avx512!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn ge(self, other: F32x16) -> Mask16 {
        Mask16(with_avx512!(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn or(self, mask: Mask16, other: F32x16) -> F32x16 {
        F32x16(with_avx512!(_mm512_mask_blend_ps(mask.0, other.0, self.0)))
    }
    #[inline(always)]
    fn to_int(self) -> U32x16 {
        U32x16(with_avx512!(_mm512_cvttps_epi32(self.0)))
    }
    #[inline(always)]
    fn bits(self) -> U32x16 {
        U32x16(with_avx512!(_mm512_castps_si512(self.0)))
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

impl Word for U32x16 {
    type Mask = Mask16;
    type Float = F32x16;

    #[inline(always)]
    fn splat(x: u32) -> U32x16 {
        U32x16(with_avx512!(_mm512_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U32x16 {
        U32x16(with_avx512!(_mm512_loadu_si512(lanes.as_ptr().cast())))
    }
    #[inline(always)]
    fn to_array(self) -> [u32; LANES] {
        let mut lanes = [0; LANES];
        with_avx512!(_mm512_storeu_si512(lanes.as_mut_ptr().cast(), self.0));
        lanes
    }
    #[inline(always)]
    fn shl<const BITS: u32>(self) -> U32x16 {
        U32x16(with_avx512!(_mm512_slli_epi32::<BITS>(self.0)))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self) -> U32x16 {
        U32x16(with_avx512!(_mm512_srli_epi32::<BITS>(self.0)))
    }
    #[inline(always)]
    fn eq(self, other: U32x16) -> Mask16 {
        Mask16(with_avx512!(_mm512_cmpeq_epi32_mask(self.0, other.0)))
    }
    #[inline(always)]
    fn or(self, mask: Mask16, other: U32x16) -> U32x16 {
        U32x16(with_avx512!(_mm512_mask_blend_epi32(mask.0, other.0, self.0)))
    }
    #[inline(always)]
    fn to_float(self) -> F32x16 {
        F32x16(with_avx512!(_mm512_cvtepi32_ps(self.0)))
    }
    #[inline(always)]
    fn as_float(self) -> F32x16 {
        F32x16(with_avx512!(_mm512_castsi512_ps(self.0)))
    }
}

impl Mask for Mask16 {
    #[inline(always)]
    fn from_bits(bits: u16) -> Mask16 {
        Mask16(bits)
    }
    #[inline(always)]
    fn bits(self) -> u16 {
        self.0
    }
}
