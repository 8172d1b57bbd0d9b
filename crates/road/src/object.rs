use glam::DVec3;

use crate::{mark::MarkColor, signal::Orientation};

/// A thing beside or on the road, as the file records it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadObject {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// OpenDRIVE's word: crosswalk, tree, pole, building, parkingSpace ...
    pub kind: String,
    /// Which of [`crate::Network::roads`].
    pub road: u32,
    /// Metres along the reference line.
    pub s: f64,
    /// Metres to the left of it.
    pub t: f64,
    /// Metres above the road.
    pub z_offset_m: f64,
    /// Relative to the road's heading.
    pub heading_rad: f64,
    /// For whom it is.
    pub orientation: Orientation,
    /// Metres along its own x; zero where not said.
    pub length_m: f64,
    /// Metres along its own y; zero where not said.
    pub width_m: f64,
    /// Metres; zero where not said.
    pub height_m: f64,
    /// Metres; zero where not said.
    pub radius_m: f64,
    /// Polygons in world space; the first corner is not repeated.
    pub outlines: Vec<Vec<DVec3>>,
    /// Where it stands, in world space, once for each repetition.
    pub places: Vec<ObjectPlace>,
    /// Who may park here; none if it is no parking space. OpenDRIVE's words: all, car, women ...
    pub parking: Option<String>,
    /// OpenDRIVE's second word.
    pub subtype: String,
    /// Can change its place or form.
    pub dynamic: bool,
    /// Lane ids from the first to the last, for which it is; all if empty.
    pub validity: Vec<(i32, i32)>,
    /// What is painted along its outline.
    pub markings: Vec<ObjectMarking>,
    /// What frames it, such as kerb stones.
    pub borders: Vec<ObjectBorder>,
    /// Where it goes on without gaps: stations of each such repetition, at most
    /// [`RoadObject::STATION_M`] apart.
    pub runs: Vec<Vec<ObjectPlace>>,
    /// The ids that the file gives to the corners of each outline, where it does.
    pub corner_ids: Vec<Vec<u32>>,
    /// What each outline is filled with, and how high.
    pub shapes: Vec<OutlineShape>,
    pub(crate) corners: Vec<Vec<Corner>>,
    pub(crate) repeats: Vec<Repeat>,
}

impl RoadObject {
    /// Metres of s between the stations of [`RoadObject::runs`].
    pub const STATION_M: f64 = 2.0;
}

/// What an `<outline>` says beside its corners.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineShape {
    /// OpenDRIVE's id, by which borders name it.
    pub id: Option<u32>,
    /// OpenDRIVE's word: grass, concrete, cobble, asphalt, pavement, gravel, soil; empty where not
    /// said.
    pub fill: String,
    /// An area, not a line.
    pub is_closed: bool,
    /// How high the object stands above each corner, metres.
    pub heights_m: Vec<f64>,
}

/// A `<marking>` of an object: paint along a side of it or from corner to corner.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMarking {
    /// left, right, front, rear; empty where corners are named.
    pub side: String,
    /// The paint.
    pub color: MarkColor,
    /// Drawn bold.
    pub bold: bool,
    /// Metres.
    pub width_m: f64,
    /// Metres above the ground.
    pub z_offset_m: f64,
    /// Metres painted; the whole way if `space_m` is zero.
    pub length_m: f64,
    /// Metres left out after it.
    pub space_m: f64,
    /// Metres left out before the first.
    pub start_offset_m: f64,
    /// Metres left out behind the last.
    pub stop_offset_m: f64,
    /// The corners that it leads along, by [`RoadObject::corner_ids`].
    pub corners: Vec<u32>,
}

/// A `<border>` of an object: a frame along its outline.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectBorder {
    /// OpenDRIVE's word: concrete, curb, paint.
    pub kind: String,
    /// Metres.
    pub width_m: f64,
    /// Which of the object's outlines.
    pub outline: u32,
    /// All round it.
    pub is_complete: bool,
    /// The corners that it leads along, by [`RoadObject::corner_ids`].
    pub corners: Vec<u32>,
}

/// An `<objectReference>`: an object that is of meaning to another road as well.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectReference {
    /// Which of [`crate::Network::objects`].
    pub object: u32,
    /// Which of [`crate::Network::roads`].
    pub road: u32,
    /// Metres along that road's reference line.
    pub s: f64,
    /// Metres to the left of it.
    pub t: f64,
    /// Metres above the road.
    pub z_offset_m: f64,
    /// How far along the road it counts, metres.
    pub valid_length_m: f64,
    /// For whom it is.
    pub orientation: Orientation,
    /// Lane ids from the first to the last; all if empty.
    pub validity: Vec<(i32, i32)>,
}

/// A `<bridge>` or `<tunnel>`: the road runs over or through it for a while.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// A tunnel, not a bridge.
    pub is_tunnel: bool,
    /// OpenDRIVE's word: concrete, steel, brick, wood; standard, underpass.
    pub kind: String,
    /// Which of [`crate::Network::roads`].
    pub road: u32,
    /// Where it begins, metres along the reference line.
    pub s: f64,
    /// Metres of s.
    pub length_m: f64,
    /// Lane ids from the first to the last, that it holds; all if empty.
    pub validity: Vec<(i32, i32)>,
    /// Of a tunnel: how much artificial light there is, 0 to 1.
    pub lighting: Option<f64>,
    /// Of a tunnel: how much daylight there is, 0 to 1.
    pub daylight: Option<f64>,
}

/// One place of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectPlace {
    /// World space.
    pub position: DVec3,
    /// World space.
    pub heading_rad: f64,
    /// Metres along its own x; zero where not said.
    pub length_m: f64,
    /// Metres along its own y; zero where not said.
    pub width_m: f64,
    /// Metres; zero where not said.
    pub height_m: f64,
    /// Metres; zero where not said.
    pub radius_m: f64,
}

/// A corner of an outline, in the road's or the object's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Corner {
    Road { s: f64, t: f64, dz: f64 },
    Local { u: f64, v: f64, z: f64 },
}

/// A `<repeat>` record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Repeat {
    pub(crate) s: f64,
    pub(crate) length_m: f64,
    pub(crate) distance_m: f64,
    pub(crate) t: [f64; 2],
    pub(crate) z_offset_m: [f64; 2],
    /// Length, width, height and radius, at the start and the end.
    pub(crate) sizes_m: [[f64; 2]; 4],
}
