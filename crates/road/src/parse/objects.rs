use super::elements::validity;
use crate::{
    MapError,
    mark::MarkColor,
    object::{
        Corner, ObjectBorder, ObjectMarking, ObjectReference, OutlineShape, Repeat, RoadObject,
        Span,
    },
    records::{RawObjectReference, Records},
    signal::Orientation,
    xml::Cursor,
};

pub(super) fn objects(xml: &mut Cursor, road: u32, records: &mut Records) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "object" => {
                let object = object(xml, road)?;
                records.objects.push(object);
            }
            "objectReference" => {
                let reference = reference(xml, road)?;
                records.object_references.push(reference);
            }
            "bridge" | "tunnel" => {
                let span = span(xml, road, name == "tunnel")?;
                records.spans.push(span);
            }
            _ => {}
        }
    }
    Ok(())
}

fn reference(xml: &mut Cursor, road: u32) -> Result<RawObjectReference, MapError> {
    let (id, offset) = (xml.required("id")?, xml.offset());
    let mut reference = ObjectReference {
        object: 0,
        road,
        s: xml.number_or("s", 0.0)?,
        t: xml.number_or("t", 0.0)?,
        z_offset_m: xml.number_or("zOffset", 0.0)?,
        valid_length_m: xml.number_or("validLength", 0.0)?,
        orientation: Orientation::from_text(xml.raw("orientation").unwrap_or("none")),
        validity: Vec::new(),
    };
    reference.validity = validities(xml)?;
    Ok(RawObjectReference { id, offset, reference })
}

fn span(xml: &mut Cursor, road: u32, is_tunnel: bool) -> Result<Span, MapError> {
    let mut span = Span {
        id: xml.string("id"),
        name: xml.string("name"),
        is_tunnel,
        kind: xml.string("type"),
        road,
        s: xml.number_or("s", 0.0)?,
        length_m: xml.number_or("length", 0.0)?.max(0.0),
        validity: Vec::new(),
        lighting: xml.optional_number("lighting")?,
        daylight: xml.optional_number("daylight")?,
    };
    span.validity = validities(xml)?;
    Ok(span)
}

/// Reads the `<validity>` records directly inside the current element.
fn validities(xml: &mut Cursor) -> Result<Vec<(i32, i32)>, MapError> {
    let mut found = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "validity" {
            found.push(validity(xml)?);
        }
    }
    Ok(found)
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
        subtype: xml.string("subtype"),
        dynamic: xml.raw("dynamic") == Some("yes"),
        validity: Vec::new(),
        markings: Vec::new(),
        borders: Vec::new(),
        runs: Vec::new(),
        corner_ids: Vec::new(),
        shapes: Vec::new(),
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
            "validity" => object.validity.push(validity(xml)?),
            "markings" => markings(xml, &mut object)?,
            "borders" => borders(xml, &mut object)?,
            "repeat" => object.repeats.push(Repeat {
                s: xml.number_or("s", object.s)?,
                length_m: xml.number_or("length", 0.0)?.max(0.0),
                distance_m: xml.number_or("distance", 0.0)?.max(0.0),
                t: [xml.number_or("tStart", object.t)?, xml.number_or("tEnd", object.t)?],
                z_offset_m: [
                    xml.number_or("zOffsetStart", object.z_offset_m)?,
                    xml.number_or("zOffsetEnd", object.z_offset_m)?,
                ],
                sizes_m: [
                    ends(xml, ["lengthStart", "lengthEnd"], object.length_m)?,
                    ends(xml, ["widthStart", "widthEnd"], object.width_m)?,
                    ends(xml, ["heightStart", "heightEnd"], object.height_m)?,
                    ends(xml, ["radiusStart", "radiusEnd"], object.radius_m)?,
                ],
            }),
            _ => {}
        }
    }
    Ok(object)
}

/// Reads a size at both ends of a repetition. A value that is given for one end only applies to
/// both.
fn ends(xml: &Cursor, keys: [&str; 2], own: f64) -> Result<[f64; 2], MapError> {
    let [start, end] = keys.map(|key| xml.optional_number(key));
    let (start, end) = (start?, end?);
    let either = start.or(end).unwrap_or(own);
    Ok([start.unwrap_or(either), end.unwrap_or(either)])
}

fn markings(xml: &mut Cursor, object: &mut RoadObject) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name != "marking" {
            continue;
        }
        let bold = xml.raw("weight") == Some("bold");
        let usual_width = if bold { 0.25 } else { 0.12 };
        let mut marking = ObjectMarking {
            side: xml.string("side"),
            color: MarkColor::from_text(xml.raw("color").unwrap_or_default()),
            bold,
            width_m: xml.number_or("width", usual_width)?.clamp(0.0, 5.0),
            z_offset_m: xml.number_or("zOffset", 0.0)?,
            length_m: xml.number_or("lineLength", 0.0)?.max(0.0),
            space_m: xml.number_or("spaceLength", 0.0)?.max(0.0),
            start_offset_m: xml.number_or("startOffset", 0.0)?,
            stop_offset_m: xml.number_or("stopOffset", 0.0)?,
            corners: Vec::new(),
        };
        marking.corners = corner_references(xml)?;
        object.markings.push(marking);
    }
    Ok(())
}

fn borders(xml: &mut Cursor, object: &mut RoadObject) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name != "border" {
            continue;
        }
        let mut border = ObjectBorder {
            kind: xml.string("type"),
            width_m: xml.number_or("width", 0.0)?.clamp(0.0, 5.0),
            outline: xml.raw("outlineId").and_then(|id| id.trim().parse().ok()).unwrap_or(0),
            is_complete: xml.raw("useCompleteOutline") == Some("true"),
            corners: Vec::new(),
        };
        border.corners = corner_references(xml)?;
        object.borders.push(border);
    }
    Ok(())
}

fn corner_references(xml: &mut Cursor) -> Result<Vec<u32>, MapError> {
    let mut found = Vec::new();
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "cornerReference" {
            found.extend(xml.raw("id").and_then(|id| id.trim().parse::<u32>().ok()));
        }
    }
    Ok(found)
}

/// Upper bound of the height of objects, metres.
const HEIGHT_MAX_M: f64 = 500.0;

fn outline(xml: &mut Cursor, object: &mut RoadObject) -> Result<(), MapError> {
    let (mut corners, mut ids) = (Vec::new(), Vec::new());
    let mut shape = OutlineShape {
        id: xml.raw("id").and_then(|id| id.trim().parse().ok()),
        fill: xml.string("fillType"),
        // Up to OpenDRIVE 1.4 all outlines were closed.
        is_closed: xml.raw("closed") != Some("false"),
        heights_m: Vec::new(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        let before = corners.len();
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
        if corners.len() > before {
            let id = xml.raw("id").and_then(|id| id.trim().parse().ok());
            ids.push(id.unwrap_or(before as u32));
            shape.heights_m.push(xml.number_or("height", 0.0)?.clamp(0.0, HEIGHT_MAX_M));
        }
    }
    if !corners.is_empty() {
        object.corners.push(corners);
        object.corner_ids.push(ids);
        object.shapes.push(shape);
    }
    Ok(())
}
