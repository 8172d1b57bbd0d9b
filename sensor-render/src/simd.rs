//! Sixteen rays side by side, with the best instruction set that the processor has.
//!
//! One generic body of code, written against [`Float`], serves every instruction set: [`Isa::run`]
//! calls it from a function compiled with AVX-512, from one compiled with AVX2 and FMA, and from
//! one compiled for the baseline of the target. Every generic function on the way must be
//! `#[inline(always)]`, so that it is compiled with the features of the function that calls it.
//!
//! The vector types of the instruction sets are private to [`isa`], and an [`Isa`] comes only from
//! detection. Safe code therefore cannot run an instruction that the processor lacks.

mod isa;
mod traits;
mod vector;

#[cfg(test)]
mod tests;

pub(crate) use isa::{Isa, Kernel};
pub(crate) use traits::{Float, Float8, LANES, Mask, Word};
pub(crate) use vector::V3;
