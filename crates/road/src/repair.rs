//! Repairs a map's text for programs that compute positions in single precision.
//!
//! A lane section shorter than a millimetre begins and ends in one point there. Such a section is
//! lengthened to a millimetre at the cost of its neighbour, and a road shorter than that is
//! lengthened itself. Every point of a reference line stays within a millimetre, and no link changes.

use std::ops::Range;

use crate::{MapError, parse, xml::Cursor};

/// Shortest lane section of a repaired text, metres.
const SECTION_MIN_M: f64 = 1e-3;
/// The share of it below which a section is short. The difference of two decimals is not exact.
const TOLERANCE: f64 = 0.999;
/// A lane shorter than this that nothing follows has its start and its end in one waypoint of
/// CARLA's library, metres. Such lanes were observed with 5 mm, and not with 8 mm.
const DEAD_END_MIN_M: f64 = 1e-2;

/// A repaired text, and how much was repaired.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The text.
    pub text: String,
    /// Number of lane sections that were shorter than a millimetre.
    pub sections: usize,
    /// Number of driving lanes shorter than a centimetre and without links, which are now of type
    /// `none`.
    pub lanes: usize,
}

/// A number in the text.
struct Number {
    range: Range<usize>,
    value: f64,
}

/// The parts of a road that a repair may change.
struct Road<'a> {
    length: Number,
    /// Start and length of the last geometry.
    geometry: Option<(f64, Number)>,
    /// The ranges of the attributes of the last geometry's parametric cubic, by name.
    cubic: Vec<(&'a str, Range<usize>)>,
    /// Records of the lane offset: the start, and the ranges of the factors b, c and d.
    offsets: Vec<(Number, Vec<Range<usize>>)>,
    sections: Vec<Section>,
}

struct Section {
    start: Number,
    /// The ranges of the factors b, c and d of widths and borders.
    slopes: Vec<Range<usize>>,
    /// The ranges of the types of driving lanes without links.
    unlinked: Vec<Range<usize>>,
}

type Edits = Vec<(Range<usize>, String)>;

/// Returns a text without lane sections shorter than a millimetre, or `None` if there are none.
///
/// # Errors
///
/// Returns an error if the text is not OpenDRIVE.
pub fn repair(text: &str) -> Result<Option<Repair>, MapError> {
    let mut edits = Edits::new();
    let mut repair = Repair { text: String::new(), sections: 0, lanes: 0 };
    let mut xml = Cursor::new(text);
    while parse::enter(&mut xml)? {
        let root = xml.depth();
        while let Some(name) = xml.child(root)? {
            if name == "road" {
                let road = read(&mut xml, text)?;
                repair.sections += lengthen(&road, &mut edits);
                repair.lanes += close(&road, &mut edits);
            }
        }
    }
    if repair.sections + repair.lanes == 0 {
        return Ok(None);
    }
    edits.sort_by_key(|(range, _)| range.start);
    let mut done = 0;
    for (range, replacement) in edits {
        repair.text.push_str(&text[done..range.start]);
        repair.text.push_str(&replacement);
        done = range.end;
    }
    repair.text.push_str(&text[done..]);
    Ok(Some(repair))
}

/// Returns where an attribute of the current element is in the text.
fn range_of(xml: &Cursor, key: &str, text: &str) -> Option<Range<usize>> {
    let raw = xml.raw(key)?;
    let start = raw.as_ptr().addr() - text.as_ptr().addr();
    Some(start..start + raw.len())
}

fn number(xml: &Cursor, key: &str, text: &str) -> Result<Number, MapError> {
    let value = xml.number(key)?;
    Ok(Number { range: range_of(xml, key, text).unwrap_or_default(), value })
}

fn slopes(xml: &Cursor, text: &str) -> impl Iterator<Item = Range<usize>> {
    ["b", "c", "d"].into_iter().filter_map(|key| range_of(xml, key, text))
}

fn read<'a>(xml: &mut Cursor<'a>, text: &'a str) -> Result<Road<'a>, MapError> {
    let mut road = Road {
        length: number(xml, "length", text)?,
        geometry: None,
        cubic: Vec::new(),
        offsets: Vec::new(),
        sections: Vec::new(),
    };
    let inside = xml.depth();
    while let Some(name) = xml.child(inside)? {
        let here = xml.depth();
        match name {
            "planView" => {
                while let Some(name) = xml.child(here)? {
                    if name == "geometry" {
                        read_geometry(xml, &mut road, text)?;
                    }
                }
            }
            "lanes" => {
                while let Some(name) = xml.child(here)? {
                    match name {
                        "laneOffset" => {
                            let factors = slopes(xml, text).collect();
                            road.offsets.push((number(xml, "s", text)?, factors));
                        }
                        "laneSection" => {
                            let section = read_section(xml, text)?;
                            road.sections.push(section);
                        }
                        _ => {}
                    }
                }
            }
            _ => {}
        }
    }
    Ok(road)
}

fn read_geometry<'a>(
    xml: &mut Cursor<'a>,
    road: &mut Road<'a>,
    text: &'a str,
) -> Result<(), MapError> {
    road.geometry = Some((xml.number("s")?, number(xml, "length", text)?));
    road.cubic.clear();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "paramPoly3" {
            let keys = ["pRange", "bU", "cU", "dU", "bV", "cV", "dV"];
            let ranges = keys.into_iter().filter_map(|key| Some((key, range_of(xml, key, text)?)));
            road.cubic = ranges.collect();
        }
    }
    Ok(())
}

fn read_section(xml: &mut Cursor, text: &str) -> Result<Section, MapError> {
    let mut section =
        Section { start: number(xml, "s", text)?, slopes: Vec::new(), unlinked: Vec::new() };
    let inside = xml.depth();
    while xml.child(inside)?.is_some() {
        let side = xml.depth();
        while let Some(name) = xml.child(side)? {
            if name == "lane" {
                read_lane(xml, &mut section, text)?;
            }
        }
    }
    Ok(section)
}

fn read_lane(xml: &mut Cursor, section: &mut Section, text: &str) -> Result<(), MapError> {
    let kind = range_of(xml, "type", text).filter(|_| xml.raw("type") == Some("driving"));
    let mut is_linked = false;
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "link" => {
                let inside = xml.depth();
                while xml.child(inside)?.is_some() {
                    is_linked = true;
                }
            }
            "width" | "border" => section.slopes.extend(slopes(xml, text)),
            _ => {}
        }
    }
    section.unlinked.extend(kind.filter(|_| !is_linked));
    Ok(())
}

/// Lengthens the short lane sections of a road and returns their number.
fn lengthen(road: &Road, edits: &mut Edits) -> usize {
    let starts: Vec<f64> = road.sections.iter().map(|section| section.start.value).collect();
    let ends = starts.iter().skip(1).copied().chain([road.length.value]);
    let is_short: Vec<bool> = starts
        .iter()
        .zip(ends)
        .map(|(start, end)| end - start < TOLERANCE * SECTION_MIN_M)
        .collect();
    let count = is_short.iter().filter(|short| **short).count();
    if count == 0 {
        return 0;
    }
    let (moved, length_m) = spread(&starts, road.length.value);
    let mut set = |number: &Number, value: f64| {
        if number.value != value {
            edits.push((number.range.clone(), value.to_string()));
        }
    };
    for (section, start) in road.sections.iter().zip(&moved) {
        set(&section.start, *start);
    }
    // An offset that begins with a section moves with it.
    let mut last = 0.0_f64;
    for (start, _) in &road.offsets {
        let at = starts.partition_point(|other| *other <= start.value).max(1) - 1;
        let begins = starts[at] == start.value;
        let value = if begins { moved[at] } else { start.value.max(moved[at]) };
        last = last.max(value);
        set(start, last);
    }
    if length_m > road.length.value {
        set(&road.length, length_m);
        if let Some((from_m, length)) = &road.geometry {
            set(length, length_m - from_m);
            straighten(&road.cubic, length_m - from_m, edits);
        }
    }
    // What changes over a short section would change without limit over a longer one.
    let constant = |range: &Range<usize>| (range.clone(), "0".to_owned());
    for (section, _) in road.sections.iter().zip(&is_short).filter(|(_, short)| **short) {
        edits.extend(section.slopes.iter().map(constant));
    }
    for (index, (start, factors)) in road.offsets.iter().enumerate() {
        let end = road.offsets.get(index + 1).map_or(road.length.value, |(next, _)| next.value);
        if end - start.value < TOLERANCE * SECTION_MIN_M {
            edits.extend(factors.iter().map(constant));
        }
    }
    count
}

/// Returns the starts of a road's sections and its length so that no section is shorter than a
/// millimetre. A short section begins earlier; at the start of the road, the next one begins later.
fn spread(starts: &[f64], length_m: f64) -> (Vec<f64>, f64) {
    let mut moved = starts.to_vec();
    let mut end = length_m;
    for start in moved.iter_mut().rev() {
        *start = start.min(end - SECTION_MIN_M);
        end = *start;
    }
    let mut from = starts.first().copied().unwrap_or_default();
    for start in &mut moved {
        *start = start.max(from);
        from = *start + SECTION_MIN_M;
    }
    (moved, length_m.max(from))
}

/// Makes a parametric cubic a line of this length, along its own axis.
fn straighten(cubic: &[(&str, Range<usize>)], length_m: f64, edits: &mut Edits) {
    for (key, range) in cubic {
        let value = match *key {
            "pRange" => "normalized".to_owned(),
            "bU" => length_m.to_string(),
            _ => "0".to_owned(),
        };
        edits.push((range.clone(), value));
    }
}

/// Makes short driving lanes without links lanes of no type, and returns their number.
fn close(road: &Road, edits: &mut Edits) -> usize {
    let before = edits.len();
    for (index, section) in road.sections.iter().enumerate() {
        let end = road.sections.get(index + 1).map_or(road.length.value, |next| next.start.value);
        if end - section.start.value < DEAD_END_MIN_M {
            edits.extend(section.unlinked.iter().map(|range| (range.clone(), "none".to_owned())));
        }
    }
    edits.len() - before
}
