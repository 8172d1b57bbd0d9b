/// Instruction sets that the tracer is compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    /// AVX-512 F, BW, DQ and VL. Made by [`Isa::detect`] alone, as is `Avx2`.
    Avx512,
    /// AVX2 and FMA.
    Avx2,
    /// Whatever the program is compiled for.
    Portable,
}

impl Isa {
    /// The best that this processor has.
    pub(crate) fn detect() -> Isa {
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
            if avx2 {
                return if avx512 { Isa::Avx512 } else { Isa::Avx2 };
            }
        }
        Isa::Portable
    }

    /// All that this processor has, the best first.
    #[cfg(test)]
    pub(crate) fn all() -> Vec<Isa> {
        let all = [Isa::Avx512, Isa::Avx2, Isa::Portable];
        let best = all.iter().position(|isa| *isa == Isa::detect()).unwrap_or(2);
        all[best..].to_vec()
    }

    /// In words.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Isa::Avx512 => "AVX-512",
            Isa::Avx2 => "AVX2",
            Isa::Portable => "portable code",
        }
    }
}

/// Makes `fn $name(isa: Isa, …)`, which runs the generic `$body::<F>(…)` compiled for `isa`.
macro_rules! on_each_isa {
    ($(#[$doc:meta])* fn $name:ident($($argument:ident: $type:ty),* $(,)?) = $body:path;) => {
        $(#[$doc])*
        pub(crate) fn $name(isa: $crate::lanes::Isa, $($argument: $type),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn avx512($($argument: $type),*) {
                use $body as body;
                body::<$crate::lanes::avx512::F>($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
            fn avx2($($argument: $type),*) {
                use $body as body;
                body::<$crate::lanes::avx2::F>($($argument),*)
            }
            fn portable($($argument: $type),*) {
                use $body as body;
                body::<$crate::lanes::portable::F>($($argument),*)
            }
            match isa {
                #[cfg(target_arch = "x86_64")]
                $crate::lanes::Isa::Avx512 => {
                    #[expect(unsafe_code, reason = "enables what was detected")]
                    // SAFETY: `Isa::Avx512` exists only where all that `avx512` enables was detected.
                    unsafe { avx512($($argument),*) }
                }
                #[cfg(target_arch = "x86_64")]
                $crate::lanes::Isa::Avx2 => {
                    #[expect(unsafe_code, reason = "enables what was detected")]
                    // SAFETY: `Isa::Avx2` exists only where all that `avx2` enables was detected.
                    unsafe { avx2($($argument),*) }
                }
                _ => portable($($argument),*),
            }
        }
    };
}

pub(crate) use on_each_isa;
