//! Noise and hashes for irregular patterns. Twin of grain.wgsl.

use crate::simd::{Float, Word};

/// Returns 0 at `low`, 1 at `high`, and a smooth transition between; `low` may be the larger.
#[inline(always)]
pub(crate) fn smooth<F: Float>(low: F, high: F, x: F) -> F {
    let t = ((x - low) / (high - low)).clamp01();
    ease(t)
}

/// Returns a hash of a cell.
#[inline(always)]
pub(crate) fn hash<F: Float>(x: F::Word, y: F::Word, seed: F::Word) -> F::Word {
    let h = x * F::Word::splat(0x9e37_79b1) + y * F::Word::splat(0x85eb_ca77) + seed;
    let h = (h ^ h.shr::<15>()) * F::Word::splat(0x2c1b_3c6d);
    let h = (h ^ h.shr::<12>()) * F::Word::splat(0x297a_2d39);
    h ^ h.shr::<15>()
}

/// Converts a word to a number from 0 to 1.
#[inline(always)]
pub(crate) fn share<F: Float>(word: F::Word) -> F {
    word.shr::<8>().to_float() * F::splat(1.0 / 16_777_216.0)
}

/// Returns smooth noise from 0 to 1, with one lattice cell per unit square.
#[inline(always)]
pub(crate) fn noise<F: Float>(x: F, y: F, seed: F::Word) -> F {
    let (left, low) = (x.floor(), y.floor());
    let (u, v) = (x - left, y - low);
    let (left, low) = (left.to_int(), low.to_int());
    let (right, high) = (left + F::Word::splat(1), low + F::Word::splat(1));
    let (u, v) = (ease(u), ease(v));
    let below = corner::<F>(left, low, seed).lerp(corner(right, low, seed), u);
    let above = corner::<F>(left, high, seed).lerp(corner(right, high, seed), u);
    below.lerp(above, v)
}

#[inline(always)]
fn corner<F: Float>(x: F::Word, y: F::Word, seed: F::Word) -> F {
    share(hash::<F>(x, y, seed))
}

#[inline(always)]
fn ease<F: Float>(t: F) -> F {
    t * t * t.mul_add(F::splat(-2.0), F::splat(3.0))
}
