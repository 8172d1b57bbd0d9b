use glam::DVec3;

use super::elements::validity;
use crate::{
    MapError,
    placement::Placement,
    records::{RawReference, Records},
    signal::{Orientation, Signal, SignalPosition, SignalReference, SignalUse},
    xml::Cursor,
};

pub(super) fn signals(xml: &mut Cursor, road: u32, records: &mut Records) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "signal" => {
                let signal = signal(xml, road)?;
                records.signals.push(signal);
            }
            "signalReference" => {
                let (signal, offset) = (xml.required("id")?, xml.offset());
                let mut rules = rules(xml, road, true)?;
                let inside = xml.depth();
                while let Some(name) = xml.child(inside)? {
                    if name == "validity" {
                        rules.validity.push(validity(xml)?);
                    }
                }
                records.references.push(RawReference { signal, offset, rules });
            }
            _ => {}
        }
    }
    Ok(())
}

fn signal(xml: &mut Cursor, road: u32) -> Result<Signal, MapError> {
    let mut signal = Signal {
        id: xml.required("id")?,
        name: xml.string("name"),
        road,
        s: xml.number("s")?,
        t: xml.number("t")?,
        z_offset_m: xml.number_or("zOffset", 0.0)?,
        h_offset_rad: xml.number_or("hOffset", 0.0)?,
        pitch_rad: xml.number_or("pitch", 0.0)?,
        roll_rad: xml.number_or("roll", 0.0)?,
        kind: xml.string("type"),
        subtype: xml.string("subtype"),
        country: xml.string("country"),
        value: xml.optional_number("value").unwrap_or(None),
        unit: xml.string("unit"),
        text: xml.string("text"),
        dynamic: xml.raw("dynamic") == Some("yes"),
        orientation: Orientation::from_text(xml.raw("orientation").unwrap_or("none")),
        width_m: xml.number_or("width", 0.0)?,
        height_m: xml.number_or("height", 0.0)?,
        pose: Placement::default(),
        lanes: Vec::new(),
        controller: None,
        uses: Vec::new(),
        dependencies: Vec::new(),
        references: Vec::new(),
        position: None,
    };
    let mut rules = rules(xml, road, false)?;
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "validity" => rules.validity.push(validity(xml)?),
            "dependency" => signal.dependencies.push((xml.string("id"), xml.string("type"))),
            "reference" => signal.references.push(SignalReference {
                element: xml.string("elementType"),
                id: xml.string("elementId"),
                kind: xml.string("type"),
            }),
            "positionRoad" => {
                signal.position = Some(SignalPosition::Road {
                    road: xml.string("roadId"),
                    s: xml.number("s")?,
                    t: xml.number("t")?,
                    z_offset_m: xml.number_or("zOffset", 0.0)?,
                    h_offset_rad: xml.number_or("hOffset", 0.0)?,
                });
            }
            "positionInertial" => {
                let (x, y) = (xml.number("x")?, xml.number("y")?);
                signal.position = Some(SignalPosition::Inertial {
                    position: DVec3::new(x, y, xml.number_or("z", 0.0)?),
                    heading_rad: xml.number_or("hdg", 0.0)?,
                });
            }
            _ => {}
        }
    }
    signal.uses.push(rules);
    Ok(signal)
}

/// Reads position and orientation of the current element; its `<validity>` records follow.
fn rules(xml: &Cursor, road: u32, is_reference: bool) -> Result<SignalUse, MapError> {
    Ok(SignalUse {
        road,
        s: xml.number("s")?,
        t: xml.number_or("t", 0.0)?,
        orientation: Orientation::from_text(xml.raw("orientation").unwrap_or("none")),
        validity: Vec::new(),
        is_reference,
    })
}
