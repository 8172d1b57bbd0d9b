//! Sensors born of physics: what they are told, and what they say.
//!
//! The host measures them in the midst of its substeps and sends a bundle's bundle before the
//! snapshot's tick word is raised. Sensor space is x forward, y left, z up.

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId, CamReading, CamSpec, MessageReading, MessageSpec, SensorSpec, output, sensor,
    vehicle::within,
};

/// The numbers of one kind of sensor; they stand in a [`crate::SensorSpec`].
pub trait PhysicsSensorSpec: Pod {
    /// One of [`sensor`].
    const KIND: u32;
    /// Its one output.
    const OUTPUT: u32;

    /// What is wrong with them.
    fn check(&self) -> Result<(), String>;
}

/// What a sensor says.
pub trait Reading: Pod {
    /// The output whose elements these are.
    const OUTPUT: u32;
    /// How many there may be in one frame.
    const MOST: u32;
}

macro_rules! born {
    ($($spec:ident => $reading:ident, $name:ident, $most:literal, $check:expr;)*) => {
        $(
            impl PhysicsSensorSpec for $spec {
                const KIND: u32 = sensor::$name;
                const OUTPUT: u32 = output::$name;

                fn check(&self) -> Result<(), String> {
                    $check(self)
                }
            }
            const _: () = assert!(size_of::<$spec>() <= 104);
            impl Reading for $reading {
                const OUTPUT: u32 = output::$name;
                const MOST: u32 = $most;
            }
        )*

        /// Bytes of one element of such an output, or 0.
        pub(crate) fn element_bytes(output: u32) -> usize {
            match output {
                $(<$reading>::OUTPUT => size_of::<$reading>(),)*
                _ => 0,
            }
        }

        /// How many elements such an output may have in one frame, or 0.
        pub(crate) fn readings_max(output: u32) -> u32 {
            match output {
                $(<$reading>::OUTPUT => <$reading>::MOST,)*
                _ => 0,
            }
        }
    };
}

born! {
    ImuSpec => ImuReading, IMU, 1, ImuSpec::fault;
    GnssSpec => GnssReading, GNSS, 1, GnssSpec::fault;
    OdometrySpec => OdometryReading, ODOMETRY, 1, OdometrySpec::fault;
    CollisionSpec => CollisionReading, COLLISION, 64, |_: &_| Ok(());
    LaneInvasionSpec => LaneInvasionReading, LANE_INVASION, 32, |_: &_| Ok(());
    ObstacleSpec => ObstacleReading, OBSTACLE, 1, ObstacleSpec::fault;
    CamSpec => CamReading, CAM, 128, CamSpec::fault;
    MessageSpec => MessageReading, MESSAGE, 64, MessageSpec::fault;
}

/// What an inertial measurement unit gets wrong. All zeros: nothing.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ImuSpec {
    /// Standard deviation of each reading, by axis.
    pub accelerometer_stddev_mps2: [f32; 3],
    /// Standard deviation of each reading, by axis.
    pub gyroscope_stddev_radps: [f32; 3],
    /// Added to each reading, by axis.
    pub gyroscope_bias_radps: [f32; 3],
    /// How fast the accelerometer's bias wanders off: m/s² after a second, growing with the root of
    /// time.
    pub accelerometer_walk: f32,
    /// How fast the gyroscope's bias wanders off: rad/s after a second, likewise.
    pub gyroscope_walk: f32,
    /// What is felt at rest, upwards.
    pub gravity_mps2: f32,
    /// The accelerometer shows no more than this along an axis; 0: there is no limit.
    pub accelerometer_max_mps2: f32,
}

impl Default for ImuSpec {
    /// Without errors, on the earth.
    fn default() -> Self {
        ImuSpec { gravity_mps2: 9.81, ..ImuSpec::zeroed() }
    }
}

/// What a receiver of satellites gets wrong. All zeros: nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GnssSpec {
    /// Standard deviation of each reading.
    pub latitude_stddev_deg: f32,
    /// Added to each reading.
    pub latitude_bias_deg: f32,
    /// Standard deviation of each reading.
    pub longitude_stddev_deg: f32,
    /// Added to each reading.
    pub longitude_bias_deg: f32,
    /// Standard deviation of each reading.
    pub altitude_stddev_m: f32,
    /// Added to each reading.
    pub altitude_bias_m: f32,
    /// Standard deviation of an error that wanders about, east and north.
    pub wander_m: f32,
    /// The same, upwards.
    pub wander_up_m: f32,
    /// How long that error stays what it is: it falls to 1/e in so many seconds.
    pub wander_secs: f32,
    /// One of [`geodesy`].
    pub geodesy: u32,
}

/// Values of [`GnssSpec::geodesy`].
pub mod geodesy {
    /// The map's own projection, on its own ellipsoid. A map that has none lies on a sphere about
    /// 42 degrees north, 2 degrees east.
    pub const MAP: u32 = 0;
    /// That of CARLA 0.9.16: a sphere about the map's origin, what lies to the right of x in the
    /// north.
    pub const CARLA: u32 = 1;
}

/// What a speedometer gets wrong. All zeros: nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OdometrySpec {
    /// How much more than the truth it shows, as a share: worn tyres show more.
    pub scale_error: f32,
    /// Standard deviation of each reading of a speed.
    pub stddev_mps: f32,
    /// Speeds are shown in steps of this; 0: as they are.
    pub step_mps: f32,
}

/// There is nothing to be told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct CollisionSpec {
    /// Zero.
    pub reserved: u32,
}

/// There is nothing to be told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LaneInvasionSpec {
    /// Zero.
    pub reserved: u32,
}

/// How far and how wide a sensor of obstacles looks.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ObstacleSpec {
    /// How far along x.
    pub distance_m: f32,
    /// Of the ball that is pushed along there.
    pub hit_radius_m: f32,
    /// 1: actors alone are seen; 0: what stands in the town and the ground, too.
    pub only_dynamics: u32,
}

impl Default for ObstacleSpec {
    /// CARLA's.
    fn default() -> Self {
        ObstacleSpec { distance_m: 5.0, hit_radius_m: 0.5, only_dynamics: 0 }
    }
}

/// What an inertial measurement unit says: means over the time since its last reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ImuReading {
    /// In sensor space, what is felt: at rest gravity, upwards.
    pub accelerometer_mps2: [f32; 3],
    /// In sensor space.
    pub gyroscope_radps: [f32; 3],
    /// Clockwise from north, which is world y, 0 to 2π.
    pub compass_rad: f32,
    /// The time over which the means were taken.
    pub over_secs: f32,
}

/// What a receiver of satellites says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GnssReading {
    /// Northwards.
    pub latitude_deg: f64,
    /// Eastwards.
    pub longitude_deg: f64,
    /// Above the map's zero.
    pub altitude_m: f64,
}

/// What a speedometer says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OdometryReading {
    /// Of the sensor's place, along its own x; negative: backwards.
    pub speed_mps: f32,
    /// Mean speed of the rims of all wheels: it differs where wheels spin or lock. Who has no
    /// wheels: `speed_mps`.
    pub wheel_speed_mps: f32,
    /// About the sensor's own z, to the left.
    pub yaw_rate_radps: f32,
    /// How far the front wheels are turned, to the left.
    pub steer_rad: f32,
    /// `wheel_speed_mps` summed up since the sensor was made, backwards counted as backwards.
    pub distance_m: f64,
}

/// Who touched the carrier during this frame, how hard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CollisionReading {
    /// Who; nobody: it is a thing of the town.
    pub other: ActorId,
    /// Which thing of the town, as instance images have it; 0: it is an actor.
    pub object: u32,
    /// The other's tag (`mesh::Tag`).
    pub tag: u32,
    /// 1: they did not touch in the frame before.
    pub began: u32,
    /// What the carrier was given during the frame, in world space. Newton seconds.
    pub impulse_ns: [f32; 3],
}

/// A marking that a corner of the carrier crossed during this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LaneInvasionReading {
    /// What is drawn: `road::MarkKind` as a number.
    pub kind: u32,
    /// In which colour: `road::MarkColor` as a number.
    pub color: u32,
    /// Who may cross it: `road::MarkChange` as a number.
    pub change: u32,
    /// Of a single line.
    pub width_m: f32,
    /// Which corner: front left, front right, rear left, rear right.
    pub corner: u32,
    /// 1: it was crossed to the left of the lane that the corner came from; 0: to the right.
    pub to_left: u32,
    /// The lane that the corner came from: index into `road::Network::lanes`.
    pub from_lane: u32,
    /// OpenDRIVE's id of that lane.
    pub from_lane_id: i32,
}

/// What lies ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ObstacleReading {
    /// Who; nobody: it is a thing of the town, or the ground.
    pub other: ActorId,
    /// Which thing of the town, as instance images have it; 0: it is an actor, or the ground.
    pub object: u32,
    /// Its tag (`mesh::Tag`).
    pub tag: u32,
    /// How far the ball got.
    pub distance_m: f32,
}

impl SensorSpec {
    /// What is wrong with a sensor that physics measures.
    pub fn check_physics_sensor(&self) -> Result<(), String> {
        match self.kind {
            sensor::IMU => self.check_as::<ImuSpec>(),
            sensor::GNSS => self.check_as::<GnssSpec>(),
            sensor::ODOMETRY => self.check_as::<OdometrySpec>(),
            sensor::COLLISION => self.check_as::<CollisionSpec>(),
            sensor::LANE_INVASION => self.check_as::<LaneInvasionSpec>(),
            sensor::OBSTACLE => self.check_as::<ObstacleSpec>(),
            sensor::CAM => self.check_as::<CamSpec>(),
            sensor::MESSAGE => self.check_as::<MessageSpec>(),
            other => Err(format!("kind {other} is none that there is")),
        }
    }

    fn check_as<T: PhysicsSensorSpec>(&self) -> Result<(), String> {
        if self.outputs != T::OUTPUT {
            let (told, own) = (self.outputs, T::OUTPUT);
            return Err(format!("outputs are {told:#x}, but it has {own:#x} and no other"));
        }
        self.numbers::<T>().map_or(Ok(()), |numbers| numbers.check())
    }
}

impl ImuSpec {
    fn fault(&self) -> Result<(), String> {
        within_all("accelerometer_stddev_mps2", &self.accelerometer_stddev_mps2, 0.0, 1e3)?;
        within_all("gyroscope_stddev_radps", &self.gyroscope_stddev_radps, 0.0, 1e3)?;
        within_all("gyroscope_bias_radps", &self.gyroscope_bias_radps, -1e3, 1e3)?;
        within("accelerometer_walk", self.accelerometer_walk, 0.0, 1e3)?;
        within("gyroscope_walk", self.gyroscope_walk, 0.0, 1e3)?;
        within("gravity_mps2", self.gravity_mps2, -1e3, 1e3)?;
        within("accelerometer_max_mps2", self.accelerometer_max_mps2, 0.0, 1e6)
    }
}

impl GnssSpec {
    fn fault(&self) -> Result<(), String> {
        within("latitude_stddev_deg", self.latitude_stddev_deg, 0.0, 90.0)?;
        within("latitude_bias_deg", self.latitude_bias_deg, -90.0, 90.0)?;
        within("longitude_stddev_deg", self.longitude_stddev_deg, 0.0, 180.0)?;
        within("longitude_bias_deg", self.longitude_bias_deg, -180.0, 180.0)?;
        within("altitude_stddev_m", self.altitude_stddev_m, 0.0, 1e5)?;
        within("altitude_bias_m", self.altitude_bias_m, -1e5, 1e5)?;
        within("wander_m", self.wander_m, 0.0, 1e4)?;
        within("wander_up_m", self.wander_up_m, 0.0, 1e4)?;
        within("wander_secs", self.wander_secs, 0.0, 1e6)?;
        if self.geodesy > geodesy::CARLA {
            return Err(format!("geodesy is {}, not 0 (the map's) or 1 (CARLA's)", self.geodesy));
        }
        Ok(())
    }
}

impl OdometrySpec {
    fn fault(&self) -> Result<(), String> {
        within("scale_error", self.scale_error, -1.0, 1.0)?;
        within("stddev_mps", self.stddev_mps, 0.0, 100.0)?;
        within("step_mps", self.step_mps, 0.0, 100.0)
    }
}

impl ObstacleSpec {
    fn fault(&self) -> Result<(), String> {
        within("distance_m", self.distance_m, 0.01, 1e4)?;
        within("hit_radius_m", self.hit_radius_m, 0.001, 100.0)
    }
}

/// Whether all of them are numbers, and none beyond `most`.
pub(crate) fn fault_of(what: &str, values: &[f32], most: f32) -> Result<(), String> {
    values.iter().try_for_each(|value| within(what, *value, -most, most))
}

fn within_all(what: &str, values: &[f32; 3], low: f32, high: f32) -> Result<(), String> {
    values.iter().try_for_each(|value| within(what, *value, low, high))
}
