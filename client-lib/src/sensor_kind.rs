//! The kinds of sensors, each with its parameters.

use protocol::{
    CollisionSpec, LaneInvasionSpec, LensSpec, LidarSpec, MessageSpec, Pose, SensorSpec,
    lidar_flag, sensor,
};

use crate::{
    CameraOptions, GnssOptions, ImuOptions, LidarOptions, ObstacleOptions, OdometryOptions,
    V2xAwarenessOptions, V2xRadioOptions,
};

/// The kind of a [`Sensor`](crate::Sensor), with the parameters of that kind.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "a lidar has a table of elevations")]
pub enum SensorKind {
    /// A camera.
    Camera(CameraOptions),
    /// A lidar.
    Lidar(LidarOptions),
    /// An inertial measurement unit.
    Imu(ImuOptions),
    /// A GNSS receiver.
    Gnss(GnssOptions),
    /// A speedometer and odometer.
    Odometry(OdometryOptions),
    /// Contacts of the carrier with actors and static objects.
    Collision,
    /// Lane markings that the carrier crosses.
    LaneInvasion,
    /// The nearest obstacle ahead.
    Obstacle(ObstacleOptions),
    /// A V2X station for cooperative awareness messages.
    V2xAwareness(V2xAwarenessOptions),
    /// A V2X station for texts.
    V2xMessages(V2xRadioOptions),
}

impl SensorKind {
    /// Returns a record with the parameters of this kind, without name, pose, period and seed.
    pub(crate) fn wire(&self) -> SensorSpec {
        let at = Pose::IDENTITY;
        match self {
            SensorKind::Camera(camera) => SensorSpec {
                kind: sensor::CAMERA,
                outputs: camera.outputs.bits(),
                width: camera.width,
                height: camera.height,
                fov_rad: camera.fov_rad,
                quality: camera.quality as u32,
                effects: camera.effects.wire(),
                lens: camera.intrinsics.map_or(camera.lens.wire(), |given| LensSpec {
                    focal_px: [given.fx, given.fy],
                    center_px: [given.cx, given.cy],
                    ..camera.lens.wire()
                }),
                ..SensorSpec::default()
            },
            SensorKind::Lidar(lidar) => of_lidar(lidar),
            SensorKind::Imu(imu) => SensorSpec::physics("", at, &imu.wire()),
            SensorKind::Gnss(gnss) => SensorSpec::physics("", at, &gnss.wire()),
            SensorKind::Odometry(odometry) => SensorSpec::physics("", at, &odometry.wire()),
            SensorKind::Collision => SensorSpec::physics("", at, &CollisionSpec::default()),
            SensorKind::LaneInvasion => SensorSpec::physics("", at, &LaneInvasionSpec::default()),
            SensorKind::Obstacle(obstacle) => SensorSpec::physics("", at, &obstacle.wire()),
            SensorKind::V2xAwareness(station) => SensorSpec::physics("", at, &station.wire()),
            SensorKind::V2xMessages(radio) => {
                SensorSpec::physics("", at, &MessageSpec { radio: radio.wire() })
            }
        }
    }
}

fn of_lidar(lidar: &LidarOptions) -> SensorSpec {
    let mut beams = LidarSpec {
        divergence_rad: lidar.divergence_rad,
        prism_hz: lidar.prism_hz.unwrap_or_default(),
        ..LidarSpec::default()
    };
    for (flag, is_on) in [(lidar_flag::SWEEP, lidar.sweep), (lidar_flag::WEATHER, lidar.weather)] {
        beams.flags |= if is_on { flag } else { 0 };
    }
    let (mut channels, mut between) = (lidar.channels, [lidar.lower_rad, lidar.upper_rad]);
    if let Some(elevations) = &lidar.elevations {
        beams.set_elevations(elevations.rad());
        channels = elevations.count() as u32;
        if let (Some(upper), Some(lower)) = (elevations.rad().first(), elevations.rad().last()) {
            between = [*lower, *upper];
        }
    }
    SensorSpec {
        kind: sensor::LIDAR,
        outputs: lidar.outputs.bits(),
        width: lidar.columns,
        height: channels,
        fov_rad: lidar.fov_rad,
        upper_rad: between[1],
        lower_rad: between[0],
        range_m: lidar.range_m,
        attenuation_per_m: lidar.attenuation_per_m,
        noise_m: lidar.noise_m,
        dropoff: lidar.dropoff,
        rotation_rate_hz: lidar.rotation_rate_hz.unwrap_or(0.0),
        point_attribute: lidar.point_attribute as u32,
        lidar: beams,
        ..SensorSpec::default()
    }
}

impl From<CameraOptions> for SensorKind {
    fn from(options: CameraOptions) -> SensorKind {
        SensorKind::Camera(options)
    }
}

impl From<LidarOptions> for SensorKind {
    fn from(options: LidarOptions) -> SensorKind {
        SensorKind::Lidar(options)
    }
}

impl From<ImuOptions> for SensorKind {
    fn from(options: ImuOptions) -> SensorKind {
        SensorKind::Imu(options)
    }
}

impl From<GnssOptions> for SensorKind {
    fn from(options: GnssOptions) -> SensorKind {
        SensorKind::Gnss(options)
    }
}

impl From<OdometryOptions> for SensorKind {
    fn from(options: OdometryOptions) -> SensorKind {
        SensorKind::Odometry(options)
    }
}

impl From<ObstacleOptions> for SensorKind {
    fn from(options: ObstacleOptions) -> SensorKind {
        SensorKind::Obstacle(options)
    }
}

impl From<V2xAwarenessOptions> for SensorKind {
    fn from(options: V2xAwarenessOptions) -> SensorKind {
        SensorKind::V2xAwareness(options)
    }
}
