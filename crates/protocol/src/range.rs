//! Checks of numbers that clients send.

/// Checks that a number is in its range.
pub(crate) fn within(what: &str, value: f32, low: f32, high: f32) -> Result<(), String> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(format!("{what} is {value}, not {low} to {high}"))
}

/// Checks that every number of a list is in its range.
pub(crate) fn each(what: &str, values: &[f32], low: f32, high: f32) -> Result<(), String> {
    values.iter().try_for_each(|value| within(what, *value, low, high))
}
