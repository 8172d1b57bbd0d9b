//! Sensors that the host measures during physics: their parameters and their readings.
//!
//! The host accumulates them over its substeps and sends the measurements of a frame before it raises
//! the frame's tick word. Sensor space is x forward, y left, z up.

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId, CamReading, CamSpec, MessageReading, MessageSpec,
    range::{each, within},
    sensor_code::{output, sensor},
};

/// The parameters of one type of physics sensor, stored in a [`crate::SensorSpec`].
pub trait PhysicsSensorSpec: Pod {
    /// One of [`sensor`].
    const KIND: u32;
    /// The only output of this type.
    const OUTPUT: u32;

    /// Checks that every parameter is in its range; the error names the first that is not.
    fn check(&self) -> Result<(), String>;
}

/// A reading of a physics sensor.
pub trait Reading: Pod {
    /// The output that consists of these readings.
    const OUTPUT: u32;
    /// The most readings in one frame.
    const MOST: u32;
}

macro_rules! physics_sensors {
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

        /// Bytes of one reading of this output; 0 if it is not a physics output.
        pub(crate) fn element_bytes(output: u32) -> usize {
            match output {
                $(<$reading>::OUTPUT => size_of::<$reading>(),)*
                _ => 0,
            }
        }

        /// The most readings of this output in one frame; 0 if it is not a physics output.
        pub(crate) fn readings_max(output: u32) -> u32 {
            match output {
                $(<$reading>::OUTPUT => <$reading>::MOST,)*
                _ => 0,
            }
        }
    };
}

physics_sensors! {
    ImuSpec => ImuReading, IMU, 1, ImuSpec::fault;
    GnssSpec => GnssReading, GNSS, 1, GnssSpec::fault;
    OdometrySpec => OdometryReading, ODOMETRY, 1, OdometrySpec::fault;
    CollisionSpec => CollisionReading, COLLISION, 64, |_: &_| Ok(());
    LaneInvasionSpec => LaneInvasionReading, LANE_INVASION, 32, |_: &_| Ok(());
    ObstacleSpec => ObstacleReading, OBSTACLE, 1, ObstacleSpec::fault;
    CamSpec => CamReading, CAM, 128, CamSpec::fault;
    MessageSpec => MessageReading, MESSAGE, 64, MessageSpec::fault;
}

/// Error model of an inertial measurement unit; zeros are an ideal sensor.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ImuSpec {
    /// Standard deviation of the accelerometer's white noise, by axis.
    pub accelerometer_stddev_mps2: [f32; 3],
    /// Standard deviation of the gyroscope's white noise, by axis.
    pub gyroscope_stddev_radps: [f32; 3],
    /// Constant bias of the gyroscope, by axis.
    pub gyroscope_bias_radps: [f32; 3],
    /// Random walk of the accelerometer's bias: standard deviation in m/s² after one second, growing
    /// with the square root of time.
    pub accelerometer_walk: f32,
    /// Random walk of the gyroscope's bias: standard deviation in rad/s after one second, with the same
    /// law.
    pub gyroscope_walk: f32,
    /// Specific force at rest, upwards.
    pub gravity_mps2: f32,
    /// Measurement range of the accelerometer along each axis; 0: unlimited.
    pub accelerometer_max_mps2: f32,
}

impl Default for ImuSpec {
    /// An ideal sensor on the earth.
    fn default() -> Self {
        ImuSpec { gravity_mps2: 9.81, ..ImuSpec::zeroed() }
    }
}

/// Error model of a GNSS receiver; zeros are an ideal receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GnssSpec {
    /// Standard deviation of the white noise.
    pub latitude_stddev_deg: f32,
    /// Constant bias.
    pub latitude_bias_deg: f32,
    /// Standard deviation of the white noise.
    pub longitude_stddev_deg: f32,
    /// Constant bias.
    pub longitude_bias_deg: f32,
    /// Standard deviation of the white noise.
    pub altitude_stddev_m: f32,
    /// Constant bias.
    pub altitude_bias_m: f32,
    /// Standard deviation of a slowly varying error, east and north (a first-order Gauss–Markov process).
    pub wander_m: f32,
    /// Standard deviation of the slowly varying error, upwards.
    pub wander_up_m: f32,
    /// Correlation time of the slowly varying error: its autocorrelation falls to 1/e in this time.
    pub wander_secs: f32,
    /// One of [`geodesy`].
    pub geodesy: u32,
}

/// Values of [`GnssSpec::geodesy`].
pub mod geodesy {
    /// The projection and ellipsoid of the map. A map without one lies on a sphere at 42 degrees north,
    /// 2 degrees east.
    pub const MAP: u32 = 0;
    /// The projection of CARLA 0.9.16: a sphere at the map's origin, with the direction to the right of
    /// x as north.
    pub const CARLA: u32 = 1;
}

/// Error model of wheel odometry; zeros are an ideal sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OdometrySpec {
    /// Relative scale error of speeds; worn tyres read high.
    pub scale_error: f32,
    /// Standard deviation of the white noise of speeds.
    pub stddev_mps: f32,
    /// Quantisation step of speeds; 0: none.
    pub step_mps: f32,
}

/// A collision sensor; it has no parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct CollisionSpec {
    /// Reserved; 0.
    pub reserved: u32,
}

/// A lane invasion sensor, which has no parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct LaneInvasionSpec {
    /// Reserved; 0.
    pub reserved: u32,
}

/// The volume that an obstacle sensor sweeps: a sphere moved along x.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ObstacleSpec {
    /// Length of the sweep along x.
    pub distance_m: f32,
    /// Radius of the sphere.
    pub hit_radius_m: f32,
    /// 1: detects actors only; 0: static objects and the ground too.
    pub only_dynamics: u32,
}

impl Default for ObstacleSpec {
    /// The defaults of CARLA.
    fn default() -> Self {
        ObstacleSpec { distance_m: 5.0, hit_radius_m: 0.5, only_dynamics: 0 }
    }
}

/// Reading of an inertial measurement unit: means over the time since its last reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ImuReading {
    /// Specific force in sensor space; at rest it points upwards with the magnitude of gravity.
    pub accelerometer_mps2: [f32; 3],
    /// Angular velocity in sensor space.
    pub gyroscope_radps: [f32; 3],
    /// Heading clockwise from north (world y), 0 to 2π.
    pub compass_rad: f32,
    /// Time over which the means were taken.
    pub over_secs: f32,
}

/// Reading of a GNSS receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GnssReading {
    /// Latitude, positive to the north.
    pub latitude_deg: f64,
    /// Longitude, positive to the east.
    pub longitude_deg: f64,
    /// Altitude above the map's zero.
    pub altitude_m: f64,
}

/// Reading of an odometry sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct OdometryReading {
    /// Speed of the sensor along its x axis; negative: backwards.
    pub speed_mps: f32,
    /// Mean rim speed of all wheels, which differs from `speed_mps` when wheels spin or lock; equal to
    /// `speed_mps` for actors without wheels.
    pub wheel_speed_mps: f32,
    /// Angular velocity about the sensor's z axis, positive to the left.
    pub yaw_rate_radps: f32,
    /// Steering angle of the front wheels, positive to the left.
    pub steer_rad: f32,
    /// Integral of `wheel_speed_mps` since the sensor was created; backwards counts negative.
    pub distance_m: f64,
}

/// A contact of the parent actor during this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CollisionReading {
    /// The other actor; [`ActorId::NONE`]: a static object.
    pub other: ActorId,
    /// Id of the static object as in instance images; 0: an actor.
    pub object: u32,
    /// Semantic tag of the other (`mesh::Tag`).
    pub tag: u32,
    /// 1: there was no contact in the frame before.
    pub began: u32,
    /// Impulse on the parent actor during the frame in world space, N s.
    pub impulse_ns: [f32; 3],
}

/// A lane marking that a corner of the parent actor crossed during this frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LaneInvasionReading {
    /// Type of the marking: `road::MarkKind` as a number.
    pub kind: u32,
    /// Colour of the marking: `road::MarkColor` as a number.
    pub color: u32,
    /// Permitted lane change: `road::MarkChange` as a number.
    pub change: u32,
    /// Width of a single line.
    pub width_m: f32,
    /// The corner: 0 front left, 1 front right, 2 rear left, 3 rear right.
    pub corner: u32,
    /// 1: the marking is on the left of the lane that the corner left; 0: on the right.
    pub to_left: u32,
    /// The lane that the corner left: index into `road::Network::lanes`.
    pub from_lane: u32,
    /// OpenDRIVE id of that lane.
    pub from_lane_id: i32,
}

/// The nearest obstacle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct ObstacleReading {
    /// The actor; [`ActorId::NONE`]: a static object or the ground.
    pub other: ActorId,
    /// Id of the static object as in instance images; 0: an actor or the ground.
    pub object: u32,
    /// Semantic tag (`mesh::Tag`).
    pub tag: u32,
    /// Distance that the sphere moved until it touched the obstacle.
    pub distance_m: f32,
}

impl ImuSpec {
    fn fault(&self) -> Result<(), String> {
        each("accelerometer_stddev_mps2", &self.accelerometer_stddev_mps2, 0.0, 1e3)?;
        each("gyroscope_stddev_radps", &self.gyroscope_stddev_radps, 0.0, 1e3)?;
        each("gyroscope_bias_radps", &self.gyroscope_bias_radps, -1e3, 1e3)?;
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
