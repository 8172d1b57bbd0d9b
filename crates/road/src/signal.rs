use glam::DVec3;

use crate::{lane::LaneIndex, placement::Placement};

/// A sign or a light.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// Which of [`crate::Network::roads`] it stands at.
    pub road: u32,
    /// Metres along the reference line.
    pub s: f64,
    /// Metres to the left of it.
    pub t: f64,
    /// Metres above the road.
    pub z_offset_m: f64,
    /// Heading relative to the road's, or to its reverse, see `orientation`.
    pub h_offset_rad: f64,
    /// Relative to the road's.
    pub pitch_rad: f64,
    /// Relative to the road's.
    pub roll_rad: f64,
    /// The catalogue's number, for example 1000001 for a light with three lamps.
    pub kind: String,
    /// The catalogue's second number.
    pub subtype: String,
    /// Whose catalogue.
    pub country: String,
    /// What the sign says, for example a speed.
    pub value: Option<f64>,
    /// The unit of `value`.
    pub unit: String,
    /// What is written on it.
    pub text: String,
    /// Changes its state.
    pub dynamic: bool,
    /// For whom it is.
    pub orientation: Orientation,
    /// Metres.
    pub width_m: f64,
    /// Metres.
    pub height_m: f64,
    /// Where it stands; x points the way its face looks.
    pub pose: Placement,
    /// The lanes it rules, with the metres along each, in driving direction, where it stands.
    pub lanes: Vec<(LaneIndex, f64)>,
    /// Ids of signals that depend on it, and how, in the writer's own words.
    pub dependencies: Vec<(String, String)>,
    /// Objects and signals that it has to do with.
    pub references: Vec<SignalReference>,
    /// Which of [`crate::Network::controllers`] switches it.
    pub controller: Option<u32>,
    pub(crate) stands: Option<Stands>,
    /// Where it rules: first at its own place, then wherever a signal reference repeats it.
    pub uses: Vec<SignalUse>,
}

/// A `<reference>` of a signal to something that belongs to it, such as a stop line.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalReference {
    /// What it points at: object or signal.
    pub element: String,
    /// OpenDRIVE's id of that.
    pub id: String,
    /// The writer's own word for what they have to do with each other.
    pub kind: String,
}

/// Where a signal stands if not where it rules.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Stands {
    /// `<positionRoad>`: beside another road, by id.
    Road { road: String, s: f64, t: f64, z_offset_m: f64, h_offset_rad: f64 },
    /// `<positionInertial>`: in the file's own coordinates.
    Inertial { position: DVec3, heading_rad: f64 },
}

/// For which direction of travel a signal or object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Along rising s ("+").
    Forward,
    /// Along falling s ("-").
    Backward,
    /// Both ("none").
    Both,
}

/// Where a signal rules: at its own place or through a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalUse {
    /// Which of [`crate::Network::roads`].
    pub road: u32,
    /// Metres along the reference line.
    pub s: f64,
    /// Metres to the left of it.
    pub t: f64,
    /// For whom it is here.
    pub orientation: Orientation,
    /// Lane ids from the first to the last; all that `orientation` means if empty. CARLA's towns
    /// write "0 to 0" where they mean no lane at all.
    pub validity: Vec<(i32, i32)>,
    /// Through a `<signalReference>`.
    pub is_reference: bool,
}

/// A group of signals that one box switches.
#[derive(Clone, Debug, PartialEq)]
pub struct Controller {
    /// OpenDRIVE's id.
    pub id: String,
    /// What people call it.
    pub name: String,
    /// Its place in the order of its junction's phases.
    pub sequence: Option<i64>,
    /// Which of [`crate::Network::signals`].
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

    /// OpenDRIVE's sign for it.
    pub fn text(self) -> &'static str {
        match self {
            Orientation::Forward => "+",
            Orientation::Backward => "-",
            Orientation::Both => "none",
        }
    }
}
