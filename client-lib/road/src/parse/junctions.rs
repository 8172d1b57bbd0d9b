use crate::MapError;
use crate::junction::JunctionKind;
use crate::xml::Cursor;

/// A `<junction>` with ids not yet resolved.
pub(crate) struct RawJunction {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) kind: JunctionKind,
    pub(crate) connections: Vec<RawConnection>,
    pub(crate) controllers: Vec<String>,
    pub(crate) priorities: Vec<(String, String)>,
    pub(crate) offset: usize,
}

/// A `<connection>` with ids not yet resolved.
pub(crate) struct RawConnection {
    pub(crate) incoming: String,
    pub(crate) connecting: String,
    pub(crate) at_start: bool,
    pub(crate) lane_links: Vec<(i32, i32)>,
    pub(crate) offset: usize,
}

/// A `<controller>` with ids not yet resolved.
pub(crate) struct RawController {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) sequence: Option<i64>,
    pub(crate) signals: Vec<String>,
    pub(crate) offset: usize,
}

pub(super) fn junction(xml: &mut Cursor) -> Result<RawJunction, MapError> {
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
            _ => {}
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
        offset: xml.offset(),
    };
    let here = xml.depth();
    while let Some(name) = xml.child(here)? {
        if name == "laneLink" {
            connection.lane_links.push((xml.integer("from")?, xml.integer("to")?));
        }
    }
    Ok(connection)
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
