//! Latitudes and longitudes as the official client computes them: a transverse Mercator projection
//! of a sphere, whatever else a map says of its projection.
//!
//! Its y is CARLA's, which is our south; `Map.transform_to_geolocation` has it so, and scripts
//! compare the two.

use glam::DVec3;

/// The earth's radius at the equator, times the scale that the projection has at its meridian.
const RADIUS_M: f64 = 6_378_137.0 * 0.9996;
/// Where a map lies that does not say where. Degrees.
const NOWHERE: (f64, f64) = (42.0, 2.0);

/// Where a map's origin lies on the earth. Radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GeoReference {
    latitude_rad: f64,
    longitude_rad: f64,
}

impl GeoReference {
    /// As the text of a map says.
    pub(crate) fn of(open_drive: &str) -> GeoReference {
        let begin = open_drive.find("<geoReference").unwrap_or(open_drive.len());
        let end = open_drive[begin..].find("</geoReference");
        let text = &open_drive[begin..end.map_or(begin, |at| begin + at)];
        let number = |key: &str| -> Option<f64> {
            let rest = &text[text.find(key)? + key.len()..];
            let digits = rest.find(|c: char| !"+-.0123456789eE".contains(c)).unwrap_or(rest.len());
            rest[..digits].parse().ok()
        };
        let (latitude, longitude) = number("+lat_0=").zip(number("+lon_0=")).unwrap_or(NOWHERE);
        GeoReference { latitude_rad: latitude.to_radians(), longitude_rad: longitude.to_radians() }
    }

    /// Latitude and longitude in degrees, altitude in metres, of a place in world space.
    pub(crate) fn locate(&self, place: DVec3) -> [f64; 3] {
        let east = place.x / RADIUS_M;
        let along = self.latitude_rad - place.y / RADIUS_M;
        let latitude = (along.sin() / east.cosh()).asin();
        let longitude = self.longitude_rad + east.sinh().atan2(along.cos());
        [latitude.to_degrees(), longitude.to_degrees(), place.z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the official client answered for these places in CARLA's axes.
    #[test]
    fn places_are_where_the_official_client_says() {
        let text =
            "<geoReference><![CDATA[+proj=tmerc +lat_0=52.52 +lon_0=13.4 +k=1]]></geoReference>";
        let origin = GeoReference::of(text);
        for (x, y, latitude, longitude) in [
            (1000.0, 0.0, 52.519_999_080_851_05, 13.414_769_066_390_54),
            (-5000.0, 3000.0, 52.546_937_241_502_65, 13.326_109_347_458_086),
            (20_000.0, -10_000.0, 52.429_766_059_846_85, 13.694_776_589_487_285),
        ] {
            let [lat, lon, altitude] = origin.locate(DVec3::new(x, -y, 7.0));
            assert!((lat - latitude).abs() < 1e-9 && (lon - longitude).abs() < 1e-9);
            assert_eq!(altitude, 7.0);
        }
        let [latitude, longitude, _] = GeoReference::of("").locate(DVec3::ZERO);
        assert!((latitude - 42.0).abs() < 1e-9 && (longitude - 2.0).abs() < 1e-9);
    }
}
