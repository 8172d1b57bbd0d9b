//! What an OpenDRIVE text says, before references between its parts are resolved.

use glam::DVec3;

use crate::{
    junction::JunctionKind,
    lane::Lane,
    object::{ObjectReference, RoadObject, Span},
    road::Road,
    signal::{Signal, SignalUse},
};

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
    pub(crate) ended: usize,
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

/// A road's `<predecessor>` or `<successor>`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RawLink {
    pub(crate) junction: bool,
    pub(crate) id: String,
    pub(crate) at_start: bool,
}

/// Lengths in files are rounded, and reference lines may be drawn on by a little.
pub(crate) const BEYOND_M: f64 = 1.0;

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
    /// Road id, s, along rising s.
    pub(crate) predecessor: Option<(String, f64, bool)>,
    pub(crate) successor: Option<(String, f64, bool)>,
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

/// A `<junctionGroup>` with ids not yet resolved.
pub(crate) struct RawGroup {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) junctions: Vec<String>,
    pub(crate) offset: usize,
}

/// An `<objectReference>` with its id not yet resolved.
pub(crate) struct RawObjectReference {
    pub(crate) id: String,
    pub(crate) offset: usize,
    pub(crate) reference: ObjectReference,
}

/// A `<signalReference>`: the signal rules here as well.
pub(crate) struct RawReference {
    pub(crate) signal: String,
    pub(crate) offset: usize,
    pub(crate) rules: SignalUse,
}

impl Records {
    /// Adds what stands behind it in the file.
    pub(crate) fn append(&mut self, mut next: Records) {
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
}
