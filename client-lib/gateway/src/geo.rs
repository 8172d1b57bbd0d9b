//! Latitudes and longitudes, by CARLA's own formula: a Mercator projection scaled at the origin.

use std::f64::consts::PI;

use glam::DVec3;

/// The earth's radius at the equator.
const EARTH_M: f64 = 6_378_137.0;
/// Where a map lies that does not say where.
const NOWHERE: (f64, f64) = (42.0, 2.0);

/// Where a map's origin lies on the earth. Degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GeoReference {
    latitude_deg: f64,
    longitude_deg: f64,
}

impl GeoReference {
    /// As the text of a map says.
    pub(crate) fn of(open_drive: &str) -> GeoReference {
        let begin = open_drive.find("<geoReference").unwrap_or(open_drive.len());
        let end = open_drive[begin..].find("</geoReference").map_or(begin, |at| begin + at);
        let text = &open_drive[begin..end];
        let number = |key: &str, otherwise: f64| {
            let at = text.find(key)? + key.len();
            let rest = &text[at..];
            let digits = rest.find(|c: char| !"+-.0123456789eE".contains(c)).unwrap_or(rest.len());
            rest[..digits].parse().ok().or(Some(otherwise))
        };
        GeoReference {
            latitude_deg: number("+lat_0=", NOWHERE.0).unwrap_or(NOWHERE.0),
            longitude_deg: number("+lon_0=", NOWHERE.1).unwrap_or(NOWHERE.1),
        }
    }

    /// Latitude and longitude in degrees, altitude in metres, of a place in world space.
    pub(crate) fn locate(&self, place: DVec3) -> [f64; 3] {
        let scale = self.latitude_deg.to_radians().cos();
        let x = scale * PI * self.longitude_deg * EARTH_M / 180.0 + place.x;
        let tangent = ((90.0 + self.latitude_deg) * PI / 360.0).tan();
        let y = scale * EARTH_M * tangent.ln() + place.y;
        let longitude = x * 180.0 / (PI * EARTH_M * scale);
        let latitude = 360.0 * (y / (EARTH_M * scale)).exp().atan() / PI - 90.0;
        [latitude, longitude, place.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_in_the_north_has_a_higher_latitude() {
        let text =
            "<geoReference><![CDATA[+proj=tmerc +lat_0=49.5 +lon_0=8.25 +k=1]]></geoReference>";
        let origin = GeoReference::of(text);
        let [latitude, longitude, altitude] = origin.locate(DVec3::new(0.0, 1000.0, 3.0));
        assert!((latitude - 49.508_983).abs() < 1e-4 && (longitude - 8.25).abs() < 1e-9);
        assert_eq!(altitude, 3.0);
        assert_eq!(GeoReference::of(""), GeoReference { latitude_deg: 42.0, longitude_deg: 2.0 });
    }
}
