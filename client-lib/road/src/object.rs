use crate::signal::Orientation;
use glam::DVec3;

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
    pub(crate) corners: Vec<Vec<Corner>>,
    pub(crate) repeats: Vec<Repeat>,
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
}

/// One place of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectPlace {
    /// World space.
    pub position: DVec3,
    /// World space.
    pub heading_rad: f64,
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
}
