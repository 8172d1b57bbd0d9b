//! The sensors that the host measures during physics, specified by CARLA's attributes.

use client_lib::{
    Pose,
    wire::{
        GnssSpec, ImuSpec, ObstacleSpec, SensorSpec, cam, collision, geodesy, gnss, imu, obstacle,
    },
};

use crate::{
    args::RpcError,
    radio,
    sensor_kind::Kind,
    wire::{Description, flip_turn},
};

/// The largest acceleration that CARLA's IMU measures. Metres per second squared.
const ACCELERATION_MAX_MPS2: f32 = 99.9;

/// Returns what the host measures for a sensor, or `None` if the host does not measure it.
///
/// # Errors
///
/// Returns an error if an attribute is invalid.
pub(crate) fn spec(
    kind: Kind,
    d: &Description,
    pose: Pose,
    gravity_mps2: f32,
) -> Result<Option<SensorSpec>, RpcError> {
    let number = |id: &str, otherwise: f32| d.number(id, otherwise);
    let axes = |what: &str| -> Result<[f32; 3], RpcError> {
        Ok([
            number(&format!("{what}_x"), 0.0)?,
            number(&format!("{what}_y"), 0.0)?,
            number(&format!("{what}_z"), 0.0)?,
        ])
    };
    let spec = match kind {
        Kind::Imu => {
            let errors = ImuSpec {
                accelerometer_stddev_mps2: axes("noise_accel_stddev")?.map(f32::abs),
                gyroscope_stddev_radps: axes("noise_gyro_stddev")?.map(f32::abs),
                // A normal distribution is symmetric, so only the bias is converted between the
                // axes.
                gyroscope_bias_radps: flip_turn(axes("noise_gyro_bias")?),
                gravity_mps2,
                accelerometer_max_mps2: ACCELERATION_MAX_MPS2,
                ..ImuSpec::default()
            };
            imu("imu", pose, errors)
        }
        Kind::Gnss => {
            let errors = GnssSpec {
                latitude_stddev_deg: number("noise_lat_stddev", 0.0)?.abs(),
                latitude_bias_deg: number("noise_lat_bias", 0.0)?,
                longitude_stddev_deg: number("noise_lon_stddev", 0.0)?.abs(),
                longitude_bias_deg: number("noise_lon_bias", 0.0)?,
                altitude_stddev_m: number("noise_alt_stddev", 0.0)?.abs(),
                altitude_bias_m: number("noise_alt_bias", 0.0)?,
                geodesy: geodesy::CARLA,
                ..GnssSpec::default()
            };
            gnss("gnss", pose, errors)
        }
        Kind::Collision => collision("collision"),
        Kind::Obstacle => {
            let spec = ObstacleSpec {
                distance_m: number("distance", 5.0)?.max(0.01),
                hit_radius_m: number("hit_radius", 0.5)?.max(0.001),
                only_dynamics: d.flag("only_dynamics").into(),
            };
            obstacle("obstacle", pose, spec)
        }
        Kind::V2x => cam("v2x", pose, radio::cam_spec(d)?),
        Kind::V2xCustom => client_lib::wire::message("v2x_custom", pose, radio::text_spec(d)?),
        _ => return Ok(None),
    };
    let seed = number("noise_seed", 0.0)? as u64;
    let spec = SensorSpec { seed, ..spec };
    spec.check_physics_sensor().map_err(RpcError::from)?;
    Ok(Some(spec))
}
