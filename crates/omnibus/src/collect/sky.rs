//! Weathers by name, and the sun by the hour.

use anyhow::{anyhow, ensure};
use protocol::Weather;
use serde::{Deserialize, Serialize};

/// A weather: a preset, and values that differ from it. The sun's azimuth and altitude are in degrees, as
/// in CARLA; other numbers have CARLA's meaning, too.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct WeatherEntry {
    /// One of [`PRESETS`]; `clear` if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) preset: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cloudiness: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    precipitation: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    precipitation_deposits: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wind_intensity: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fog_density: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fog_distance_m: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wetness: Option<f32>,
    /// Counter-clockwise from x.
    #[serde(skip_serializing_if = "Option::is_none")]
    sun_azimuth_deg: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sun_altitude_deg: Option<f32>,
}

/// The names of weathers: cloudiness, precipitation, its deposits, wind, fog and wetness of each.
const PRESETS: [(&str, [f32; 6]); 8] = [
    ("clear", [10.0, 0.0, 0.0, 10.0, 2.0, 0.0]),
    ("cloudy", [60.0, 0.0, 0.0, 10.0, 3.0, 0.0]),
    ("overcast", [100.0, 0.0, 0.0, 20.0, 5.0, 0.0]),
    ("wet", [20.0, 0.0, 50.0, 10.0, 3.0, 60.0]),
    ("drizzle", [80.0, 20.0, 40.0, 15.0, 5.0, 70.0]),
    ("rain", [90.0, 60.0, 70.0, 40.0, 8.0, 100.0]),
    ("storm", [100.0, 100.0, 90.0, 100.0, 12.0, 100.0]),
    ("fog", [70.0, 0.0, 10.0, 5.0, 60.0, 20.0]),
];

impl WeatherEntry {
    /// The weather of a preset.
    pub(crate) fn preset(name: &str) -> WeatherEntry {
        WeatherEntry { preset: Some(name.to_owned()), ..WeatherEntry::default() }
    }

    /// Returns the weather; without a sun of its own, that of the default.
    ///
    /// # Errors
    ///
    /// The preset is unknown, or a value is out of range.
    pub(crate) fn weather(&self) -> anyhow::Result<Weather> {
        self.weather_after(&Weather::default())
    }

    /// Returns the weather that follows another; without a sun of its own, the sun stays where it is.
    ///
    /// # Errors
    ///
    /// As [`WeatherEntry::weather`].
    pub(crate) fn weather_after(&self, usual: &Weather) -> anyhow::Result<Weather> {
        let name = self.preset.as_deref().unwrap_or("clear");
        let found = PRESETS.iter().find(|(known, _)| *known == name);
        let [cloudiness, precipitation, deposits, wind, fog, wetness] =
            found.map(|(_, values)| *values).ok_or_else(|| {
                let known = PRESETS.map(|(known, _)| known).join(", ");
                anyhow!("unknown weather {name:?}; use one of {known}")
            })?;
        let percent = |what: &str, own: Option<f32>, preset: f32| {
            let value = own.unwrap_or(preset);
            ensure!((0.0..=100.0).contains(&value), "{what} is {value}; use 0 to 100");
            Ok(value)
        };
        let angle = |what: &str, own: Option<f32>, usual: f32, most: f32| {
            let deg = own.unwrap_or(usual.to_degrees());
            ensure!((-most..=most).contains(&deg), "{what} is {deg}; use -{most} to {most}");
            Ok(own.map_or(usual, f32::to_radians))
        };
        let fog_distance_m = self.fog_distance_m.unwrap_or(usual.fog_distance_m);
        ensure!(
            (0.0..=1e5).contains(&fog_distance_m),
            "fog_distance_m is {fog_distance_m}; use 0 to 100000"
        );
        Ok(Weather {
            cloudiness: percent("cloudiness", self.cloudiness, cloudiness)?,
            precipitation: percent("precipitation", self.precipitation, precipitation)?,
            precipitation_deposits: percent(
                "precipitation_deposits",
                self.precipitation_deposits,
                deposits,
            )?,
            wind_intensity: percent("wind_intensity", self.wind_intensity, wind)?,
            fog_density: percent("fog_density", self.fog_density, fog)?,
            fog_distance_m,
            wetness: percent("wetness", self.wetness, wetness)?,
            sun_azimuth_rad: angle(
                "sun_azimuth_deg",
                self.sun_azimuth_deg,
                usual.sun_azimuth_rad,
                360.0,
            )?,
            sun_altitude_rad: angle(
                "sun_altitude_deg",
                self.sun_altitude_deg,
                usual.sun_altitude_rad,
                90.0,
            )?,
        })
    }
}

/// Latitude of the sun's daily path, the same as on the page of `omnibus view`.
const LATITUDE_DEG: f32 = 30.0;

/// Returns the altitude of the sun, and its azimuth counter-clockwise from east, at an hour of solar time
/// at an equinox: sin(altitude) = cos(latitude) cos(h) with the hour angle h, 15 degrees an hour from
/// noon (Meeus, Astronomical Algorithms, chapter 13, with a declination of 0).
pub(crate) fn sun_rad(hour: f32) -> [f32; 2] {
    let (latitude, angle) = (LATITUDE_DEG.to_radians(), ((hour - 12.0) * 15.0).to_radians());
    let [east, north, up] =
        [-angle.sin(), -latitude.sin() * angle.cos(), latitude.cos() * angle.cos()];
    [up.clamp(-1.0, 1.0).asin(), north.atan2(east)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_rises_in_the_east_is_south_at_noon_and_sets_in_the_west() {
        let degrees = |hour| sun_rad(hour).map(f32::to_degrees);
        let near =
            |[a, b]: [f32; 2], [c, d]: [f32; 2]| (a - c).abs() < 0.01 && (b - d).abs() < 0.01;
        assert!(near(degrees(6.0), [0.0, 0.0]), "{:?}", degrees(6.0));
        assert!(near(degrees(12.0), [60.0, -90.0]), "{:?}", degrees(12.0));
        let [altitude, azimuth] = degrees(18.0);
        assert!(altitude.abs() < 0.01 && (azimuth.abs() - 180.0).abs() < 0.01, "{azimuth}");
        assert!((degrees(0.0)[0] + 60.0).abs() < 0.01);
    }

    #[test]
    fn a_value_replaces_that_of_the_preset() {
        let entry = WeatherEntry { wetness: Some(5.0), ..WeatherEntry::preset("rain") };
        let weather = entry.weather().unwrap();
        assert_eq!((weather.precipitation, weather.wetness), (60.0, 5.0));
        assert_eq!(weather.sun_altitude_rad, Weather::default().sun_altitude_rad);
        let entry = WeatherEntry { sun_altitude_deg: Some(-30.0), ..WeatherEntry::default() };
        assert_eq!(entry.weather().unwrap().sun_altitude_rad, (-30.0_f32).to_radians());
        assert_eq!(WeatherEntry::default().weather().unwrap(), Weather::default());
    }
}
