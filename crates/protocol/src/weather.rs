//! Sun, clouds, rain and fog.

use bytemuck::{Pod, Zeroable};

/// Parameters of [`crate::Command::SetWeather`]. Percentages have the meaning that CARLA gives them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Weather {
    /// 0 to 100.
    pub cloudiness: f32,
    /// 0 to 100.
    pub precipitation: f32,
    /// Puddles, 0 to 100.
    pub precipitation_deposits: f32,
    /// 0 to 100.
    pub wind_intensity: f32,
    /// Azimuth of the sun, counter-clockwise from x.
    pub sun_azimuth_rad: f32,
    /// Altitude of the sun above the horizon.
    pub sun_altitude_rad: f32,
    /// 0 to 100.
    pub fog_density: f32,
    /// Distance at which fog begins.
    pub fog_distance_m: f32,
    /// 0 to 100.
    pub wetness: f32,
}

impl Default for Weather {
    /// A clear afternoon.
    fn default() -> Self {
        Weather {
            cloudiness: 10.0,
            precipitation: 0.0,
            precipitation_deposits: 0.0,
            wind_intensity: 10.0,
            sun_azimuth_rad: 0.6,
            sun_altitude_rad: 0.85,
            fog_density: 2.0,
            fog_distance_m: 0.75,
            wetness: 0.0,
        }
    }
}
