use super::Records;
use crate::MapError;
use crate::place::Placement;
use crate::signal::{Orientation, Signal, SignalUse};
use crate::xml::Cursor;

/// A `<signalReference>`: the signal rules here as well.
pub(crate) struct RawReference {
    pub(crate) signal: String,
    pub(crate) rules: SignalUse,
}

pub(super) fn signals(xml: &mut Cursor, road: u32, records: &mut Records) -> Result<(), MapError> {
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "signal" => {
                let signal = signal(xml, road)?;
                records.signals.push(signal);
            }
            "signalReference" => {
                let signal = xml.required("id")?;
                let rules = rules(xml, road, true)?;
                records.references.push(RawReference { signal, rules });
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
    };
    signal.uses.push(rules(xml, road, false)?);
    Ok(signal)
}

/// The current element's place, orientation and `<validity>` records.
fn rules(xml: &mut Cursor, road: u32, is_reference: bool) -> Result<SignalUse, MapError> {
    let mut rules = SignalUse {
        road,
        s: xml.number("s")?,
        orientation: Orientation::from_text(xml.raw("orientation").unwrap_or("none")),
        validity: Vec::new(),
        t: xml.number_or("t", 0.0)?,
        is_reference,
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "validity" {
            let (from, to) = (xml.integer("fromLane")?, xml.integer("toLane")?);
            rules.validity.push((from.min(to), from.max(to)));
        }
    }
    Ok(rules)
}
