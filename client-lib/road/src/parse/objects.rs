use super::Records;
use crate::MapError;
use crate::object::{Corner, Repeat, RoadObject, Span};
use crate::signal::Orientation;
use crate::xml::Cursor;

pub(super) fn objects(xml: &mut Cursor, road: u32, records: &mut Records) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "object" => {
                let object = object(xml, road)?;
                records.objects.push(object);
            }
            "bridge" | "tunnel" => records.spans.push(Span {
                id: xml.string("id"),
                name: xml.string("name"),
                is_tunnel: name == "tunnel",
                kind: xml.string("type"),
                road,
                s: xml.number_or("s", 0.0)?,
                length_m: xml.number_or("length", 0.0)?.max(0.0),
            }),
            _ => {}
        }
    }
    Ok(())
}

fn object(xml: &mut Cursor, road: u32) -> Result<RoadObject, MapError> {
    let mut object = RoadObject {
        id: xml.string("id"),
        name: xml.string("name"),
        kind: xml.string("type"),
        road,
        s: xml.number_or("s", 0.0)?,
        t: xml.number_or("t", 0.0)?,
        z_offset_m: xml.number_or("zOffset", 0.0)?,
        heading_rad: xml.number_or("hdg", 0.0)?,
        orientation: Orientation::from_text(xml.raw("orientation").unwrap_or("none")),
        length_m: xml.number_or("length", 0.0)?,
        width_m: xml.number_or("width", 0.0)?,
        height_m: xml.number_or("height", 0.0)?,
        radius_m: xml.number_or("radius", 0.0)?,
        outlines: Vec::new(),
        places: Vec::new(),
        parking: None,
        corners: Vec::new(),
        repeats: Vec::new(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "outline" => outline(xml, &mut object)?,
            "outlines" => {
                let inside = xml.depth();
                while let Some(name) = xml.child(inside)? {
                    if name == "outline" {
                        outline(xml, &mut object)?;
                    }
                }
            }
            "parkingSpace" => object.parking = Some(xml.string("access")),
            "repeat" => object.repeats.push(Repeat {
                s: xml.number_or("s", object.s)?,
                length_m: xml.number_or("length", 0.0)?.max(0.0),
                distance_m: xml.number_or("distance", 0.0)?.max(0.0),
                t: [xml.number_or("tStart", object.t)?, xml.number_or("tEnd", object.t)?],
                z_offset_m: [
                    xml.number_or("zOffsetStart", object.z_offset_m)?,
                    xml.number_or("zOffsetEnd", object.z_offset_m)?,
                ],
            }),
            _ => {}
        }
    }
    Ok(object)
}

fn outline(xml: &mut Cursor, object: &mut RoadObject) -> Result<(), MapError> {
    let mut corners = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "cornerRoad" => corners.push(Corner::Road {
                s: xml.number("s")?,
                t: xml.number("t")?,
                dz: xml.number_or("dz", 0.0)?,
            }),
            "cornerLocal" => corners.push(Corner::Local {
                u: xml.number("u")?,
                v: xml.number("v")?,
                z: xml.number_or("z", 0.0)?,
            }),
            _ => {}
        }
    }
    if !corners.is_empty() {
        object.corners.push(corners);
    }
    Ok(())
}
