//! Positions of a map's parts in its text, and faults of each part by itself.

use std::collections::HashMap;

use super::{report::Report, words};
use crate::{MapError, xml::Cursor};

/// Positions in the whole file. Roads are in the order of the file, and so are the parts of each.
#[derive(Default)]
pub(super) struct Positions {
    pub(super) roads: Vec<RoadPositions>,
    pub(super) junctions: Vec<JunctionPositions>,
}

#[derive(Default)]
pub(super) struct RoadPositions {
    pub(super) offset: usize,
    /// As declared in the file, metres.
    pub(super) length_m: f64,
    pub(super) geometries: Vec<usize>,
    pub(super) elevations: Vec<usize>,
    pub(super) sections: Vec<SectionPositions>,
}

#[derive(Default)]
pub(super) struct SectionPositions {
    pub(super) offset: usize,
    /// Lane ids and their byte offsets.
    pub(super) lanes: Vec<(i32, usize)>,
}

#[derive(Default)]
pub(super) struct JunctionPositions {
    pub(super) offset: usize,
    pub(super) connections: Vec<usize>,
}

impl SectionPositions {
    pub(super) fn lane(&self, id: i32) -> usize {
        self.lanes.iter().find(|lane| lane.0 == id).map_or(self.offset, |lane| lane.1)
    }
}

/// Deepest nesting of elements that is read.
const DEPTH_MAX: usize = 16;

/// Lists of records that must be in rising order of an attribute.
const LISTS: [(&str, &str); 10] = [
    ("elevation", "s"),
    ("superelevation", "s"),
    ("laneOffset", "s"),
    ("width", "sOffset"),
    ("border", "sOffset"),
    ("height", "sOffset"),
    ("roadMark", "sOffset"),
    ("speed", "sOffset"),
    ("material", "sOffset"),
    ("type", "s"),
];

/// Elements whose ids must be unique among their kind.
const WITH_ID: [&str; 5] = ["junction", "signal", "controller", "object", "junctionGroup"];

impl Positions {
    pub(super) fn read(text: &str, report: &mut Report) -> Result<Positions, MapError> {
        let mut xml = Cursor::new(text);
        let mut reader = Reader { positions: Positions::default(), report, ids: HashMap::new() };
        reader.children(&mut xml, "")?;
        Ok(reader.positions)
    }
}

struct Reader<'a, 'r> {
    positions: Positions,
    report: &'r mut Report,
    /// Kind and id, with the byte offset of the first occurrence.
    ids: HashMap<(&'static str, &'a str), usize>,
}

impl<'a> Reader<'a, '_> {
    fn children(&mut self, xml: &mut Cursor<'a>, parent: &str) -> Result<(), MapError> {
        let here = xml.depth();
        if here > DEPTH_MAX {
            return Ok(());
        }
        let mut last: [(f64, usize); LISTS.len()] = [(f64::NEG_INFINITY, 0); LISTS.len()];
        while let Some(name) = xml.child(here)? {
            words::check(xml, parent, name, self.report);
            if let Some(list) = LISTS.iter().position(|list| list.0 == name)
                && let Ok(Some(at)) = xml.optional_number(LISTS[list].1)
            {
                if at < last[list].0 {
                    let reason = format!(
                        "a <{name}> begins at {} {at}, after one that begins at {}",
                        LISTS[list].1, last[list].0
                    );
                    self.report.error(xml.offset(), reason);
                }
                last[list].0 = at;
            }
            self.record(xml, parent, name)?;
            self.children(xml, name)?;
        }
        Ok(())
    }

    fn record(&mut self, xml: &Cursor<'a>, parent: &str, name: &str) -> Result<(), MapError> {
        let offset = xml.offset();
        // Inside a junction, a controller is a reference.
        let is_reference = parent == "junction";
        if let Some(kind) = WITH_ID.into_iter().find(|kind| *kind == name && !is_reference)
            && let Some(id) = xml.raw("id").filter(|id| !id.is_empty())
        {
            let seen = self.ids.insert((kind, id), offset).is_some();
            match (seen, kind) {
                (true, "object") => {
                    self.report.warn(offset, format!("duplicate object id {id}"));
                }
                (true, _) => self.report.error(offset, format!("duplicate {kind} id {id}")),
                _ => {}
            }
        }
        let number = |key: &str| xml.optional_number(key).ok().flatten();
        let at_junction = self.positions.junctions.last_mut();
        match (name, parent) {
            ("road", "OpenDRIVE") => {
                let length_m = number("length").unwrap_or(0.0);
                self.positions.roads.push(RoadPositions {
                    offset,
                    length_m,
                    ..RoadPositions::default()
                });
                return Ok(());
            }
            ("junction", "OpenDRIVE") => {
                self.positions
                    .junctions
                    .push(JunctionPositions { offset, connections: Vec::new() });
                return Ok(());
            }
            ("connection", "junction") => {
                at_junction.into_iter().for_each(|place| place.connections.push(offset));
                return Ok(());
            }
            _ => {}
        }
        let Some(road) = self.positions.roads.last_mut() else { return Ok(()) };
        match (name, parent) {
            ("geometry", _) => road.geometries.push(offset),
            ("elevation", _) => road.elevations.push(offset),
            ("laneSection", _) => {
                road.sections.push(SectionPositions { offset, lanes: Vec::new() });
                let start = number("s").unwrap_or(0.0);
                if start > road.length_m + 0.01 {
                    let reason = format!(
                        "a lane section begins at s {start}, but its road is {} m long",
                        road.length_m
                    );
                    self.report.error(offset, reason);
                }
            }
            ("lane", "left" | "center" | "right") => {
                if let Some(section) = road.sections.last_mut() {
                    section.lanes.push((xml.integer("id")?, offset));
                }
            }
            ("signal" | "signalReference", "signals") | ("object", "objects") => {
                let at = number("s").unwrap_or(0.0);
                if !(-0.01..=road.length_m + 0.01).contains(&at) {
                    let id = xml.raw("id").unwrap_or_default();
                    let what = if name == "signalReference" { "reference to signal" } else { name };
                    let reason = format!(
                        "{what} {id} is at s {at}, but its road is {} m long",
                        road.length_m
                    );
                    self.report.warn(offset, reason);
                }
            }
            ("bridge" | "tunnel", "objects") => {
                let end = number("s").unwrap_or(0.0) + number("length").unwrap_or(0.0);
                if end > road.length_m + 0.1 {
                    let reason = format!(
                        "a {name} ends at s {end}, but its road is {} m long",
                        road.length_m
                    );
                    self.report.warn(offset, reason);
                }
            }
            _ => {}
        }
        Ok(())
    }
}
