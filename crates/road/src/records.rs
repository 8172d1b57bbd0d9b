//! The content of an OpenDRIVE text before references between its parts are resolved.

use glam::DVec3;

use crate::{
    junction::JunctionKind,
    lane::Lane,
    object::{ObjectReference, RoadObject, Span},
    road::Road,
    signal::{Signal, SignalUse},
};

/// All records of a file.
#[derive(Default)]
pub(crate) struct Records {
    pub(crate) header: Header,
    pub(crate) roads: Vec<Road>,
    /// One for each of `roads`.
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
    /// Names of files to be included, with byte offsets.
    pub(crate) includes: Vec<(String, usize)>,
    /// Byte offset of the first element that was left to the next part.
    pub(crate) ended: usize,
}

/// What a road says about other parts of the file.
#[derive(Default)]
pub(crate) struct RoadExtra {
    pub(crate) junction: Option<String>,
    pub(crate) predecessor: Option<RawLink>,
    pub(crate) successor: Option<RawLink>,
    /// The declared length, if the geometry ends well before it.
    pub(crate) too_long: Option<f64>,
    /// Where the first lane section begins that lies beyond the end of the road, if there is one.
    pub(crate) sections_beyond: Option<f64>,
    /// Byte offset of the road in the text.
    pub(crate) offset: usize,
}

/// The header of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// OpenDRIVE's version, such as (1, 4).
    pub revision: (u32, u32),
    /// Name of the map.
    pub name: String,
    /// Vendor of the file.
    pub vendor: String,
    /// The projection, a PROJ string; empty if none.
    pub geo_reference: String,
    /// Name of the map's license.
    pub license: String,
    /// Added to the file's coordinates to get projected ones, metres.
    pub offset_m: DVec3,
    /// Added to the file's headings, about its origin.
    pub offset_heading_rad: f64,
}

/// A `<userData>` record with a code, for applications that support it.
#[derive(Clone, Debug, PartialEq)]
pub struct UserData {
    /// The part of the map that it belongs to.
    pub owner: Owner,
    /// Its code.
    pub code: String,
    /// Its value.
    pub value: String,
}

/// The part of a map that user data belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The whole map.
    Map,
    /// Index into [`crate::Network::roads`].
    Road(u32),
    /// Index into [`crate::Network::junctions`].
    Junction(u32),
}

/// A road's `<predecessor>` or `<successor>`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RawLink {
    pub(crate) junction: bool,
    pub(crate) id: String,
    pub(crate) at_start: bool,
}

/// Tolerance of road lengths, metres: files round them, and reference lines may be extended a
/// little.
pub(crate) const BEYOND_M: f64 = 1.0;

/// A `<junction>` with unresolved ids.
pub(crate) struct RawJunction {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) kind: JunctionKind,
    pub(crate) connections: Vec<RawConnection>,
    pub(crate) controllers: Vec<String>,
    pub(crate) priorities: Vec<(String, String)>,
    pub(crate) offset: usize,
}

/// A `<connection>` with unresolved ids.
pub(crate) struct RawConnection {
    pub(crate) incoming: String,
    pub(crate) connecting: String,
    pub(crate) at_start: bool,
    pub(crate) lane_links: Vec<(i32, i32)>,
    /// Road id, s, and whether it leads along rising s.
    pub(crate) predecessor: Option<(String, f64, bool)>,
    pub(crate) successor: Option<(String, f64, bool)>,
    pub(crate) offset: usize,
}

/// A `<controller>` with unresolved ids.
pub(crate) struct RawController {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) sequence: Option<i64>,
    pub(crate) signals: Vec<String>,
    pub(crate) offset: usize,
}

/// A `<junctionGroup>` with unresolved ids.
pub(crate) struct RawGroup {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) junctions: Vec<String>,
    pub(crate) offset: usize,
}

/// An `<objectReference>` with an unresolved id.
pub(crate) struct RawObjectReference {
    pub(crate) id: String,
    pub(crate) offset: usize,
    pub(crate) reference: ObjectReference,
}

/// A `<signalReference>`: the signal applies here as well.
pub(crate) struct RawReference {
    pub(crate) signal: String,
    pub(crate) offset: usize,
    pub(crate) rules: SignalUse,
}

impl Records {
    /// Appends the records of the following part of the file.
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
