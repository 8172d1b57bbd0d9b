//! Reads OpenDRIVE text into records. References between parts of the file are resolved by
//! [`crate::build`].

mod elements;
mod junctions;
mod lanes;
mod objects;
mod roadrunner;
mod roads;
mod signals;

use glam::DVec3;

use crate::{
    MapError,
    records::{Header, Owner, Records},
    xml::{Cursor, line_of},
};
use elements::anywhere;

/// Reads a whole file in up to `threads` parts at once. The result does not depend on their number.
pub(crate) fn records(text: &str, threads: usize) -> Result<Records, MapError> {
    let borders = borders(text, threads);
    let Some((first, later)) = borders.split_first() else { return alone(text) };
    let ends = || later.iter().copied().chain([usize::MAX]);
    std::thread::scope(|scope| {
        let helpers: Vec<_> = borders
            .iter()
            .zip(ends())
            .map(|(&from, end)| {
                std::thread::Builder::new()
                    .name("road-parse".to_string())
                    .spawn_scoped(scope, move || part(Cursor::within(text, from, ROOT), end))
            })
            .collect();
        let mut whole = part(Cursor::new(text), *first)?;
        for (helper, from) in helpers.into_iter().zip(&borders) {
            // A part that did not stop at the border shows that no road begins there, only
            // something that looks like one. The parts after the border are useless then.
            if whole.ended != *from {
                return alone(text);
            }
            let next = helper.ok().and_then(|helper| helper.join().ok());
            let Some(next) = next else { return alone(text) };
            whole.append(next?);
        }
        complete(whole, text)
    })
}

/// Returns byte offsets at which a road seems to begin, so that the parts between them have about
/// equal lengths.
fn borders(text: &str, threads: usize) -> Vec<usize> {
    let parts = threads.min(text.len() / PART_BYTES_MIN).max(1);
    let mut borders: Vec<usize> = Vec::new();
    for part in 1..parts {
        let from = text.len() / parts * part;
        let from = (from..).find(|at| text.is_char_boundary(*at)).unwrap_or(text.len());
        let Some(at) = text[from..].find("<road ") else { break };
        if borders.last().is_none_or(|last| from + at > *last) {
            borders.push(from + at);
        }
    }
    borders
}

/// Smallest part for which a thread is worthwhile, bytes.
const PART_BYTES_MIN: usize = 200_000;

const ROOT: &str = "OpenDRIVE";

fn alone(text: &str) -> Result<Records, MapError> {
    complete(part(Cursor::new(text), usize::MAX)?, text)
}

/// Reads elements of the root from the cursor to the first one that begins at or after `end`.
fn part(mut xml: Cursor, end: usize) -> Result<Records, MapError> {
    let mut records = Records::default();
    if xml.depth() == 0 && !enter(&mut xml)? {
        return Ok(records);
    }
    loop {
        let root = xml.depth();
        while let Some(name) = xml.child(root)? {
            if xml.offset() >= end {
                records.ended = xml.offset();
                return Ok(records);
            }
            match name {
                "header" => records.header = header(&mut xml)?,
                "road" => roads::road(&mut xml, &mut records)?,
                "controller" => {
                    let controller = junctions::controller(&mut xml)?;
                    records.controllers.push(controller);
                }
                "junction" => {
                    let junction = junctions::junction(&mut xml, &mut records)?;
                    records.junctions.push(junction);
                }
                "junctionGroup" => {
                    let group = junctions::group(&mut xml)?;
                    records.groups.push(group);
                }
                _ => anywhere(&xml, name, Owner::Map, &mut records),
            }
        }
        if !enter(&mut xml)? {
            return Ok(records);
        }
    }
}

/// Enters the root element; returns `false` if there is none.
pub(crate) fn enter(xml: &mut Cursor) -> Result<bool, MapError> {
    match xml.child(0)? {
        None => Ok(false),
        Some(ROOT) => Ok(true),
        Some(name) => Err(xml.error(format!("the root element is <{name}>, not <{ROOT}>"))),
    }
}

/// Returns the records, or an error if they contain no road.
fn complete(records: Records, text: &str) -> Result<Records, MapError> {
    if !records.roads.is_empty() {
        return Ok(records);
    }
    let reason = if text.contains("<OpenDRIVE") {
        "the file has no roads"
    } else {
        "there is no <OpenDRIVE> element; is this an OpenDRIVE file?"
    };
    Err(MapError { line: line_of(text, text.len().saturating_sub(1)), reason: reason.to_string() })
}

fn header(xml: &mut Cursor) -> Result<Header, MapError> {
    let revision = |key: &str| xml.raw(key).and_then(|text| text.trim().parse().ok()).unwrap_or(0);
    let mut header = Header {
        revision: (revision("revMajor"), revision("revMinor")),
        name: xml.string("name"),
        vendor: xml.string("vendor"),
        ..Header::default()
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "geoReference" => header.geo_reference = xml.content()?,
            "license" => header.license = xml.string("name"),
            "offset" => {
                header.offset_m = DVec3::new(
                    xml.number_or("x", 0.0)?,
                    xml.number_or("y", 0.0)?,
                    xml.number_or("z", 0.0)?,
                );
                header.offset_heading_rad = xml.number_or("hdg", 0.0)?;
            }
            _ => {}
        }
    }
    Ok(header)
}
