//! Sensors that can be put into a bundle.

use protocol::{
    CamSpec, CollisionSpec, GnssSpec, ImuSpec, LaneInvasionSpec, MessageSpec, Name, ObstacleSpec,
    OdometrySpec, Pose, SensorSpec, output, sensor,
};

/// A camera at `parent_from_sensor`; `outputs` are bits of [`output`].
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

/// A lidar that sees the whole turn at every frame: `channels` between elevations `lower_rad` and
/// `upper_rad`, `columns` azimuth steps.
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
/// This and the following sensors are measured by the host, in the midst of physics. They go into
/// bundles of their own, apart from cameras and lidars; [`crate::Client::tick_and_collect`] takes
/// both.
pub fn imu(name: &str, parent_from_sensor: Pose, errors: ImuSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A receiver of satellites.
pub fn gnss(name: &str, parent_from_sensor: Pose, errors: GnssSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// A speedometer and odometer.
pub fn odometry(name: &str, parent_from_sensor: Pose, errors: OdometrySpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &errors)
}

/// Tells of everybody and everything that touches its carrier.
pub fn collision(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &CollisionSpec::default())
}

/// Tells of the markings that its carrier crosses.
pub fn lane_invasion(name: &str) -> SensorSpec {
    SensorSpec::physics(name, Pose::IDENTITY, &LaneInvasionSpec::default())
}

/// Pushes a ball ahead, and tells what it runs into.
pub fn obstacle(name: &str, parent_from_sensor: Pose, look: ObstacleSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &look)
}

/// Sends and receives cooperative awareness messages.
pub fn cam(name: &str, parent_from_sensor: Pose, station: CamSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}

/// Sends texts ([`crate::Client::transmit`]) and receives them.
pub fn message(name: &str, parent_from_sensor: Pose, station: MessageSpec) -> SensorSpec {
    SensorSpec::physics(name, parent_from_sensor, &station)
}
