//! The ego's physics sensors, read at every frame, kept or not.

use client_lib::{
    Measurement,
    wire::{
        CollisionReading, GnssReading, GnssSpec, ImuReading, ImuSpec, LaneInvasionReading,
        OdometryReading, OdometrySpec, collision, gnss, imu, lane_invasion, odometry,
    },
};
use glam::{Quat, Vec3};
use mesh::Tag;
use protocol::{Pose, SensorSpec};
use serde::{Deserialize, Serialize};

/// Indices of the sensors in the bundle.
const IMU: usize = 0;
const GNSS: usize = 1;
const ODOMETRY: usize = 2;
const COLLISIONS: usize = 3;
const LANES: usize = 4;

/// Returns the ego's physics sensors, a bundle of their own. Their readings have no errors; users
/// add those that they need.
pub(crate) fn ego_sensor_specs() -> Vec<SensorSpec> {
    let middle = Pose::new(Vec3::Z, Quat::IDENTITY);
    let roof = Pose::new(Vec3::new(0.0, 0.0, 1.5), Quat::IDENTITY);
    vec![
        imu("imu", middle, ImuSpec::default()),
        gnss("gnss", roof, GnssSpec::default()),
        odometry("odometry", Pose::IDENTITY, OdometrySpec::default()),
        collision("collisions"),
        lane_invasion("lane_invasions"),
    ]
}

/// The readings of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct EgoSensors {
    pub(crate) frame: u64,
    pub(crate) sim_time_nanos: u64,
    pub(crate) imu: Imu,
    pub(crate) gnss: Gnss,
    pub(crate) odometry: Odometry,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) collisions: Vec<Collision>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) lane_invasions: Vec<LaneInvasion>,
}

/// Means over the frame, in sensor space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Imu {
    pub(crate) accelerometer_mps2: [f32; 3],
    pub(crate) gyroscope_radps: [f32; 3],
    pub(crate) compass_rad: f32,
}

/// Position by the projection of the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gnss {
    pub(crate) latitude_deg: f64,
    pub(crate) longitude_deg: f64,
    pub(crate) altitude_m: f64,
}

/// Motion at the vehicle's origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Odometry {
    pub(crate) speed_mps: f32,
    pub(crate) wheel_speed_mps: f32,
    pub(crate) yaw_rate_radps: f32,
    pub(crate) steer_rad: f32,
    /// Distance since the ego was spawned.
    pub(crate) distance_m: f64,
}

/// A contact of the ego during one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Collision {
    /// The id as in images: of an actor, or of a static object of the town.
    pub(crate) id: u32,
    pub(crate) tag_name: String,
    /// Whether the two did not touch in the frame before.
    pub(crate) is_first_contact: bool,
    /// The impulse on the ego, in world space. Newton seconds.
    pub(crate) impulse_newton_s: [f32; 3],
}

/// A marking that a corner of the ego crossed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneInvasion {
    /// OpenDRIVE's name of the type of road mark.
    pub(crate) marking_type: String,
    /// OpenDRIVE's name of the colour of the road mark.
    pub(crate) marking_color: String,
    pub(crate) corner: String,
    pub(crate) to_left: bool,
    /// OpenDRIVE's id of the lane that the corner left.
    pub(crate) from_lane_id: i32,
}

impl EgoSensors {
    /// Returns the readings of a bundle, or `None` if it is not of [`ego_sensor_specs`].
    pub(crate) fn of(measured: &Measurement) -> Option<EgoSensors> {
        let stamp = measured.header().stamp;
        let imu = measured.readings::<ImuReading>(IMU).first()?;
        let fix = measured.readings::<GnssReading>(GNSS).first()?;
        let rolled = measured.readings::<OdometryReading>(ODOMETRY).first()?;
        Some(EgoSensors {
            frame: stamp.frame.0,
            sim_time_nanos: stamp.sim_time_nanos,
            imu: Imu {
                accelerometer_mps2: imu.accelerometer_mps2,
                gyroscope_radps: imu.gyroscope_radps,
                compass_rad: imu.compass_rad,
            },
            gnss: Gnss {
                latitude_deg: fix.latitude_deg,
                longitude_deg: fix.longitude_deg,
                altitude_m: fix.altitude_m,
            },
            odometry: Odometry {
                speed_mps: rolled.speed_mps,
                wheel_speed_mps: rolled.wheel_speed_mps,
                yaw_rate_radps: rolled.yaw_rate_radps,
                steer_rad: rolled.steer_rad,
                distance_m: rolled.distance_m,
            },
            collisions: measured.readings(COLLISIONS).iter().map(touch).collect(),
            lane_invasions: measured.readings(LANES).iter().map(crossing).collect(),
        })
    }
}

fn touch(reading: &CollisionReading) -> Collision {
    let tag = Tag::from_code(reading.tag as u8).unwrap_or(Tag::Unlabeled);
    // As in the images of the data set, where bit 23 marks the id of a static object.
    let object = reading.object & 0x7f_ffff | 0x80_0000;
    Collision {
        id: if reading.object == 0 { reading.other.0 } else { object },
        tag_name: format!("{tag:?}"),
        is_first_contact: reading.began != 0,
        impulse_newton_s: reading.impulse_ns,
    }
}

fn crossing(reading: &LaneInvasionReading) -> LaneInvasion {
    let kind = road::MarkKind::from_number(reading.kind);
    let color = road::MarkColor::from_number(reading.color);
    let corners = ["front left", "front right", "rear left", "rear right"];
    LaneInvasion {
        marking_type: kind.map_or("", road::MarkKind::text).to_owned(),
        marking_color: color.map_or("", road::MarkColor::text).to_owned(),
        corner: corners.get(reading.corner as usize).copied().unwrap_or_default().to_owned(),
        to_left: reading.to_left != 0,
        from_lane_id: reading.from_lane_id,
    }
}
