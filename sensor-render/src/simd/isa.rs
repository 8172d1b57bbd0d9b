#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

use crate::simd::traits::Float;

/// An instruction set that this processor has.
///
/// Its field is private, so that detection is the only source: safe code cannot make an `Isa` that
/// the processor lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Isa(Level);

/// Instruction sets that the tracer is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Level {
    /// AVX-512 F, BW, DQ and VL, and everything in `Avx2`.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    /// AVX2, FMA, BMI1, BMI2, POPCNT and LZCNT.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// The baseline that the program is compiled for.
    Portable,
}

/// Work that is compiled once for each instruction set.
pub(crate) trait Kernel {
    /// Result of the work.
    type Output;

    /// Does the work with sixteen lanes of type `F`. Implementations are `#[inline(always)]`.
    fn run<F: Float>(self) -> Self::Output;
}

impl Isa {
    /// Returns the best instruction set that this processor has.
    pub(crate) fn detect() -> Isa {
        Isa::all()[0]
    }

    /// Returns all instruction sets that this processor has, the best first.
    pub(crate) fn all() -> Vec<Isa> {
        let mut all = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("fma")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("popcnt")
                && is_x86_feature_detected!("lzcnt");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            if avx2 && avx512 {
                all.push(Isa(Level::Avx512));
            }
            if avx2 {
                all.push(Isa(Level::Avx2));
            }
        }
        all.push(Isa(Level::Portable));
        all
    }

    /// Returns the name that is shown to users.
    pub(crate) fn name(self) -> &'static str {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => "AVX-512",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "AVX2",
            Level::Portable => "portable code",
        }
    }

    /// Runs `kernel` compiled for this instruction set.
    pub(crate) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => {
                #[expect(unsafe_code, reason = "calls code with the features that were detected")]
                // SAFETY: an `Isa` comes from `Isa::all`, which makes this one only if it detected
                // every feature that `run_avx512` enables.
                unsafe {
                    run_avx512(kernel)
                }
            }
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => {
                #[expect(unsafe_code, reason = "calls code with the features that were detected")]
                // SAFETY: an `Isa` comes from `Isa::all`, which makes this one only if it detected
                // every feature that `run_avx2` enables.
                unsafe {
                    run_avx2(kernel)
                }
            }
            Level::Portable => kernel.run::<portable::F32x16>(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx512::F32x16>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx2::F32x16>()
}
