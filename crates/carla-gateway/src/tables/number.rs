//! Numbers and dates in the formats of C's standard library.

/// Returns a number as `%g`: six significant digits without trailing zeros.
pub(crate) fn general(value: impl Into<f64>) -> String {
    let value = value.into();
    if value == 0.0 || !value.is_finite() {
        return if value.is_nan() { "nan".to_owned() } else { format!("{value}") };
    }
    let rounded = format!("{value:.5e}");
    let (digits, exponent) = rounded.split_once('e').unwrap_or((&rounded, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trim = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-4..6).contains(&exponent) {
        return trim(&format!("{value:.*}", (5 - exponent) as usize));
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", trim(digits), exponent.abs())
}

/// Returns seconds since 1970 as `%x %X` in the C locale, in UTC.
pub(crate) fn date(secs: u64) -> String {
    let (days, second) = ((secs / 86_400) as i64, secs % 86_400);
    // Howard Hinnant, "chrono-compatible low-level date algorithms", `civil_from_days`: years begin
    // in March.
    let day = days + 719_468;
    let era = day.div_euclid(146_097);
    let of_era = day.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let (day, month) =
        (of_year - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{month:02}/{day:02}/{:02} {hour:02}:{minute:02}:{second:02}", year % 100)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_format_of_printf_g() {
        for (value, text) in [
            (0.0, "0"),
            (46.0, "46"),
            (0.0254253, "0.0254253"),
            (-8409.51, "-8409.51"),
            (382.0009, "382.001"),
            (1234567.0, "1.23457e+06"),
            (0.00001234, "1.234e-05"),
            (999999.6, "1e+06"),
            (100000.0, "100000"),
        ] {
            assert_eq!(general(value), text);
        }
    }

    #[test]
    fn dates_have_the_format_of_strftime() {
        assert_eq!(date(0), "01/01/70 00:00:00");
        assert_eq!(date(1_550_745_980), "02/21/19 10:46:20");
        assert_eq!(date(1_709_164_799), "02/28/24 23:59:59");
        assert_eq!(date(1_709_251_199), "02/29/24 23:59:59");
    }
}
