use glam::DVec3;

use crate::{lane::LaneIndex, placement::Placement};

/// A traffic sign or traffic light.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// Index into [`crate::Network::roads`] of its road.
    pub road: u32,
    /// Position along the reference line, metres of s.
    pub s: f64,
    /// Position to the left of the reference line, metres.
    pub t: f64,
    /// Height above the road, metres.
    pub z_offset_m: f64,
    /// Heading relative to the road's, or to its reverse; see `orientation`.
    pub h_offset_rad: f64,
    /// Pitch relative to the road's.
    pub pitch_rad: f64,
    /// Roll relative to the road's.
    pub roll_rad: f64,
    /// Type in the catalogue, for example 1000001 for a light with three lamps.
    pub kind: String,
    /// Subtype in the catalogue.
    pub subtype: String,
    /// Country of the catalogue.
    pub country: String,
    /// Value on the sign, for example a speed.
    pub value: Option<f64>,
    /// Unit of `value`.
    pub unit: String,
    /// Text on the sign.
    pub text: String,
    /// Whether its state changes.
    pub dynamic: bool,
    /// Direction of travel that it applies to.
    pub orientation: Orientation,
    /// Width in metres.
    pub width_m: f64,
    /// Height in metres.
    pub height_m: f64,
    /// Pose in world space; x is the direction that its face looks in.
    pub pose: Placement,
    /// The lanes that it applies to, with its distance along each in driving direction, metres.
    pub lanes: Vec<(LaneIndex, f64)>,
    /// Ids of signals that depend on it, and the type of each dependency in the file's own words.
    pub dependencies: Vec<(String, String)>,
    /// Objects and signals that it refers to.
    pub references: Vec<SignalReference>,
    /// Index into [`crate::Network::controllers`] of the controller that switches it.
    pub controller: Option<u32>,
    pub(crate) position: Option<SignalPosition>,
    /// Where it applies: its own place first, then the places of signal references.
    pub uses: Vec<SignalUse>,
}

/// A `<reference>` of a signal to something that belongs to it, such as a stop line.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalReference {
    /// Kind of the element that it refers to: object or signal.
    pub element: String,
    /// OpenDRIVE's id of that element.
    pub id: String,
    /// Type of the relation in the file's own words.
    pub kind: String,
}

/// Where a signal stands if not where it applies.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SignalPosition {
    /// `<positionRoad>`: beside another road, by id.
    Road { road: String, s: f64, t: f64, z_offset_m: f64, h_offset_rad: f64 },
    /// `<positionInertial>`: in the file's own coordinates.
    Inertial { position: DVec3, heading_rad: f64 },
}

/// The direction of travel that a signal or object applies to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Along rising s ("+").
    Forward,
    /// Along falling s ("-").
    Backward,
    /// Both ("none").
    Both,
}

/// A place where a signal applies: its own, or that of a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalUse {
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Position along the reference line, metres of s.
    pub s: f64,
    /// Position to the left of the reference line, metres.
    pub t: f64,
    /// Direction of travel that it applies to here.
    pub orientation: Orientation,
    /// First and last lane id of the ranges that it applies to; if empty, all lanes of
    /// `orientation`. CARLA's towns write "0 to 0" for no lane at all.
    pub validity: Vec<(i32, i32)>,
    /// Whether it comes from a `<signalReference>`.
    pub is_reference: bool,
}

/// A group of signals with one controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    /// OpenDRIVE's id.
    pub id: String,
    /// Name in the file.
    pub name: String,
    /// Its position in the sequence of its junction's phases.
    pub sequence: Option<i64>,
    /// Indices into [`crate::Network::signals`].
    pub signals: Vec<u32>,
}

impl Orientation {
    pub(crate) fn from_text(text: &str) -> Orientation {
        match text {
            "+" => Orientation::Forward,
            "-" => Orientation::Backward,
            _ => Orientation::Both,
        }
    }

    /// Returns OpenDRIVE's value.
    pub fn text(self) -> &'static str {
        match self {
            Orientation::Forward => "+",
            Orientation::Backward => "-",
            Orientation::Both => "none",
        }
    }
}
