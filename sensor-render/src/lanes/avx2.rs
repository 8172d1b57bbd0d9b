//! Sixteen lanes in two registers.
#![expect(unsafe_code, reason = "intrinsics, behind functions that only enabled code may call")]

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use super::{Eight, Float, LANES, Mask, Word};

/// Sixteen numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct F(__m256, __m256);

/// Sixteen words.
#[derive(Clone, Copy, Debug)]
pub(crate) struct U(__m256i, __m256i);

/// All ones or all zeros in each lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct M(__m256, __m256);

/// Runs intrinsics of AVX2 and FMA.
macro_rules! with_avx2 {
    ($intrinsic:expr) => {{
        // SAFETY: values of these types are only made below functions that enable AVX2 and FMA
        // (`on_each_isa`), which run only where the processor has them.
        unsafe { $intrinsic }
    }};
}

/// Eight numbers.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(crate) struct E(__m256);

impl Eight for E {
    #[inline(always)]
    fn splat(x: f32) -> E {
        E(with_avx2!(_mm256_set1_ps(x)))
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> E {
        E(with_avx2!(_mm256_loadu_ps(from.as_ptr())))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut lanes = [0.0; 8];
        with_avx2!(_mm256_storeu_ps(lanes.as_mut_ptr(), self.0));
        lanes
    }
    #[inline(always)]
    fn mul_add(self, a: E, b: E) -> E {
        E(with_avx2!(_mm256_fmadd_ps(self.0, a.0, b.0)))
    }
    #[inline(always)]
    fn min(self, other: E) -> E {
        E(with_avx2!(_mm256_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: E) -> E {
        E(with_avx2!(_mm256_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn ge(self, other: E) -> u32 {
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
    F Add add _mm256_add_ps;
    F Sub sub _mm256_sub_ps;
    F Mul mul _mm256_mul_ps;
    F Div div _mm256_div_ps;
    U Add add _mm256_add_epi32;
    U Mul mul _mm256_mullo_epi32;
    U BitAnd bitand _mm256_and_si256;
    U BitOr bitor _mm256_or_si256;
    U BitXor bitxor _mm256_xor_si256;
    M BitAnd bitand _mm256_and_ps;
    M BitOr bitor _mm256_or_ps;
}

impl Neg for F {
    type Output = F;
    #[inline(always)]
    fn neg(self) -> F {
        (self.bits() ^ U::splat(1 << 31)).as_float()
    }
}

impl Not for M {
    type Output = M;
    #[inline(always)]
    fn not(self) -> M {
        let ones = U::splat(u32::MAX).as_float();
        with_avx2!(M(_mm256_xor_ps(self.0, ones.0), _mm256_xor_ps(self.1, ones.1)))
    }
}

impl Float for F {
    type Mask = M;
    type Word = U;
    type Eight = E;

    #[inline(always)]
    fn splat(x: f32) -> F {
        with_avx2!(F(_mm256_set1_ps(x), _mm256_set1_ps(x)))
    }
    #[inline(always)]
    fn from_array(lanes: [f32; LANES]) -> F {
        let at = lanes.as_ptr();
        with_avx2!(F(_mm256_loadu_ps(at), _mm256_loadu_ps(at.add(8))))
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
    fn min(self, other: F) -> F {
        with_avx2!(F(_mm256_min_ps(self.0, other.0), _mm256_min_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn max(self, other: F) -> F {
        with_avx2!(F(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn abs(self) -> F {
        (self.bits() & U::splat(u32::MAX >> 1)).as_float()
    }
    #[inline(always)]
    fn sqrt(self) -> F {
        with_avx2!(F(_mm256_sqrt_ps(self.0), _mm256_sqrt_ps(self.1)))
    }
    #[inline(always)]
    fn floor(self) -> F {
        with_avx2!(F(_mm256_floor_ps(self.0), _mm256_floor_ps(self.1)))
    }
    #[inline(always)]
    fn mul_add(self, a: F, b: F) -> F {
        with_avx2!(F(_mm256_fmadd_ps(self.0, a.0, b.0), _mm256_fmadd_ps(self.1, a.1, b.1)))
    }
    #[inline(always)]
    fn lt(self, other: F) -> M {
        with_avx2!(M(
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0),
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1),
        ))
    }
    #[inline(always)]
    fn ge(self, other: F) -> M {
        with_avx2!(M(
            _mm256_cmp_ps::<_CMP_GE_OQ>(self.0, other.0),
            _mm256_cmp_ps::<_CMP_GE_OQ>(self.1, other.1),
        ))
    }
    #[inline(always)]
    fn or(self, mask: M, other: F) -> F {
        with_avx2!(F(
            _mm256_blendv_ps(other.0, self.0, mask.0),
            _mm256_blendv_ps(other.1, self.1, mask.1),
        ))
    }
    #[inline(always)]
    fn to_int(self) -> U {
        with_avx2!(U(_mm256_cvttps_epi32(self.0), _mm256_cvttps_epi32(self.1)))
    }
    #[inline(always)]
    fn bits(self) -> U {
        with_avx2!(U(_mm256_castps_si256(self.0), _mm256_castps_si256(self.1)))
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

impl Word for U {
    type Mask = M;
    type Float = F;

    #[inline(always)]
    fn splat(x: u32) -> U {
        with_avx2!(U(_mm256_set1_epi32(x as i32), _mm256_set1_epi32(x as i32)))
    }
    #[inline(always)]
    fn from_array(lanes: [u32; LANES]) -> U {
        let at = lanes.as_ptr().cast::<__m256i>();
        with_avx2!(U(_mm256_loadu_si256(at), _mm256_loadu_si256(at.add(1))))
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
    fn shl<const BITS: u32>(self) -> U {
        let count = with_avx2!(_mm_cvtsi32_si128(BITS as i32));
        with_avx2!(U(_mm256_sll_epi32(self.0, count), _mm256_sll_epi32(self.1, count)))
    }
    #[inline(always)]
    fn shr<const BITS: u32>(self) -> U {
        let count = with_avx2!(_mm_cvtsi32_si128(BITS as i32));
        with_avx2!(U(_mm256_srl_epi32(self.0, count), _mm256_srl_epi32(self.1, count)))
    }
    #[inline(always)]
    fn eq(self, other: U) -> M {
        with_avx2!(M(
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0)),
            _mm256_castsi256_ps(_mm256_cmpeq_epi32(self.1, other.1)),
        ))
    }
    #[inline(always)]
    fn or(self, mask: M, other: U) -> U {
        self.as_float().or(mask, other.as_float()).bits()
    }
    #[inline(always)]
    fn to_float(self) -> F {
        with_avx2!(F(_mm256_cvtepi32_ps(self.0), _mm256_cvtepi32_ps(self.1)))
    }
    #[inline(always)]
    fn as_float(self) -> F {
        with_avx2!(F(_mm256_castsi256_ps(self.0), _mm256_castsi256_ps(self.1)))
    }
}

impl Mask for M {
    #[inline(always)]
    fn from_bits(bits: u16) -> M {
        let lanes = std::array::from_fn(|lane| ((bits >> lane & 1) as u32).wrapping_neg());
        let words = U::from_array(lanes).as_float();
        M(words.0, words.1)
    }
    #[inline(always)]
    fn bits(self) -> u16 {
        let low = with_avx2!(_mm256_movemask_ps(self.0)) as u16;
        let high = with_avx2!(_mm256_movemask_ps(self.1)) as u16;
        low | high << 8
    }
}
