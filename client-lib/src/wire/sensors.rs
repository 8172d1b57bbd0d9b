//! Records of sensors in the protocol's layout; [`Sensor`](crate::Sensor) is the typed way.

use protocol::{
    CamSpec, CollisionSpec, GnssSpec, ImuSpec, LaneInvasionSpec, MessageSpec, Name, ObstacleSpec,
    OdometrySpec, Pose, SensorSpec, output, sensor,
};

/// A pinhole camera at `parent_from_sensor`, `width` × `height` pixels, with a horizontal field of
/// view of `fov_rad`; `outputs` are bits of [`output`].
#[must_use]
pub fn camera(
    name: &str,
    parent_from_sensor: Pose,
    width: u32,
    height: u32,
    fov_rad: f32,
    outputs: impl Into<u32>,
) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::CAMERA,
        outputs: outputs.into(),
        parent_from_sensor,
        width,
        height,
        fov_rad,
        ..SensorSpec::default()
    }
}

/// A lidar that measures a whole revolution at every frame: `channels` between the elevations
/// `lower_rad` and `upper_rad`, `columns` azimuth steps.
#[must_use]
pub fn lidar(
    name: &str,
    parent_from_sensor: Pose,
    channels: u32,
    columns: u32,
    [lower_rad, upper_rad]: [f32; 2],
    range_m: f32,
) -> SensorSpec {
    SensorSpec {
        name: Name::new(name),
        kind: sensor::LIDAR,
        outputs: output::POINTS | output::LABELS,
        parent_from_sensor,
        width: columns,
        height: channels,
        fov_rad: std::f32::consts::TAU,
        upper_rad,
        lower_rad,
        range_m,
        attenuation_per_m: 0.004,
        ..SensorSpec::default()
    }
}

/// An inertial measurement unit.
///
/// This and the following sensors are physics sensors, which the host measures in the substeps of
/// physics. A bundle has either physics sensors or cameras and lidars;
/// [`Client::tick_and_collect`](crate::Client::tick_and_collect) takes bundles of both.
#[must_use]
pub fn imu(name: &str, parent_from_sensor: Pose, errors: ImuSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A GNSS receiver.
#[must_use]
pub fn gnss(name: &str, parent_from_sensor: Pose, errors: GnssSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A speedometer and odometer.
#[must_use]
pub fn odometry(name: &str, parent_from_sensor: Pose, errors: OdometrySpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A sensor of the contacts of its carrier with actors and map objects.
#[must_use]
pub fn collision(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &CollisionSpec::default())
}

/// A sensor of the lane markings that its carrier crosses.
#[must_use]
pub fn lane_invasion(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &LaneInvasionSpec::default())
}

/// A sensor of the nearest obstacle ahead: the first hit of a sphere that is swept forwards.
#[must_use]
pub fn obstacle(name: &str, parent_from_sensor: Pose, look: ObstacleSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &look)
}

/// A V2X radio that sends and receives cooperative awareness messages.
#[must_use]
pub fn cam(name: &str, parent_from_sensor: Pose, station: CamSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}

/// A V2X radio that receives texts and sends those of
/// [`Client::transmit`](crate::Client::transmit).
#[must_use]
pub fn message(name: &str, parent_from_sensor: Pose, station: MessageSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}
