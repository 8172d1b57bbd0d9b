//! The road network: OpenDRIVE text in; lanes, waypoints, routes and meshes out.
//!
//! Right-handed, z up, metres and radians, f64 around the map's own local origin; meshes are f32.
//! No disk, no bus, no clock.
//!
//! ```text
//! text ──xml──▶ parse ──records──▶ build ──▶ Network ──▶ place, walk, index, surface
//! ```

mod approach;
mod arclength;
mod axes;
mod bake;
mod blend;
mod build;
mod contradictions;
mod crosswalk;
mod cubic;
mod curve;
mod error;
mod geo;
mod grid;
mod index;
mod junction;
mod landmark;
mod lane;
mod mark;
mod network;
mod object;
mod parallel;
mod parse;
mod place;
mod placement;
mod polynomial;
mod records;
mod repair;
mod road;
mod route;
mod signal;
mod slab;
mod structure;
mod surface;
mod surface_strips;
#[cfg(test)]
mod tests;
mod validate;
mod walk;
mod waypoint;
mod xml;

pub use crosswalk::Crosswalk;
pub use error::MapError;
pub use geo::{CarlaMercator, GeoPoint, TransverseMercator};
pub use junction::{Connection, Joint, Junction, JunctionGroup, JunctionKind};
pub use landmark::{Landmark, LandmarkAhead};
pub use lane::{
    Lane, LaneAccess, LaneIndex, LaneMaterial, LanePoint, LaneRule, LaneType, LaneTypes,
};
pub use mark::{MarkChange, MarkColor, MarkKind, MarkLine, MarkSway, RoadMark};
pub use network::Network;
pub use object::{
    ObjectBorder, ObjectMarking, ObjectPlace, ObjectReference, OutlineShape, RoadObject, Span,
};
pub use placement::Placement;
pub use records::{Header, Owner, UserData};
pub use repair::{Repair, repair};
pub use road::{Road, RoadLink, RoadType, Section, Switch};
pub use route::{Leg, Route};
pub use signal::{Controller, Orientation, Signal, SignalReference, SignalUse};
pub use slab::SharedBytes;
pub use structure::{Solid, Structure};
pub use surface::{object_paint, structures, surface_mesh};
pub use validate::{Finding, Severity, validate};
pub use waypoint::SideMarks;
