//! OpenDRIVE text into records, as the file says them; what refers to other parts of the file is
//! resolved by [`crate::build`].

mod junctions;
mod lanes;
mod objects;
mod roadrunner;
mod roads;
mod signals;

use crate::MapError;
use crate::lane::Lane;
use crate::object::{RoadObject, Span};
use crate::road::Road;
use crate::signal::Signal;
use crate::xml::{Cursor, line_of};
use glam::DVec3;

pub(crate) use junctions::{RawController, RawGroup, RawJunction};
pub(crate) use objects::RawObjectReference;
pub(crate) use roads::{BEYOND_M, RawLink};
pub(crate) use signals::RawReference;

/// Everything a file says.
#[derive(Default)]
pub(crate) struct Records {
    pub(crate) header: Header,
    pub(crate) roads: Vec<Road>,
    /// Beside `roads`.
    pub(crate) road_extras: Vec<RoadExtra>,
    pub(crate) lanes: Vec<Lane>,
    pub(crate) junctions: Vec<RawJunction>,
    pub(crate) signals: Vec<Signal>,
    pub(crate) references: Vec<RawReference>,
    pub(crate) controllers: Vec<RawController>,
    pub(crate) objects: Vec<RoadObject>,
    pub(crate) spans: Vec<Span>,
    pub(crate) object_references: Vec<RawObjectReference>,
    pub(crate) groups: Vec<RawGroup>,
    pub(crate) user_data: Vec<UserData>,
    /// Files that are to be read as well, and where that is said.
    pub(crate) includes: Vec<(String, usize)>,
    /// Where the first element stands that was left to others, in bytes.
    ended: usize,
}

/// What a road says of others.
#[derive(Default)]
pub(crate) struct RoadExtra {
    pub(crate) junction: Option<String>,
    pub(crate) predecessor: Option<RawLink>,
    pub(crate) successor: Option<RawLink>,
    /// The declared length, where the geometry ends well before it.
    pub(crate) too_long: Option<f64>,
    /// Where the road stands in the text, in bytes.
    pub(crate) offset: usize,
}

/// What the file says of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// OpenDRIVE's version, such as (1, 4).
    pub revision: (u32, u32),
    /// What the map is called.
    pub name: String,
    /// Who wrote it.
    pub vendor: String,
    /// The projection, a PROJ string; empty if none.
    pub geo_reference: String,
    /// Under which license the map may be used, by name.
    pub license: String,
    /// To be added to the file's coordinates to get projected ones, metres.
    pub offset_m: DVec3,
    /// To be added to the file's headings, about its origin.
    pub offset_heading_rad: f64,
}

/// A `<userData>` record with a code: something for a program that knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct UserData {
    /// Whose it is.
    pub owner: Owner,
    /// What it is.
    pub code: String,
    /// What it says.
    pub value: String,
}

/// What user data belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The whole map.
    Map,
    /// Which of [`crate::Network::roads`].
    Road(u32),
    /// Which of [`crate::Network::junctions`].
    Junction(u32),
}

/// Takes what may stand anywhere: user data and includes.
fn anywhere(xml: &Cursor, name: &str, owner: Owner, records: &mut Records) {
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

/// Reads a whole file, in so many parts at once; what comes out does not depend on how many.
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
            // Who did not stop at the border found that no road begins there, but that something
            // else only looks so; what lies behind it was read in vain.
            if whole.ended != *from {
                return alone(text);
            }
            let next = helper.ok().and_then(|helper| helper.join().ok());
            let Some(next) = next else { return alone(text) };
            whole.append(next?);
        }
        whole.complete(text)
    })
}

/// Places where a road seems to begin, so that the parts between them are about equally long.
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

/// Less is not worth a thread.
const PART_BYTES_MIN: usize = 200_000;

const ROOT: &str = "OpenDRIVE";

fn alone(text: &str) -> Result<Records, MapError> {
    part(Cursor::new(text), usize::MAX)?.complete(text)
}

/// Reads elements of the root from where the cursor stands to the one that begins at `end` or
/// behind it.
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

/// Steps into the root; not if there is none.
fn enter(xml: &mut Cursor) -> Result<bool, MapError> {
    match xml.child(0)? {
        None => Ok(false),
        Some(ROOT) => Ok(true),
        Some(name) => Err(xml.error(format!("the root element is <{name}>, not <{ROOT}>"))),
    }
}

impl Records {
    /// Adds what stands behind it in the file.
    fn append(&mut self, mut next: Records) {
        let (roads, lanes) = (self.roads.len() as u32, self.lanes.len() as u32);
        let junctions = self.junctions.len() as u32;
        for road in &mut next.roads {
            for lane in road.sections.iter_mut().flat_map(|section| &mut section.lanes) {
                lane.0 += lanes;
            }
        }
        for lane in &mut next.lanes {
            lane.index.0 += lanes;
            lane.road += roads;
        }
        for signal in &mut next.signals {
            signal.road += roads;
            for rules in &mut signal.uses {
                rules.road += roads;
            }
        }
        next.references.iter_mut().for_each(|reference| reference.rules.road += roads);
        next.objects.iter_mut().for_each(|object| object.road += roads);
        for reference in &mut next.object_references {
            reference.reference.road += roads;
        }
        for data in &mut next.user_data {
            match &mut data.owner {
                Owner::Map => {}
                Owner::Road(road) => *road += roads,
                Owner::Junction(junction) => *junction += junctions,
            }
        }
        next.spans.iter_mut().for_each(|span| span.road += roads);
        if next.header != Header::default() {
            self.header = next.header;
        }
        self.roads.append(&mut next.roads);
        self.road_extras.append(&mut next.road_extras);
        self.lanes.append(&mut next.lanes);
        self.junctions.append(&mut next.junctions);
        self.signals.append(&mut next.signals);
        self.references.append(&mut next.references);
        self.controllers.append(&mut next.controllers);
        self.objects.append(&mut next.objects);
        self.spans.append(&mut next.spans);
        self.object_references.append(&mut next.object_references);
        self.groups.append(&mut next.groups);
        self.user_data.append(&mut next.user_data);
        self.includes.append(&mut next.includes);
        self.ended = next.ended;
    }

    fn complete(self, text: &str) -> Result<Records, MapError> {
        if !self.roads.is_empty() {
            return Ok(self);
        }
        let reason = if text.contains("<OpenDRIVE") {
            "the file has no roads"
        } else {
            "there is no <OpenDRIVE> element; is this an OpenDRIVE file?"
        };
        Err(MapError {
            line: line_of(text, text.len().saturating_sub(1)),
            reason: reason.to_string(),
        })
    }
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

/// Metres per second from a speed record's `max` and `unit`.
fn limit(xml: &Cursor) -> Result<Option<f64>, MapError> {
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
