use crate::{cubic::Profile, mark::RoadMark};

/// Index into [`crate::Network::lanes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneIndex(pub u32);

/// A point on a lane's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LanePoint {
    /// The lane.
    pub lane: LaneIndex,
    /// Metres of s from the lane's start in driving direction, 0 to the lane's `length_m`.
    pub along_m: f64,
}

/// One lane of one section. The centre lane 0 is not stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Lane {
    /// Its own index in [`crate::Network::lanes`].
    pub index: LaneIndex,
    /// Index into [`crate::Network::roads`].
    pub road: u32,
    /// Index of the road's section.
    pub section: u32,
    /// OpenDRIVE's signed id; positive is left of the reference line.
    pub id: i32,
    /// Type of the lane.
    pub kind: LaneType,
    /// Length in metres of s.
    pub length_m: f64,
    /// Whether it is driven along rising s.
    pub forward: bool,
    /// Index into [`crate::Network::junctions`] of its road's junction.
    pub junction: Option<u32>,
    /// Lanes that continue this one in driving direction.
    pub successors: Vec<LaneIndex>,
    /// Lanes that lead into this one in driving direction.
    pub predecessors: Vec<LaneIndex>,
    /// The neighbour to the left in driving direction, of any type and direction.
    pub left: Option<LaneIndex>,
    /// The neighbour to the right in driving direction, of any type and direction.
    pub right: Option<LaneIndex>,
    /// Whether markings allow a change to `left` anywhere; `left` has the same direction then.
    pub left_change: bool,
    /// Whether markings allow a change to `right` anywhere; `right` has the same direction then.
    pub right_change: bool,
    /// Speed limit where the lane begins: the lane's own or its road's. Metres per second.
    pub speed_limit_mps: Option<f64>,
    /// Marks on its outer border, in rising order.
    pub marks: Vec<RoadMark>,
    /// Whether it stays level where the road banks.
    pub level: bool,
    /// Surface materials, in rising order.
    pub materials: Vec<LaneMaterial>,
    /// Access restrictions, in rising order.
    pub access: Vec<LaneAccess>,
    /// Rules in free text, in rising order.
    pub rules: Vec<LaneRule>,
    pub(crate) widths: Profile,
    pub(crate) borders: Profile,
    pub(crate) heights: Vec<LaneHeight>,
    pub(crate) speeds: Vec<LaneSpeed>,
    pub(crate) declared: LaneLinks,
}

impl Lane {
    /// Returns the lane's own speed limit `ds` metres into its section.
    pub(crate) fn speed_limit_at(&self, ds: f64) -> Option<f64> {
        let after = self.speeds.partition_point(|speed| speed.from_m <= ds + 1e-6);
        self.speeds.get(after.max(1) - 1).and_then(|speed| speed.limit_mps)
    }
}

/// A `<material>` record: applies until the next one of the lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneMaterial {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// The file's own name of the material.
    pub surface: String,
    /// Friction coefficient of a tyre; zero if not given.
    pub friction: f64,
    /// Roughness in the file's own unit; zero if not given.
    pub roughness: f64,
}

/// An `<access>` record: applies until the next ones of the lane, which begin together.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneAccess {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// "allow" or "deny"; "deny" before OpenDRIVE 1.5, which introduced the attribute.
    pub rule: String,
    /// Participants: simulator, autonomousTraffic, pedestrian, passengerCar, bus, trucks ...
    pub restrictions: Vec<String>,
}

/// A `<rule>` record: applies until the next one of the lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneRule {
    /// Metres of s from the start of the lane's section.
    pub from_m: f64,
    /// Free text, such as "no stopping at any time".
    pub text: String,
}

/// A `<height>` record: height of the lane's surface above the road's.
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

/// Predecessors and successors as the file declares them, before they are resolved.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LaneLinks {
    pub(crate) predecessors: Vec<i32>,
    pub(crate) successors: Vec<i32>,
    /// Byte offset of the lane in the text.
    pub(crate) offset: usize,
}

macro_rules! lane_types {
    ($($(#[$doc:meta])* $variant:ident = $bit:literal, $name:ident, [$($text:literal),*];)*) => {
        /// Type of a lane.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u32)]
        pub enum LaneType { $($(#[$doc])* $variant = $bit,)* }

        impl LaneType {
            /// All types.
            pub const ALL: &[LaneType] = &[$(LaneType::$variant,)*];

            /// Returns the type that OpenDRIVE calls `text`; `None` if there is none.
            pub fn from_text(text: &str) -> Option<LaneType> {
                match text { $($($text)|* => Some(LaneType::$variant),)* _ => None }
            }

            /// Returns OpenDRIVE's usual name of the type.
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
    /// Not used; CARLA's towns give this type to the strip behind the kerb.
    None = 0x1, NONE, ["none"];
    /// For vehicles.
    Driving = 0x2, DRIVING, ["driving", "mwyEntry", "mwyExit", "connectingRamp", "slipLane", "bus", "taxi", "HOV"];
    /// Hard shoulder for emergency stops.
    Stop = 0x4, STOP, ["stop"];
    /// Soft border of the road.
    Shoulder = 0x8, SHOULDER, ["shoulder"];
    /// For bicycles.
    Biking = 0x10, BIKING, ["biking"];
    /// For pedestrians.
    Sidewalk = 0x20, SIDEWALK, ["sidewalk", "walking"];
    /// Hard border of the road, such as a gutter.
    Border = 0x40, BORDER, ["border", "curb"];
    /// Paved but not to be used.
    Restricted = 0x80, RESTRICTED, ["restricted"];
    /// For parked vehicles.
    Parking = 0x100, PARKING, ["parking"];
    /// Driven in both directions, such as a turning lane in the middle.
    Bidirectional = 0x200, BIDIRECTIONAL, ["bidirectional"];
    /// Separates the directions.
    Median = 0x400, MEDIAN, ["median"];
    /// For applications of the user.
    Special1 = 0x800, SPECIAL1, ["special1"];
    /// For applications of the user.
    Special2 = 0x1000, SPECIAL2, ["special2"];
    /// For applications of the user.
    Special3 = 0x2000, SPECIAL3, ["special3"];
    /// Road works.
    RoadWorks = 0x4000, ROAD_WORKS, ["roadWorks"];
    /// For trams.
    Tram = 0x8000, TRAM, ["tram"];
    /// For trains.
    Rail = 0x10000, RAIL, ["rail"];
    /// Acceleration lane.
    Entry = 0x20000, ENTRY, ["entry"];
    /// Deceleration lane.
    Exit = 0x40000, EXIT, ["exit"];
    /// Ramp that leaves a motorway.
    OffRamp = 0x80000, OFF_RAMP, ["offRamp"];
    /// Ramp that joins a motorway.
    OnRamp = 0x100000, ON_RAMP, ["onRamp"];
}

/// A set of lane types as bits, which are CARLA's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LaneTypes(pub u32);

impl LaneTypes {
    /// All types.
    pub const ANY: LaneTypes = LaneTypes(0x1f_ffff);
    /// Lanes that cars use in ordinary traffic.
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

    /// Returns the set of one type.
    pub fn only(kind: LaneType) -> LaneTypes {
        LaneTypes(kind as u32)
    }

    /// Returns whether `kind` is in the set.
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
