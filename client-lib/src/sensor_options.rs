//! Parameters of cameras, lidars and the sensors of motion and contact.

use std::{f32::consts::TAU, time::Duration};

use glam::Vec3;
use protocol::{GnssSpec, ImuSpec, ObstacleSpec, OdometrySpec, geodesy, point_attribute, quality};

use crate::{
    CameraEffects, CameraOutputs, Elevations, Intrinsics, Lens, LidarOutputs, options::options,
};

options! {
    /// Parameters of a camera.
    pub struct CameraOptions {
        /// Width of the image, pixels.
        width: u32,
        /// Height of the image, pixels.
        height: u32,
        /// Horizontal field of view, radians, from the left to the right edge of the image: above 0 and
        /// below π, of a fisheye below 2π; pixels are square. Without effect if `intrinsics` are given.
        fov_rad: f32,
        /// Lens.
        lens: Lens,
        /// Focal lengths and principal point, as a calibration has them; `None`: those of the field of
        /// view, with the principal point in the middle of the image.
        intrinsics: Option<Intrinsics>,
        /// Images that it gives.
        outputs: CameraOutputs,
        /// Rays per pixel of the colour image.
        quality: Quality,
        /// Effects on the colour image.
        effects: CameraEffects,
    }
}

impl CameraOptions {
    /// Returns the parameters of a camera that gives colour: size in pixels, horizontal field of
    /// view in radians.
    pub fn new(width: u32, height: u32, fov_rad: f32) -> CameraOptions {
        CameraOptions {
            width,
            height,
            fov_rad,
            lens: Lens::Pinhole,
            intrinsics: None,
            outputs: CameraOutputs::COLOR,
            quality: Quality::Default,
            effects: CameraEffects::NONE,
        }
    }

    /// Returns the parameters of a calibrated camera that gives colour: size in pixels, focal lengths,
    /// principal point and lens.
    pub fn calibrated(
        width: u32,
        height: u32,
        intrinsics: Intrinsics,
        lens: Lens,
    ) -> CameraOptions {
        CameraOptions::new(width, height, 0.0).lens(lens).intrinsics(Some(intrinsics))
    }
}

/// Rays per pixel of a colour image. The other outputs of a camera have one ray through the centre of
/// each pixel at every quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum Quality {
    /// That of the simulator (`omnibus run --quality`).
    #[default]
    Default = quality::DEFAULT,
    /// One ray, hard shadows.
    Low = quality::LOW,
    /// Four rays.
    Standard = quality::STANDARD,
    /// Sixteen rays.
    Epic = quality::EPIC,
}

/// The fourth number of a lidar's point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum PointAttribute {
    /// Intensity of the return, 0 to 1.
    #[default]
    Intensity = point_attribute::INTENSITY,
    /// Cosine of the angle of incidence, above 0 to 1.
    CosIncidence = point_attribute::COS_INCIDENCE,
}

options! {
    /// Parameters of a lidar.
    pub struct LidarOptions {
        /// Number of channels (beams).
        channels: u32,
        /// Azimuth steps in one frame.
        columns: u32,
        /// Horizontal field of view, radians; 2π is a full turn.
        fov_rad: f32,
        /// Elevation of the lowest channel, radians, positive upwards. Channels are spaced equally.
        lower_rad: f32,
        /// Elevation of the highest channel, radians, positive upwards.
        upper_rad: f32,
        /// Elevation of each channel; `None`: they are spaced equally. If given, they are as many as there
        /// are channels, and `channels`, `lower_rad` and `upper_rad` have no effect.
        elevations: Option<Elevations>,
        /// Longest range, metres.
        range_m: f32,
        /// Standard deviation of the range, along the ray, metres.
        noise_m: f32,
        /// Fraction of the returns that are dropped at random, 0 to 1.
        dropoff: f32,
        /// Attenuation: the intensity falls as `exp(-attenuation_per_m · distance)`, 1/m.
        attenuation_per_m: f32,
        /// Revolutions per second; `None`: the whole field of view at one instant in every frame.
        rotation_rate_hz: Option<f32>,
        /// Turns per second of the two prisms of a Risley scanner, whose beams draw a rosette with the
        /// diameter `fov_rad`; `None`: columns and channels. The beams are numbered in the order of time.
        prism_hz: Option<[f32; 2]>,
        /// Whether each column starts where the sensor was at the time of the column: points are then in
        /// sensor space at that time, as those of a real lidar before its motion is compensated. Needs
        /// `rotation_rate_hz` or `prism_hz`.
        sweep: bool,
        /// Full angle of the cone of a beam, radians, at most 0.1; 0: a ray. A wide beam has seven rays and
        /// can have several returns.
        divergence_rad: f32,
        /// Whether fog, rain and spray of the simulated weather attenuate pulses and reflect them.
        weather: bool,
        /// The fourth number of a point.
        point_attribute: PointAttribute,
        /// What it gives for each ray.
        outputs: LidarOutputs,
    }
}

impl LidarOptions {
    /// Returns the parameters of a lidar without noise that measures a whole revolution in every
    /// frame: `channels` between the elevations `lower_rad` and `upper_rad` (radians), `columns`
    /// azimuth steps, a range in metres; CARLA's attenuation of 0.004 1/m, points and labels.
    pub fn new(
        channels: u32,
        columns: u32,
        [lower_rad, upper_rad]: [f32; 2],
        range_m: f32,
    ) -> LidarOptions {
        LidarOptions {
            channels,
            columns,
            fov_rad: TAU,
            lower_rad,
            upper_rad,
            elevations: None,
            range_m,
            noise_m: 0.0,
            dropoff: 0.0,
            attenuation_per_m: 0.004,
            rotation_rate_hz: None,
            prism_hz: None,
            sweep: false,
            divergence_rad: 0.0,
            weather: false,
            point_attribute: PointAttribute::Intensity,
            outputs: LidarOutputs::POINTS | LidarOutputs::LABELS,
        }
    }
}

options! {
    /// Error model of an inertial measurement unit. Axes are those of the sensor: x forward, y
    /// left, z up. The default is an ideal sensor on the earth.
    pub struct ImuOptions {
        /// Standard deviation of the accelerometer's white noise, by axis, m/s².
        accelerometer_stddev: Vec3,
        /// Standard deviation of the gyroscope's white noise, by axis, rad/s.
        gyroscope_stddev: Vec3,
        /// Constant bias of the gyroscope, by axis, rad/s.
        gyroscope_bias: Vec3,
        /// Random walk of the accelerometer's bias, m/s²/√s: the standard deviation after one
        /// second.
        accelerometer_walk: f32,
        /// Random walk of the gyroscope's bias, rad/s/√s: the standard deviation after one second.
        gyroscope_walk: f32,
        /// Specific force at rest, upwards, m/s².
        gravity_mps2: f32,
        /// Measurement range of the accelerometer along each axis, m/s²; `None`: unlimited.
        accelerometer_max_mps2: Option<f32>,
    }
}

impl Default for ImuOptions {
    fn default() -> ImuOptions {
        ImuOptions {
            accelerometer_stddev: Vec3::ZERO,
            gyroscope_stddev: Vec3::ZERO,
            gyroscope_bias: Vec3::ZERO,
            accelerometer_walk: 0.0,
            gyroscope_walk: 0.0,
            gravity_mps2: 9.81,
            accelerometer_max_mps2: None,
        }
    }
}

impl ImuOptions {
    pub(crate) fn wire(&self) -> ImuSpec {
        ImuSpec {
            accelerometer_stddev_mps2: self.accelerometer_stddev.to_array(),
            gyroscope_stddev_radps: self.gyroscope_stddev.to_array(),
            gyroscope_bias_radps: self.gyroscope_bias.to_array(),
            accelerometer_walk: self.accelerometer_walk,
            gyroscope_walk: self.gyroscope_walk,
            gravity_mps2: self.gravity_mps2,
            accelerometer_max_mps2: self.accelerometer_max_mps2.unwrap_or(0.0),
        }
    }
}

/// How a GNSS receiver converts positions on the map to latitude, longitude and altitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
#[non_exhaustive]
pub enum Geodesy {
    /// By the projection and ellipsoid of the map's header. A map without one lies on a sphere at
    /// 42 degrees north, 2 degrees east.
    #[default]
    Map = geodesy::MAP,
    /// As CARLA 0.9.16: a sphere at the map's origin, with the direction to the right of x as
    /// north.
    Carla = geodesy::CARLA,
}

options! {
    /// Error model of a GNSS receiver. The default is an ideal receiver.
    #[derive(Default)]
    pub struct GnssOptions {
        /// Standard deviation of the white noise of the latitude, degrees.
        latitude_stddev_deg: f32,
        /// Constant bias of the latitude, degrees.
        latitude_bias_deg: f32,
        /// Standard deviation of the white noise of the longitude, degrees.
        longitude_stddev_deg: f32,
        /// Constant bias of the longitude, degrees.
        longitude_bias_deg: f32,
        /// Standard deviation of the white noise of the altitude, metres.
        altitude_stddev_m: f32,
        /// Constant bias of the altitude, metres.
        altitude_bias_m: f32,
        /// Standard deviation of a slowly varying error, east and north, metres: a first-order
        /// Gauss–Markov process.
        wander_m: f32,
        /// Standard deviation of the slowly varying error, upwards, metres.
        wander_up_m: f32,
        /// Correlation time of the slowly varying error: its autocorrelation falls to 1/e in this
        /// time.
        wander_time: Duration,
        /// Conversion of positions to coordinates.
        geodesy: Geodesy,
    }
}

impl GnssOptions {
    pub(crate) fn wire(&self) -> GnssSpec {
        GnssSpec {
            latitude_stddev_deg: self.latitude_stddev_deg,
            latitude_bias_deg: self.latitude_bias_deg,
            longitude_stddev_deg: self.longitude_stddev_deg,
            longitude_bias_deg: self.longitude_bias_deg,
            altitude_stddev_m: self.altitude_stddev_m,
            altitude_bias_m: self.altitude_bias_m,
            wander_m: self.wander_m,
            wander_up_m: self.wander_up_m,
            wander_secs: self.wander_time.as_secs_f32(),
            geodesy: self.geodesy as u32,
        }
    }
}

options! {
    /// Error model of wheel odometry. The default is an ideal sensor.
    #[derive(Default)]
    pub struct OdometryOptions {
        /// Relative scale error of speeds, a fraction; worn tyres read high.
        scale_error: f32,
        /// Standard deviation of the white noise of speeds, m/s.
        stddev_mps: f32,
        /// Quantisation step of speeds, m/s; `None`: not quantised.
        step_mps: Option<f32>,
    }
}

impl OdometryOptions {
    pub(crate) fn wire(&self) -> OdometrySpec {
        OdometrySpec {
            scale_error: self.scale_error,
            stddev_mps: self.stddev_mps,
            step_mps: self.step_mps.unwrap_or(0.0),
        }
    }
}

options! {
    /// The volume that an obstacle sensor sweeps: a sphere moved along x. The default is CARLA's:
    /// 5 m, a radius of 0.5 m, actors and static objects.
    pub struct ObstacleOptions {
        /// Length of the sweep along x, metres.
        distance_m: f32,
        /// Radius of the sphere, metres.
        hit_radius_m: f32,
        /// Whether only actors are detected, not static objects and the ground.
        only_actors: bool,
    }
}

impl Default for ObstacleOptions {
    fn default() -> ObstacleOptions {
        ObstacleOptions { distance_m: 5.0, hit_radius_m: 0.5, only_actors: false }
    }
}

impl ObstacleOptions {
    pub(crate) fn wire(&self) -> ObstacleSpec {
        ObstacleSpec {
            distance_m: self.distance_m,
            hit_radius_m: self.hit_radius_m,
            only_dynamics: self.only_actors.into(),
        }
    }
}
