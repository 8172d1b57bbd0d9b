//! Sixteen lanes in two AVX2 registers.
#![expect(unsafe_code, reason = "intrinsics, reached only where the processor has them")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use crate::simd::traits::{Float, Float8, LANES, Mask, Word};

/// Sixteen `f32`.
#[derive(Clone, Copy, Debug)]
pub(super) struct F32x16(__m256, __m256);

/// Sixteen `u32`.
#[derive(Clone, Copy, Debug)]
pub(super) struct U32x16(__m256i, __m256i);

/// All bits set or all bits clear in each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mask16(__m256, __m256);

/// Evaluates an expression of AVX2 and FMA intrinsics.
macro_rules! with_avx2 {
    ($intrinsic:expr) => {{
        // SAFETY: the types of this module are private to `isa`. Code outside reaches them only as
        // the `F` of `Kernel::run`, which `Isa::run` calls only where AVX2 and FMA were detected.
        unsafe { $intrinsic }
    }};
}

/// Eight `f32`.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct F32x8(__m256);

impl Float8 for F32x8 {
    #[inline(always)]
    fn splat(x: f32) -> F32x8 {
        F32x8(with_avx2!(_mm256_set1_ps(x)))
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> F32x8 {
        F32x8(with_avx2!(_mm256_loadu_ps(from.as_ptr())))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut lanes = [0.0; 8];
        with_avx2!(_mm256_storeu_ps(lanes.as_mut_ptr(), self.0));
        lanes
    }
    #[inline(always)]
    fn mul_add(self, a: F32x8, b: F32x8) -> F32x8 {
        F32x8(with_avx2!(_mm256_fmadd_ps(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn min(self, other: F32x8) -> F32x8 {
        F32x8(with_avx2!(_mm256_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn ge(self, other: F32x8) -> u32 {
        let mask = with_avx2!(_mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0));
        with_avx2!(_mm256_movemask_ps(mask)) as u32
    }
}

macro_rules! operators {
    ($($type:ident $trait:ident $method:ident $intrinsic:ident;)*) => {
        $(impl $trait for $type {
            type Output = $type;
            #[inline(always)]
            fn $method(self, other: $type) -> $type {
                with_avx2!($type($intrinsic(self.0, other.0), $intrinsic(self.1, other.1)))
            }
        })*
    };
}

operators! {
    F32x16 Add add _mm256_add_ps;
    F32x16 Sub sub _mm256_sub_ps;
    F32x16 Mul mul _mm256_mul_ps;
    F32x16 Div div _mm256_div_ps;
    U32x16 Add add _mm256_add_epi32;
    U32x16 Mul mul _mm256_mullo_epi32;
    U32x16 BitAnd bitand _mm256_and_si256;
    U32x16 BitOr bitor _mm256_or_si256;
    U32x16 BitXor bitxor _mm256_xor_si256;
    Mask16 BitAnd bitand _mm256_and_ps;
    Mask16 BitOr bitor _mm256_or_ps;
}

impl Neg for F32x16 {
    type Output = F32x16;
    #[inline(always)]
    fn neg(self) -> F32x16 {
        (self.bits() ^ U32x16::splat(1 << 31)).as_float()
    }
}

impl Not for Mask16 {
    type Output = Mask16;
    #[inline(always)]
    fn not(self) -> Mask16 {
        let ones = U32x16::splat(u32::MAX).as_float();
        with_avx2!(Mask16(_mm256_xor_ps(self.0, ones.0), _mm256_xor_ps(self.1, ones.1)))
    }
}

impl Float for F32x16 {
    type Mask = Mask16;
    type Word = U32x16;
    type Float8 = F32x8;

    #[inline(always)]
    fn splat(x: f32) -> F32x16 {
        with_avx2!(F32x16(_mm256_set1_ps(x), _mm256_set1_ps(x)))
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F32x16 {
        let at = lanes.as_ptr();
        with_avx2!(F32x16(_mm256_loadu_ps(at), _mm256_loadu_ps(at.add(8))))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut lanes = [0.0; LANES];
        let at = lanes.as_mut_ptr();
        with_avx2!({
            _mm256_storeu_ps(at, self.0);
            _mm256_storeu_ps(at.add(8), self.1);
        });
        lanes
    }
    #[inline(always)]
    fn min(self, other: F32x16) -> F32x16 {
        with_avx2!(F32x16(_mm256_min_ps(self.0, other.0), _mm256_min_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn max(self, other: F32x16) -> F32x16 {
        with_avx2!(F32x16(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn abs(self) -> F32x16 {
        (self.bits() & U32x16::splat(u32::MAX >> 1)).as_float()
    }
    #[inline(always)]
    fn sqrt(self) -> F32x16 {
        with_avx2!(F32x16(_mm256_sqrt_ps(self.0), _mm256_sqrt_ps(self.1)))
    }
    #[inline(always)]
    fn floor(self) -> F32x16 {
        with_avx2!(F32x16(_mm256_floor_ps(self.0), _mm256_floor_ps(self.1)))
    }
    #[inline(always)]
    fn mul_add(self, a: F32x16, b: F32x16) -> F32x16 {
        with_avx2!(F32x16(_mm256_fmadd_ps(self.0, a.0, b.0), _mm256_fmadd_ps(self.1, a.1, b.1)))
    }
    #[inline(always)]
    fn lt(self, other: F32x16) -> Mask16 {
        with_avx2!(Mask16(
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0),
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1),
        ))
    }
    #[inline(always)]
    fn ge(self, other: F32x16) -> Mask16 {
        with_avx2!(Mask16(
            _mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0),
            _mm256_cmp_ps::<_CMP_GE_OQ>(self.1, other.1),
        ))
    }
    #[inline(always)]
    fn or(self, mask: Mask16, other: F32x16) -> F32x16 {
        with_avx2!(F32x16(
            _mm256_blendv_ps(other.0, self.0, mask.0),
            _mm256_blendv_ps(other.1, self.1, mask.1),
        ))
    }
    #[inline(always)]
    fn to_int(self) -> U32x16 {
        with_avx2!(U32x16(_mm256_cvttps_epi32(self.0), _mm256_cvttps_epi32(self.1)))
    }
    #[inline(always)]
    fn bits(self) -> U32x16 {
        with_avx2!(U32x16(_mm256_castps_si256(self.0), _mm256_castps_si256(self.1)))
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        with_avx2!({
            let eight = _mm256_max_ps(self.0, self.1);
            let four = _mm_max_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps::<1>(eight));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
        })
    }
    #[inline(always)]
    fn smallest(self) -> f32 {
        -(-self).largest()
    }
}

impl Word for U32x16 {
    type Mask = Mask16;
    type Float = F32x16;

    #[inline(always)]
    fn splat(x: u32) -> U32x16 {
        with_avx2!(U32x16(_mm256_set1_epi32(x as i32), _mm256_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U32x16 {
        let at = lanes.as_ptr().cast::<__m256i>();
        with_avx2!(U32x16(_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1))))
    }
    #[inline(always)]
    fn to_array(self) -> [u32; LANES] {
        let mut lanes = [0; LANES];
        let at = lanes.as_mut_ptr().cast::<__m256i>();
        with_avx2!({
            _mm256_storeu_si256(at, self.0);
            _mm256_storeu_si256(at.add(1), self.1);
        });
        lanes
    }
    #[inline(always)]
    fn shl<const BITS: u32>(self) -> U32x16 {
        let count = with_avx2!(_mm_cvtsi32_si128(BITS as i32));
        with_avx2!(U32x16(_mm256_sll_epi32(self.0, count), _mm256_sll_epi32(self.1, count)))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self) -> U32x16 {
        let count = with_avx2!(_mm_cvtsi32_si128(BITS as i32));
        with_avx2!(U32x16(_mm256_srl_epi32(self.0, count), _mm256_srl_epi32(self.1, count)))
    }
    #[inline(always)]
    fn eq(self, other: U32x16) -> Mask16 {
        with_avx2!(Mask16(
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)),
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.1, other.1)),
        ))
    }
    #[inline(always)]
    fn or(self, mask: Mask16, other: U32x16) -> U32x16 {
        self.as_float().or(mask, other.as_float()).bits()
    }
    #[inline(always)]
    fn to_float(self) -> F32x16 {
        with_avx2!(F32x16(_mm256_cvtepi32_ps(self.0), _mm256_cvtepi32_ps(self.1)))
    }
    #[inline(always)]
    fn as_float(self) -> F32x16 {
        with_avx2!(F32x16(_mm256_castsi256_ps(self.0), _mm256_castsi256_ps(self.1)))
    }
}

impl Mask for Mask16 {
    #[inline(always)]
    fn from_bits(bits: u16) -> Mask16 {
        let lanes = std::array::from_fn(|lane| ((bits >> lane & 1) as u32).wrapping_neg());
        let words = U32x16::from_array(lanes).as_float();
        Mask16(words.0, words.1)
    }
    #[inline(always)]
    fn bits(self) -> u16 {
        let low = with_avx2!(_mm256_movemask_ps(self.0)) as u16;
        let high = with_avx2!(_mm256_movemask_ps(self.1)) as u16;
        low | high << 8
    }
}
