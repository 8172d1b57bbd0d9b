//! Attributes whose values the standard enumerates.

use super::report::Report;
use crate::{
    lane::LaneType,
    mark::{MarkColor, MarkKind},
    xml::Cursor,
};

/// Element, attribute, and its allowed values.
const LISTS: [(&str, &str, &[&str]); 20] = [
    ("road", "rule", &["RHT", "LHT"]),
    ("predecessor", "elementType", &["road", "junction"]),
    ("successor", "elementType", &["road", "junction"]),
    ("predecessor", "contactPoint", &["start", "end"]),
    ("successor", "contactPoint", &["start", "end"]),
    ("connection", "contactPoint", &["start", "end"]),
    ("connection", "type", &["default", "virtual"]),
    ("junction", "type", &["default", "direct", "virtual", "crossing"]),
    ("lane", "level", &["true", "false", "1", "0"]),
    ("lane", "direction", &["standard", "reversed", "both"]),
    ("roadMark", "weight", &["standard", "bold"]),
    ("roadMark", "laneChange", &["increase", "decrease", "both", "none"]),
    ("paramPoly3", "pRange", &["arcLength", "normalized"]),
    ("crossfall", "side", &["left", "right", "both"]),
    ("signal", "dynamic", &["yes", "no"]),
    ("signal", "orientation", &["+", "-", "none"]),
    ("signalReference", "orientation", &["+", "-", "none"]),
    ("object", "orientation", &["+", "-", "none"]),
    ("speed", "unit", &["m/s", "km/h", "mph"]),
    ("access", "rule", &["allow", "deny"]),
];

/// Allowed values of a road's `type`.
const ROADS: [&str; 17] = [
    "unknown",
    "rural",
    "motorway",
    "town",
    "lowSpeed",
    "pedestrian",
    "bicycle",
    "townExpressway",
    "townCollector",
    "townArterial",
    "townPrivate",
    "townLocal",
    "townPlayStreet",
    "townService",
    "slipLane",
    "ramp",
    "crossing",
];

/// Reports unknown values of the current element's attributes.
pub(super) fn check(xml: &Cursor, parent: &str, name: &str, report: &mut Report) {
    let mut unknown = |key: &str, word: &str, known: &[&str]| {
        let usual = if known.is_empty() {
            String::new()
        } else {
            format!("; known values are {}", known.join(", "))
        };
        let reason = format!("unknown value \"{word}\" of attribute {key} of <{name}>{usual}");
        report.warn(xml.offset(), reason);
    };
    for (element, key, known) in LISTS {
        if element == name
            && let Some(word) = xml.raw(key)
            && !known.contains(&word)
        {
            unknown(key, word, known);
        }
    }
    match (name, parent, xml.raw("type")) {
        ("lane", "left" | "center" | "right", Some(word))
            if LaneType::from_text(word).is_none() =>
        {
            unknown("type", word, &[]);
        }
        ("roadMark", "lane", Some(word))
            if MarkKind::from_text(word) == MarkKind::Other && word != "custom" =>
        {
            unknown("type", word, &[]);
        }
        ("type", "road", Some(word)) if !ROADS.contains(&word) => unknown("type", word, &[]),
        _ => {}
    }
    if name == "roadMark"
        && let Some(word) = xml.raw("color")
        && MarkColor::from_text(word) == MarkColor::Other
        && word != "other"
    {
        unknown("color", word, &[]);
    }
}
