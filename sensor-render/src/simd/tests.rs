//! Every instruction set computes the same values as plain arithmetic.

use super::{Float, Isa, Kernel, LANES, Mask, Word};

const A: [f32; LANES] =
    [0.0, 1.0, -1.0, 2.5, -2.5, 0.1, 1e6, -1e6, 3.99, -3.99, 7.0, 8.0, 9.0, -0.5, 0.5, 100.25];
const B: [f32; LANES] =
    [1.0, -1.0, 4.0, 2.5, 0.5, 10.0, 1e-3, 3.0, -2.0, 2.0, 7.0, -8.0, 0.25, 0.5, -0.5, 3.0];

/// Compares every operation with plain arithmetic; returns the name of the vector type.
#[inline(always)]
fn check<F: Float>() -> &'static str {
    let (a, b) = (F::from_array(A), F::from_array(B));
    let lanes =
        |f: &dyn Fn(f32, f32) -> f32| -> [f32; LANES] { std::array::from_fn(|i| f(A[i], B[i])) };
    assert_eq!((a + b).to_array(), lanes(&|a, b| a + b));
    assert_eq!((a - b).to_array(), lanes(&|a, b| a - b));
    assert_eq!((a * b).to_array(), lanes(&|a, b| a * b));
    assert_eq!((a / b).to_array(), lanes(&|a, b| a / b));
    assert_eq!((-a).to_array(), lanes(&|a, _| -a));
    assert_eq!(a.min(b).to_array(), lanes(&f32::min));
    assert_eq!(a.max(b).to_array(), lanes(&f32::max));
    assert_eq!(a.abs().to_array(), lanes(&|a, _| a.abs()));
    assert_eq!(a.abs().sqrt().to_array(), lanes(&|a, _| a.abs().sqrt()));
    assert_eq!(a.floor().to_array(), lanes(&|a, _| a.floor()));
    assert_eq!(a.largest(), 1e6);
    assert_eq!(a.smallest(), -1e6);
    for (got, wanted) in a.mul_add(b, a).to_array().iter().zip(lanes(&|a, b| a * b + a)) {
        assert!((got - wanted).abs() <= 1e-5 * wanted.abs().max(1.0));
    }
    let bits = |f: &dyn Fn(f32, f32) -> bool| {
        (0..LANES).fold(0u16, |bits, i| bits | u16::from(f(A[i], B[i])) << i)
    };
    assert_eq!(a.lt(b).bits(), bits(&|a, b| a < b));
    assert_eq!(a.ge(b).bits(), bits(&|a, b| a >= b));
    assert_eq!((!a.ge(b)).bits(), bits(&|a, b| a < b));
    assert_eq!((a.ge(b) & b.ge(a)).bits(), bits(&|a, b| a == b));
    let mask = F::Mask::from_bits(0b1010_0101_1100_0011);
    assert_eq!(mask.bits(), 0b1010_0101_1100_0011);
    assert_eq!(a.or(mask, b).to_array()[..4], [A[0], A[1], B[2], B[3]]);

    let words: [u32; LANES] = std::array::from_fn(|i| 0x9e37_79b9u32.wrapping_mul(i as u32 + 1));
    let w = F::Word::from_array(words);
    let seven = F::Word::splat(7);
    assert_eq!((w * seven + w).to_array(), words.map(|w| w.wrapping_mul(8)));
    assert_eq!((w ^ seven).to_array(), words.map(|w| w ^ 7));
    assert_eq!((w & seven | seven).to_array(), [7; LANES]);
    assert_eq!(w.shr::<13>().to_array(), words.map(|w| w >> 13));
    assert_eq!(w.shl::<5>().to_array(), words.map(|w| w << 5));
    assert_eq!(w.eq(F::Word::splat(words[3])).bits(), 1 << 3);
    assert_eq!(w.or(mask, seven).to_array()[..4], [words[0], words[1], 7, 7]);
    assert_eq!(w.shr::<9>().to_float().to_array(), words.map(|w| (w >> 9) as f32));
    assert_eq!(a.to_int().to_array(), A.map(|a| a as i32 as u32));
    assert_eq!(a.bits().as_float().to_array(), A);
    std::any::type_name::<F>()
}

struct Check;

impl Kernel for Check {
    type Output = &'static str;

    #[inline(always)]
    fn run<F: Float>(self) -> &'static str {
        check::<F>()
    }
}

#[test]
fn every_instruction_set_computes_the_same() {
    for isa in Isa::all() {
        assert!(!isa.run(Check).is_empty(), "{}", isa.name());
    }
}

#[test]
fn an_instruction_set_runs_only_where_the_processor_has_it() {
    let types: Vec<&str> = Isa::all().into_iter().map(|isa| isa.run(Check)).collect();
    let runs = |module: &str| types.iter().any(|name| name.contains(&format!("::{module}::")));
    assert!(runs("portable"));
    #[cfg(target_arch = "x86_64")]
    {
        let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        assert!(!runs("avx2") || has_avx2);
        assert!(!runs("avx512") || (has_avx2 && is_x86_feature_detected!("avx512f")));
    }
}

/// Safe functions of `avx2.rs` and `avx512.rs` run instructions that the processor may lack. They
/// are sound because only `isa.rs`, which detects the processor's features, can name their types,
/// and because only `isa.rs` can make an `Isa`.
#[test]
fn vector_types_and_the_detection_token_are_private_to_isa() {
    let isa = include_str!("isa.rs");
    for private in ["\nmod avx2;", "\nmod avx512;", "struct Isa(Level);", "\nenum Level {"] {
        assert!(isa.contains(private), "isa.rs has no line {private:?}");
    }
    assert!(!isa.contains("use avx"), "isa.rs exports no vector type");
    for text in [include_str!("isa/avx2.rs"), include_str!("isa/avx512.rs")] {
        assert!(!text.contains("pub(crate)") && !text.contains("pub struct"));
    }
}

/// A function without `#[inline(always)]` on the way from [`Isa::run`], or a closure with a vector in it, is
/// compiled without the instruction set: it calls a function for each vector instruction. A quarter of
/// the time of a camera was once spent so.
#[test]
#[cfg(all(target_os = "linux", target_arch = "x86_64", not(debug_assertions)))]
fn every_vector_instruction_is_inlined() {
    let program = std::fs::read("/proc/self/exe").unwrap();
    let names = symbol_names(&program);
    let has = |name: &str| names.windows(name.len()).any(|part| part == name.as_bytes());
    assert!(has("omnibus_sensor_render"), "the program has no symbols");
    let called = |name: &[u8]| {
        let name = String::from_utf8_lossy(name).into_owned();
        (name.contains("core_arch") && name.contains("_mm")).then_some(name)
    };
    let called: Vec<_> = names.split(|byte| *byte == 0).filter_map(called).collect();
    assert!(called.is_empty(), "functions of their own: {called:#?}");
}

/// Returns the names of the symbols of a 64-bit ELF file, separated by zeros; no bytes if it has none.
#[cfg(all(target_os = "linux", target_arch = "x86_64", not(debug_assertions)))]
fn symbol_names(elf: &[u8]) -> &[u8] {
    let number = |at: usize, len: usize| {
        let bytes = &elf[at..at + len];
        bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte))
    };
    // Fields of the header and of the section headers: System V ABI, chapter 4.
    const SYMTAB: usize = 2;
    let (headers, size, count) = (number(0x28, 8), number(0x3a, 2), number(0x3c, 2));
    let header = |section: usize| headers + section * size;
    let symbols = (0..count).find(|section| number(header(*section) + 4, 4) == SYMTAB);
    let Some(symbols) = symbols else { return &[] };
    let names = header(number(header(symbols) + 40, 4));
    let (offset, len) = (number(names + 24, 8), number(names + 32, 8));
    &elf[offset..offset + len]
}
