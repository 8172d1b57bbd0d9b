//! Percentiles of measured times.

/// Returns the time that the fraction `share` of all measurements did not exceed, in milliseconds.
///
/// `sorted` holds nanoseconds in rising order, at least one.
pub(crate) fn percentile_ms(sorted: &[u64], share: f64) -> f64 {
    let index = (sorted.len() as f64 * share).ceil() as usize;
    sorted[index.clamp(1, sorted.len()) - 1] as f64 / 1e6
}
