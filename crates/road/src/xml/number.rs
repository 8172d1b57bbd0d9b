//! Decimal numbers, parsed exactly where that is cheap.

/// Returns the number if it is so plain that one multiplication or division gives the nearest f64
/// (Clinger, "How to read floating point numbers accurately", 1990); `None` if only the general
/// algorithm can decide.
pub(super) fn decimal(text: &[u8]) -> Option<f64> {
    let (is_negative, text) = match text {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, text),
    };
    let mut at = 0;
    let mut mantissa = 0u64;
    while let Some(digit) = digit(text, at) {
        mantissa = 10u64.wrapping_mul(mantissa).wrapping_add(digit);
        at += 1;
    }
    let mut digits = at;
    let mut exponent = 0;
    if text.get(at) == Some(&b'.') {
        at += 1;
        let from = at;
        // Trailing zeros are not included.
        let mut whole = mantissa;
        while let Some(digit) = digit(text, at) {
            whole = 10u64.wrapping_mul(whole).wrapping_add(digit);
            at += 1;
            if digit != 0 {
                mantissa = whole;
                exponent = from as i32 - at as i32;
            }
        }
        digits += at - from;
    }
    // Eighteen digits always fit into 64 bits.
    if digits == 0 || digits > 18 {
        return None;
    }
    if let Some(b'e' | b'E') = text.get(at) {
        let (sign, from) = match text.get(at + 1) {
            Some(b'-') => (-1, at + 2),
            Some(b'+') => (1, at + 2),
            _ => (1, at + 1),
        };
        at = from;
        let mut power = 0;
        while let Some(digit) = digit(text, at).filter(|_| at < from + 4) {
            power = 10 * power + digit as i32;
            at += 1;
        }
        if at == from {
            return None;
        }
        exponent += sign * power;
    }
    if at != text.len() || mantissa > 1 << 53 {
        return None;
    }
    let number = mantissa as f64;
    let number = match exponent {
        0 => number,
        _ if mantissa == 0 => 0.0,
        1..=22 => number * POWERS[exponent as usize],
        -22..=-1 => number / POWERS[-exponent as usize],
        _ => return None,
    };
    Some(if is_negative { -number } else { number })
}

fn digit(text: &[u8], at: usize) -> Option<u64> {
    let digit = text.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

/// The powers of ten that an f64 represents exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

#[cfg(test)]
mod tests {
    use super::decimal;

    #[test]
    fn what_is_read_the_short_way_has_the_bits_of_the_long_way() {
        let mut texts: Vec<String> = [
            "0",
            "-0",
            "-0.0",
            "1",
            "0.1",
            "-3.25",
            "1e3",
            "1E-3",
            "4.0000000000000000e+0",
            "0.0000000000000000e+0",
            "9007199254740993",
            "9007199254740992",
            "123456789.123456789",
            "1e22",
            "1e23",
            "3.5e-22",
            "000.5",
            "5.",
            ".5",
            "1e",
            "",
            "-",
            ".",
            "e1",
            "+1",
            " 1",
            "1 ",
            "nan",
            "inf",
            "0x1",
            "1e400",
            "1e99999",
            "0e99999",
            "1.2.3",
            "--1",
            "99999999999999999999999999999999999999999999999999",
            "0.00000000000000000000000000000000000000000000001",
        ]
        .map(str::to_string)
        .to_vec();
        let mut state = 1u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let (digits, power) = (state >> 20, (state >> 7) % 25);
            let shift = state % 18;
            let number = digits as f64 / 10f64.powi(shift as i32);
            texts.push(format!("{number}"));
            texts.push(format!("-{number:e}"));
            texts.push(format!("{}.{}e-{power}", digits >> 40, digits & 0xffff));
        }
        let mut short = 0;
        for text in texts {
            let Some(ours) = decimal(text.as_bytes()) else { continue };
            short += 1;
            let long: f64 = text.parse().unwrap_or_else(|_| panic!("{text} is no number"));
            assert_eq!(ours.to_bits(), long.to_bits(), "{text}: {ours} for {long}");
        }
        assert!(short > 200_000, "{short} read the short way");
    }
}
