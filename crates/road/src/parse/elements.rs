//! Elements that occur in several places of a file.

use crate::{
    MapError,
    cubic::{Cubic, Profile},
    records::{Owner, Records, UserData},
    xml::Cursor,
};

/// Reads elements that may occur anywhere: user data and includes.
pub(super) fn anywhere(xml: &Cursor, name: &str, owner: Owner, records: &mut Records) {
    match name {
        "userData" => {
            if let Some(code) = xml.raw("code").filter(|code| !code.is_empty()) {
                let (code, value) = (code.to_string(), xml.string("value"));
                records.user_data.push(UserData { owner, code, value });
            }
        }
        "include" => records.includes.push((xml.string("file"), xml.offset())),
        _ => {}
    }
}

/// Returns the limit of a speed record in metres per second, from `max` and `unit`.
pub(super) fn limit(xml: &Cursor) -> Result<Option<f64>, MapError> {
    let max = xml.raw("max").unwrap_or_default().trim();
    if matches!(max, "" | "no limit" | "undefined") {
        return Ok(None);
    }
    let factor = match xml.raw("unit").unwrap_or("m/s") {
        "km/h" => 1.0 / 3.6,
        "mph" => 0.44704,
        _ => 1.0,
    };
    Ok(Some(xml.number("max")? * factor))
}

/// Reads all children called `name` of the current element.
pub(super) fn cubics(xml: &mut Cursor, name: &str, from: &str) -> Result<Profile, MapError> {
    let mut pieces = Vec::new();
    let here = xml.depth();
    while let Some(child) = xml.child(here)? {
        if child == name {
            pieces.push(cubic(xml, from)?);
        }
    }
    Ok(Profile::new(pieces))
}

/// Reads coefficients a, b, c, d and the start of the current element.
pub(super) fn cubic(xml: &Cursor, from: &str) -> Result<Cubic, MapError> {
    Ok(Cubic {
        from_m: xml.number_or(from, 0.0)?,
        factors: [
            xml.number_or("a", 0.0)?,
            xml.number_or("b", 0.0)?,
            xml.number_or("c", 0.0)?,
            xml.number_or("d", 0.0)?,
        ],
    })
}

/// Reads the lane ids of a `<validity>`, the lower one first.
pub(super) fn validity(xml: &Cursor) -> Result<(i32, i32), MapError> {
    let (from, to) = (xml.integer("fromLane")?, xml.integer("toLane")?);
    Ok((from.min(to), from.max(to)))
}
