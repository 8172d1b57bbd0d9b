use crate::{cubic::Profile, mark::RoadMark};

/// Which lane of [`crate::Network::lanes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneIndex(pub u32);

/// A place on a lane's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LanePoint {
    /// The lane.
    pub lane: LaneIndex,
    /// Metres of s from the lane's start in driving direction, 0 to the lane's `length_m`.
    pub along_m: f64,
}

/// One lane of one section; the centre lane 0 is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Its own place in [`crate::Network::lanes`].
    pub index: LaneIndex,
    /// Which road of [`crate::Network::roads`].
    pub road: u32,
    /// Which of the road's sections.
    pub section: u32,
    /// OpenDRIVE's signed id; positive is left of the reference line.
    pub id: i32,
    /// What it is for.
    pub kind: LaneType,
    /// Metres of s.
    pub length_m: f64,
    /// Driven along rising s.
    pub forward: bool,
    /// Which of [`crate::Network::junctions`] its road belongs to.
    pub junction: Option<u32>,
    /// Lanes that continue this one, seen in driving direction.
    pub successors: Vec<LaneIndex>,
    /// Lanes that this one continues, seen in driving direction.
    pub predecessors: Vec<LaneIndex>,
    /// The neighbour to the left seen in driving direction, of any type and direction.
    pub left: Option<LaneIndex>,
    /// The neighbour to the right seen in driving direction, of any type and direction.
    pub right: Option<LaneIndex>,
    /// Markings somewhere allow to change to `left`, which is driven the same way.
    pub left_change: bool,
    /// Markings somewhere allow to change to `right`, which is driven the same way.
    pub right_change: bool,
    /// The limit where the lane begins: its own, or its road's.
    pub speed_limit_mps: Option<f64>,
    /// What is painted on its outer border, in rising order.
    pub marks: Vec<RoadMark>,
    /// Stays level where the road banks.
    pub level: bool,
    /// What it is made of, in rising order.
    pub materials: Vec<LaneMaterial>,
    /// Who may use it, in rising order.
    pub access: Vec<LaneAccess>,
    /// Rules in the writer's own words, in rising order.
    pub rules: Vec<LaneRule>,
    pub(crate) widths: Profile,
    pub(crate) borders: Profile,
    pub(crate) heights: Vec<LaneHeight>,
    pub(crate) speeds: Vec<LaneSpeed>,
    pub(crate) declared: LaneLinks,
}

impl Lane {
    /// The lane's own limit `ds` metres into its section.
    pub(crate) fn speed_limit_at(&self, ds: f64) -> Option<f64> {
        let after = self.speeds.partition_point(|speed| speed.from_m <= ds + 1e-6);
        self.speeds.get(after.max(1) - 1).and_then(|speed| speed.limit_mps)
    }
}

/// A `<material>` record: holds until the next one of the lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneMaterial {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// The writer's own word.
    pub surface: String,
    /// Of a tyre; zero where not said.
    pub friction: f64,
    /// The writer's own measure; zero where not said.
    pub roughness: f64,
}

/// An `<access>` record: holds until the next ones of the lane, which begin together.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneAccess {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// "allow" or "deny"; "deny" before OpenDRIVE 1.5 knew the word.
    pub rule: String,
    /// For whom: simulator, autonomousTraffic, pedestrian, passengerCar, bus, trucks ...
    pub restrictions: Vec<String>,
}

/// A `<rule>` record: holds until the next one of the lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneRule {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// Free text, such as "no stopping at any time".
    pub text: String,
}

/// A `<height>` record: how far the surface stands above the road's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LaneHeight {
    pub(crate) from_m: f64,
    pub(crate) inner_m: f64,
    pub(crate) outer_m: f64,
}

/// A `<speed>` record of a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LaneSpeed {
    pub(crate) from_m: f64,
    pub(crate) limit_mps: Option<f64>,
}

/// What the file says of a lane's neighbours along s, before it is resolved.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LaneLinks {
    pub(crate) predecessors: Vec<i32>,
    pub(crate) successors: Vec<i32>,
    /// Where the lane stands in the text, in bytes.
    pub(crate) offset: usize,
}

macro_rules! lane_types {
    ($($(#[$doc:meta])* $variant:ident = $bit:literal, $name:ident, [$($text:literal),*];)*) => {
        /// What a lane is for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        pub enum LaneType { $($(#[$doc])* $variant = $bit,)* }

        impl LaneType {
            /// Every type.
            pub const ALL: &[LaneType] = &[$(LaneType::$variant,)*];

            /// The type that OpenDRIVE calls `text`.
            pub fn from_text(text: &str) -> Option<LaneType> {
                match text { $($($text)|* => Some(LaneType::$variant),)* _ => None }
            }

            /// OpenDRIVE's usual word for it.
            pub fn text(self) -> &'static str {
                match self { $(LaneType::$variant => [$($text),*][0],)* }
            }
        }

        impl LaneTypes {
            $($(#[$doc])* pub const $name: LaneTypes = LaneTypes($bit);)*
        }
    };
}

lane_types! {
    /// No use at all; also what CARLA's towns call the strip behind the kerb.
    None = 0x1, NONE, ["none"];
    /// Vehicles drive here.
    Driving = 0x2, DRIVING, ["driving", "mwyEntry", "mwyExit", "connectingRamp", "slipLane", "bus", "taxi", "HOV"];
    /// A hard shoulder to stop on in need.
    Stop = 0x4, STOP, ["stop"];
    /// The soft border of the road.
    Shoulder = 0x8, SHOULDER, ["shoulder"];
    /// Bicycles.
    Biking = 0x10, BIKING, ["biking"];
    /// People on foot.
    Sidewalk = 0x20, SIDEWALK, ["sidewalk", "walking"];
    /// A hard border of the road, such as a gutter.
    Border = 0x40, BORDER, ["border", "curb"];
    /// Paved but not to be used.
    Restricted = 0x80, RESTRICTED, ["restricted"];
    /// Parked vehicles.
    Parking = 0x100, PARKING, ["parking"];
    /// Driven both ways, such as a turning lane in the middle.
    Bidirectional = 0x200, BIDIRECTIONAL, ["bidirectional"];
    /// Separates the directions.
    Median = 0x400, MEDIAN, ["median"];
    /// For the user's own purposes.
    Special1 = 0x800, SPECIAL1, ["special1"];
    /// For the user's own purposes.
    Special2 = 0x1000, SPECIAL2, ["special2"];
    /// For the user's own purposes.
    Special3 = 0x2000, SPECIAL3, ["special3"];
    /// Road works.
    RoadWorks = 0x4000, ROAD_WORKS, ["roadWorks"];
    /// Trams.
    Tram = 0x8000, TRAM, ["tram"];
    /// Trains.
    Rail = 0x10000, RAIL, ["rail"];
    /// Acceleration lanes.
    Entry = 0x20000, ENTRY, ["entry"];
    /// Deceleration lanes.
    Exit = 0x40000, EXIT, ["exit"];
    /// Ramps that leave a motorway.
    OffRamp = 0x80000, OFF_RAMP, ["offRamp"];
    /// Ramps that join a motorway.
    OnRamp = 0x100000, ON_RAMP, ["onRamp"];
}

/// A set of lane types, with the bits that CARLA gives them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LaneTypes(pub u32);

impl LaneTypes {
    /// Every type.
    pub const ANY: LaneTypes = LaneTypes(0x1f_ffff);
    /// Everything that cars drive on in ordinary traffic.
    pub const DRIVABLE: LaneTypes = LaneTypes(
        LaneTypes::DRIVING.0
            | LaneTypes::BIDIRECTIONAL.0
            | LaneTypes::ENTRY.0
            | LaneTypes::EXIT.0
            | LaneTypes::OFF_RAMP.0
            | LaneTypes::ON_RAMP.0,
    );

    /// Lanes that vehicles can at least roll over. Their surface takes precedence over all others.
    pub(crate) const PAVED: LaneTypes = LaneTypes(
        LaneTypes::ANY.0
            & !(LaneTypes::NONE.0
                | LaneTypes::SIDEWALK.0
                | LaneTypes::MEDIAN.0
                | LaneTypes::RAIL.0),
    );

    /// The set of one type.
    pub fn only(kind: LaneType) -> LaneTypes {
        LaneTypes(kind as u32)
    }

    /// Whether `kind` is in the set.
    pub fn contains(self, kind: LaneType) -> bool {
        self.0 & kind as u32 != 0
    }
}

impl std::ops::BitOr for LaneTypes {
    type Output = LaneTypes;
    fn bitor(self, other: LaneTypes) -> LaneTypes {
        LaneTypes(self.0 | other.0)
    }
}
