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
use crate::xml::Cursor;
use glam::DVec3;

pub(crate) use junctions::{RawController, RawJunction};
pub(crate) use roads::RawLink;
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
    /// To be added to the file's coordinates to get projected ones, metres.
    pub offset_m: DVec3,
    /// To be added to the file's headings, about its origin.
    pub offset_heading_rad: f64,
}

/// Reads a whole file.
pub(crate) fn records(text: &str) -> Result<Records, MapError> {
    let mut xml = Cursor::new(text);
    let mut records = Records::default();
    let mut found = false;
    while let Some(name) = xml.child(0)? {
        if name != "OpenDRIVE" {
            return Err(xml.error(format!("the root element is <{name}>, not <OpenDRIVE>")));
        }
        found = true;
        let root = xml.depth();
        while let Some(name) = xml.child(root)? {
            match name {
                "header" => records.header = header(&mut xml)?,
                "road" => roads::road(&mut xml, &mut records)?,
                "controller" => {
                    let controller = junctions::controller(&mut xml)?;
                    records.controllers.push(controller);
                }
                "junction" => {
                    let junction = junctions::junction(&mut xml)?;
                    records.junctions.push(junction);
                }
                _ => {}
            }
        }
    }
    if !found {
        return Err(xml.error("there is no <OpenDRIVE> element; is this an OpenDRIVE file?".into()));
    }
    if records.roads.is_empty() {
        return Err(xml.error("the file has no roads".into()));
    }
    Ok(records)
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
