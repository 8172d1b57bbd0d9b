use glam::DVec3;

use crate::{mark::MarkColor, signal::Orientation};

/// An object on or beside a road, as the file records it.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadObject {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// OpenDRIVE's type: crosswalk, tree, pole, building, parkingSpace ...
    pub kind: String,
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Position along the reference line, metres of s.
    pub s: f64,
    /// Position to the left of the reference line, metres.
    pub t: f64,
    /// Height above the road, metres.
    pub z_offset_m: f64,
    /// Heading relative to the road's.
    pub heading_rad: f64,
    /// Direction of travel that it applies to.
    pub orientation: Orientation,
    /// Length along its own x, metres; zero if not given.
    pub length_m: f64,
    /// Width along its own y, metres; zero if not given.
    pub width_m: f64,
    /// Height in metres; zero if not given.
    pub height_m: f64,
    /// Radius in metres; zero if not given.
    pub radius_m: f64,
    /// Polygons in world space, metres; the first corner is not repeated.
    pub outlines: Vec<Vec<DVec3>>,
    /// Poses in world space, one for each repetition.
    pub places: Vec<ObjectPlace>,
    /// Vehicles that may park here, in OpenDRIVE's words: all, car, women ... `None` if it is not a
    /// parking space.
    pub parking: Option<String>,
    /// OpenDRIVE's subtype.
    pub subtype: String,
    /// Whether it can change its pose or shape.
    pub dynamic: bool,
    /// First and last lane id of the ranges that it applies to; all lanes if empty.
    pub validity: Vec<(i32, i32)>,
    /// Paint along its outline.
    pub markings: Vec<ObjectMarking>,
    /// Borders along its outline, such as kerb stones.
    pub borders: Vec<ObjectBorder>,
    /// Continuous repetitions: the stations of each, at most [`RoadObject::STATION_M`] apart.
    pub runs: Vec<Vec<ObjectPlace>>,
    /// Ids of the corners of each outline, where the file gives them.
    pub corner_ids: Vec<Vec<u32>>,
    /// Filling and heights of each outline.
    pub shapes: Vec<OutlineShape>,
    pub(crate) corners: Vec<Vec<Corner>>,
    pub(crate) repeats: Vec<Repeat>,
}

impl RoadObject {
    /// Metres of s between the stations of [`RoadObject::runs`].
    pub const STATION_M: f64 = 2.0;
}

/// What an `<outline>` says besides its corners.
#[derive(Clone, Debug, PartialEq)]
pub struct OutlineShape {
    /// OpenDRIVE's id, by which borders refer to it.
    pub id: Option<u32>,
    /// OpenDRIVE's fill type: grass, concrete, cobble, asphalt, pavement, gravel, soil; empty if
    /// not given.
    pub fill: String,
    /// Whether it encloses an area; otherwise it is a line.
    pub is_closed: bool,
    /// Height of the object above each corner, metres.
    pub heights_m: Vec<f64>,
}

/// A `<marking>` of an object: paint along one of its sides or from corner to corner.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMarking {
    /// left, right, front, rear; empty if corners are listed.
    pub side: String,
    /// Colour of the paint.
    pub color: MarkColor,
    /// Whether it is drawn bold.
    pub bold: bool,
    /// Width in metres.
    pub width_m: f64,
    /// Height above the ground, metres.
    pub z_offset_m: f64,
    /// Length of a dash, metres; the line is continuous if `space_m` is zero.
    pub length_m: f64,
    /// Length of the gap after a dash, metres.
    pub space_m: f64,
    /// Length left out before the first dash, metres.
    pub start_offset_m: f64,
    /// Length left out after the last dash, metres.
    pub stop_offset_m: f64,
    /// The corners that it connects, by [`RoadObject::corner_ids`].
    pub corners: Vec<u32>,
}

/// A `<border>` of an object: a kerb or paint along its outline.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectBorder {
    /// OpenDRIVE's type: concrete, curb, paint.
    pub kind: String,
    /// Width in metres.
    pub width_m: f64,
    /// Id of one of the object's outlines.
    pub outline: u32,
    /// Whether it surrounds the whole outline.
    pub is_complete: bool,
    /// The corners that it connects, by [`RoadObject::corner_ids`].
    pub corners: Vec<u32>,
}

/// An `<objectReference>`: an object that applies to another road as well.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectReference {
    /// Index into [`crate::Network::objects`].
    pub object: u32,
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Position along that road's reference line, metres of s.
    pub s: f64,
    /// Position to the left of that reference line, metres.
    pub t: f64,
    /// Height above the road, metres.
    pub z_offset_m: f64,
    /// Length along the road for which it applies, metres.
    pub valid_length_m: f64,
    /// Direction of travel that it applies to.
    pub orientation: Orientation,
    /// First and last lane id of the ranges that it applies to; all lanes if empty.
    pub validity: Vec<(i32, i32)>,
}

/// A `<bridge>` or `<tunnel>`: a part of a road that runs over or through a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// Whether it is a tunnel; otherwise it is a bridge.
    pub is_tunnel: bool,
    /// OpenDRIVE's type: concrete, steel, brick, wood; standard, underpass.
    pub kind: String,
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Where it begins along the reference line, metres of s.
    pub s: f64,
    /// Length in metres of s.
    pub length_m: f64,
    /// First and last lane id of the ranges inside it; all lanes if empty.
    pub validity: Vec<(i32, i32)>,
    /// Of a tunnel: amount of artificial light, 0 to 1.
    pub lighting: Option<f64>,
    /// Of a tunnel: amount of daylight, 0 to 1.
    pub daylight: Option<f64>,
}

/// Pose and size of one repetition of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectPlace {
    /// Position in world space, metres.
    pub position: DVec3,
    /// Heading in world space, from x towards y.
    pub heading_rad: f64,
    /// Length along its own x, metres; zero if not given.
    pub length_m: f64,
    /// Width along its own y, metres; zero if not given.
    pub width_m: f64,
    /// Height in metres; zero if not given.
    pub height_m: f64,
    /// Radius in metres; zero if not given.
    pub radius_m: f64,
}

/// A corner of an outline, in the coordinates of the road or of the object.
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
    /// Length, width, height and radius at the start and at the end, metres.
    pub(crate) sizes_m: [[f64; 2]; 4],
}
