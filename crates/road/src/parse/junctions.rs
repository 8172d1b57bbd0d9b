use super::elements::anywhere;
use crate::{
    MapError,
    junction::JunctionKind,
    records::{Owner, RawConnection, RawController, RawGroup, RawJunction, Records},
    xml::Cursor,
};

pub(super) fn junction(xml: &mut Cursor, records: &mut Records) -> Result<RawJunction, MapError> {
    let owner = Owner::Junction(records.junctions.len() as u32);
    let mut junction = RawJunction {
        id: xml.required("id")?,
        name: xml.string("name"),
        kind: match xml.raw("type") {
            Some("direct") => JunctionKind::Direct,
            Some("virtual") => JunctionKind::Virtual,
            _ => JunctionKind::Common,
        },
        connections: Vec::new(),
        controllers: Vec::new(),
        priorities: Vec::new(),
        offset: xml.offset(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        match name {
            "connection" => {
                let connection = connection(xml)?;
                junction.connections.push(connection);
            }
            "controller" => junction.controllers.push(xml.string("id")),
            "priority" => {
                junction.priorities.push((xml.string("high"), xml.string("low")));
            }
            _ => anywhere(xml, name, owner, records),
        }
    }
    Ok(junction)
}

fn connection(xml: &mut Cursor) -> Result<RawConnection, MapError> {
    let other = if xml.raw("linkedRoad").is_some() { "linkedRoad" } else { "connectingRoad" };
    let mut connection = RawConnection {
        incoming: xml.string("incomingRoad"),
        connecting: xml.string(other),
        at_start: xml.raw("contactPoint") != Some("end"),
        lane_links: Vec::new(),
        predecessor: None,
        successor: None,
        offset: xml.offset(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        let joint = match name {
            "laneLink" => {
                connection.lane_links.push((xml.integer("from")?, xml.integer("to")?));
                continue;
            }
            "predecessor" => &mut connection.predecessor,
            "successor" => &mut connection.successor,
            _ => continue,
        };
        let is_road = xml.raw("elementType").is_none_or(|element| element == "road");
        let forward = xml.raw("elementDir") != Some("-");
        let s = xml.number_or("elementS", 0.0)?;
        *joint = is_road.then(|| (xml.string("elementId"), s, forward));
    }
    Ok(connection)
}

pub(super) fn group(xml: &mut Cursor) -> Result<RawGroup, MapError> {
    let mut group = RawGroup {
        id: xml.string("id"),
        name: xml.string("name"),
        kind: xml.string("type"),
        junctions: Vec::new(),
        offset: xml.offset(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "junctionReference" {
            group.junctions.push(xml.string("junction"));
        }
    }
    Ok(group)
}

pub(super) fn controller(xml: &mut Cursor) -> Result<RawController, MapError> {
    let mut controller = RawController {
        id: xml.required("id")?,
        name: xml.string("name"),
        sequence: xml.raw("sequence").and_then(|text| text.trim().parse().ok()),
        signals: Vec::new(),
        offset: xml.offset(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "control" {
            controller.signals.push(xml.string("signalId"));
        }
    }
    Ok(controller)
}
