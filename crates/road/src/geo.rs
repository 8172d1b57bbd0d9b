//! Map projections: projected coordinates to latitude and longitude and back.

use std::f64::consts::PI;

/// A place on Earth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GeoPoint {
    /// North of the equator, degrees.
    pub latitude_deg: f64,
    /// East of Greenwich, degrees.
    pub longitude_deg: f64,
    /// Altitude in metres, relative to the map's own zero.
    pub altitude_m: f64,
}

/// A transverse Mercator projection as a PROJ string of `+proj=tmerc` or `+proj=utm` defines it.
///
/// Krüger's series to the fourth order of the third flattening: accurate to a tenth of a millimetre
/// up to 1000 km from the meridian (Karney, "Transverse Mercator with an accuracy of a few
/// nanometers", 2011, equations 7 to 15 and 35).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransverseMercator {
    lat_0_rad: f64,
    lon_0_rad: f64,
    scale: f64,
    false_east_m: f64,
    false_north_m: f64,
    /// Length of the whole meridian divided by 2π, metres.
    mean_radius_m: f64,
    eccentricity: f64,
    /// Coefficients from the conformal sphere to the projection.
    alpha: [f64; 4],
    /// Coefficients of the inverse.
    beta: [f64; 4],
}

impl TransverseMercator {
    /// Returns the projection of a PROJ string; `None` if it is of another kind.
    pub fn from_proj(text: &str) -> Option<TransverseMercator> {
        let value = |key: &str| {
            let words = text.split_whitespace().filter_map(|word| word.strip_prefix('+'));
            words.filter_map(|word| word.split_once('=')).find(|(k, _)| *k == key).map(|(_, v)| v)
        };
        let number = |key: &str| value(key)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let has_flag = |flag: &str| text.split_whitespace().any(|word| word == flag);
        let is_utm = value("proj") == Some("utm");
        // Old towns give no projection, only the position of their origin.
        let is_bare = value("proj").is_none() && number("lat_0").is_some();
        if !(is_utm || is_bare || value("proj") == Some("tmerc")) {
            return None;
        }
        let (axis_m, flattening) = match (number("a"), number("b"), number("rf"), value("ellps")) {
            (Some(a), Some(b), ..) => (a, (a - b) / a),
            (Some(a), _, Some(rf), _) => (a, 1.0 / rf),
            (Some(a), ..) => (a, 0.0),
            (_, _, _, Some("GRS80")) => (6_378_137.0, 1.0 / 298.257_222_101),
            (_, _, _, Some("bessel")) => (6_377_397.155, 1.0 / 299.152_812_8),
            (_, _, _, Some("intl")) => (6_378_388.0, 1.0 / 297.0),
            (_, _, _, Some("sphere")) => (6_370_997.0, 0.0),
            _ => (6_378_137.0, 1.0 / 298.257_223_563),
        };
        let zone = number("zone").filter(|zone| (1.0..=60.0).contains(zone));
        let meridian_deg =
            if is_utm { 6.0 * zone? - 183.0 } else { number("lon_0").unwrap_or(0.0) };
        let south = is_utm && has_flag("+south");
        let plain = number("k").or(number("k_0")).unwrap_or(1.0);
        Some(TransverseMercator::new(Origin {
            latitude_deg: if is_utm { 0.0 } else { number("lat_0").unwrap_or(0.0) },
            longitude_deg: meridian_deg,
            scale: if is_utm { 0.9996 } else { plain },
            false_east_m: if is_utm { 500_000.0 } else { number("x_0").unwrap_or(0.0) },
            false_north_m: if south { 1e7 } else { number("y_0").unwrap_or(0.0) },
            axis_m,
            flattening,
        }))
    }

    fn new(origin: Origin) -> TransverseMercator {
        let n = origin.flattening / (2.0 - origin.flattening);
        let (n2, n3, n4) = (n * n, n * n * n, n * n * n * n);
        let mut projection = TransverseMercator {
            lat_0_rad: origin.latitude_deg.to_radians(),
            lon_0_rad: origin.longitude_deg.to_radians(),
            scale: origin.scale,
            false_east_m: origin.false_east_m,
            false_north_m: origin.false_north_m,
            mean_radius_m: origin.axis_m / (1.0 + n) * (1.0 + n2 / 4.0 + n4 / 64.0),
            eccentricity: (origin.flattening * (2.0 - origin.flattening)).max(0.0).sqrt(),
            alpha: [
                n / 2.0 - 2.0 * n2 / 3.0 + 5.0 * n3 / 16.0 + 41.0 * n4 / 180.0,
                13.0 * n2 / 48.0 - 3.0 * n3 / 5.0 + 557.0 * n4 / 1440.0,
                61.0 * n3 / 240.0 - 103.0 * n4 / 140.0,
                49_561.0 * n4 / 161_280.0,
            ],
            beta: [
                n / 2.0 - 2.0 * n2 / 3.0 + 37.0 * n3 / 96.0 - n4 / 360.0,
                n2 / 48.0 + n3 / 15.0 - 437.0 * n4 / 1440.0,
                17.0 * n3 / 480.0 - 37.0 * n4 / 840.0,
                4397.0 * n4 / 161_280.0,
            ],
        };
        // The series gives the northing of the origin on the meridian.
        let (_, north) = projection.unscaled(projection.lat_0_rad, 0.0);
        projection.false_north_m -= north * projection.scale * projection.mean_radius_m;
        projection
    }

    /// Returns metres east and north from latitude and longitude.
    pub fn project(&self, point: GeoPoint) -> (f64, f64) {
        let turn = point.longitude_deg.to_radians() - self.lon_0_rad;
        let turn = turn - 2.0 * PI * (turn / (2.0 * PI)).round();
        let (east, north) = self.unscaled(point.latitude_deg.to_radians(), turn);
        let metres = self.scale * self.mean_radius_m;
        (self.false_east_m + east * metres, self.false_north_m + north * metres)
    }

    /// Returns latitude and longitude from metres east and north.
    pub fn unproject(&self, east_m: f64, north_m: f64, altitude_m: f64) -> GeoPoint {
        let metres = self.scale * self.mean_radius_m;
        let (xi, eta) =
            ((north_m - self.false_north_m) / metres, (east_m - self.false_east_m) / metres);
        let (mut xi_s, mut eta_s) = (xi, eta);
        for (factor, j) in self.beta.iter().zip([2.0, 4.0, 6.0, 8.0]) {
            xi_s -= factor * (j * xi).sin() * (j * eta).cosh();
            eta_s -= factor * (j * xi).cos() * (j * eta).sinh();
        }
        let tau_s = xi_s.sin() / eta_s.sinh().hypot(xi_s.cos());
        let longitude = self.lon_0_rad + eta_s.sinh().atan2(xi_s.cos());
        GeoPoint {
            latitude_deg: self.tangent_of_conformal(tau_s).atan().to_degrees(),
            longitude_deg: longitude.to_degrees(),
            altitude_m,
        }
    }

    /// Returns easting and northing divided by the mean radius.
    fn unscaled(&self, latitude: f64, turn: f64) -> (f64, f64) {
        let tau_s = self.conformal_tangent(latitude.tan());
        let xi = tau_s.atan2(turn.cos());
        let eta = (turn.sin() / tau_s.hypot(turn.cos())).asinh();
        let (mut north, mut east) = (xi, eta);
        for (factor, j) in self.alpha.iter().zip([2.0, 4.0, 6.0, 8.0]) {
            north += factor * (j * xi).sin() * (j * eta).cosh();
            east += factor * (j * xi).cos() * (j * eta).sinh();
        }
        (east, north)
    }

    /// Returns the tangent of the conformal latitude from the tangent of the latitude.
    fn conformal_tangent(&self, tau: f64) -> f64 {
        let e = self.eccentricity;
        let sigma = (e * (e * tau / (1.0 + tau * tau).sqrt()).atanh()).sinh();
        tau * (1.0 + sigma * sigma).sqrt() - sigma * (1.0 + tau * tau).sqrt()
    }

    /// Returns the inverse of [`Self::conformal_tangent`] by Newton's method.
    fn tangent_of_conformal(&self, tau_s: f64) -> f64 {
        let flat = 1.0 - self.eccentricity * self.eccentricity;
        let mut tau = tau_s / flat;
        for _ in 0..6 {
            let wrong = tau_s - self.conformal_tangent(tau);
            let slope = flat * (1.0 + tau_s * tau_s).sqrt() * (1.0 + tau * tau).sqrt()
                / (1.0 + flat * tau * tau);
            let step = wrong / slope;
            tau += step;
            if step.abs() < 1e-14 * tau.abs().max(1.0) {
                break;
            }
        }
        tau
    }
}

/// Parameters of a projection.
struct Origin {
    latitude_deg: f64,
    longitude_deg: f64,
    scale: f64,
    false_east_m: f64,
    false_north_m: f64,
    axis_m: f64,
    flattening: f64,
}

/// CARLA's formula: a transverse Mercator projection of a sphere. It takes the position of the
/// origin from the map, and ignores its projection and the header's offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarlaMercator {
    /// Latitude of the origin, degrees.
    pub latitude_deg: f64,
    /// Longitude of the origin, degrees.
    pub longitude_deg: f64,
}

/// The Earth's equatorial radius times the scale of UTM, metres.
const CARLA_RADIUS_M: f64 = 6_378_137.0 * 0.9996;

impl CarlaMercator {
    /// Returns what CARLA reads from a geoReference; without one it assumes 42° north, 2° east.
    pub fn from_proj(text: &str) -> CarlaMercator {
        let number = |key: &str| {
            let word = text.split_whitespace().find_map(|word| word.strip_prefix(key));
            word.and_then(|value| value.parse::<f64>().ok()).filter(|value| value.is_finite())
        };
        match (number("+lat_0="), number("+lon_0=")) {
            (Some(latitude_deg), Some(longitude_deg)) => {
                CarlaMercator { latitude_deg, longitude_deg }
            }
            _ => CarlaMercator { latitude_deg: 42.0, longitude_deg: 2.0 },
        }
    }

    /// Returns latitude and longitude of `x` and `y` in CARLA's left-handed axes: version 0.9.16
    /// maps positive y, to the right of x, to the north.
    pub fn unproject(&self, x: f64, y: f64, altitude_m: f64) -> GeoPoint {
        let (east, north) =
            (x / CARLA_RADIUS_M, y / CARLA_RADIUS_M + self.latitude_deg.to_radians());
        GeoPoint {
            latitude_deg: (north.sin() / east.cosh()).asin().to_degrees(),
            longitude_deg: self.longitude_deg + east.sinh().atan2(north.cos()).to_degrees(),
            altitude_m,
        }
    }

    /// Returns `x` and `y` of a place on Earth: the inverse of [`CarlaMercator::unproject`].
    pub fn project(&self, point: GeoPoint) -> (f64, f64) {
        let latitude = point.latitude_deg.to_radians();
        let turn = (point.longitude_deg - self.longitude_deg).to_radians();
        let east = (latitude.cos() * turn.sin()).atanh();
        let north = latitude.tan().atan2(turn.cos()) - self.latitude_deg.to_radians();
        (east * CARLA_RADIUS_M, north * CARLA_RADIUS_M)
    }
}
