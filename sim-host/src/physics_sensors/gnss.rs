//! The GNSS receiver: geographic position and its errors.
//!
//! Besides white noise and biases, as in CARLA, there is a correlated error: a first order
//! Gauss-Markov process in metres, `e ← e · exp(−dt/τ) + σ · √(1 − exp(−2 dt/τ)) · n`, which models
//! orbits, clocks and the atmosphere (P. Groves, *Principles of GNSS, Inertial, and Multisensor
//! Integrated Navigation Systems*, 2nd edition, section 14.2.7).

use glam::{DVec3, Vec3};
use protocol::{GnssReading, GnssSpec, geodesy};
use road::{CarlaMercator, GeoPoint, Network};

use super::noise::Noise;

/// A mounted receiver.
pub(super) struct Gnss {
    spec: GnssSpec,
    /// Correlated error: east, north, up.
    wander_m: DVec3,
    has_error: bool,
}

impl Gnss {
    pub(super) fn new(spec: GnssSpec) -> Gnss {
        Gnss { spec, wander_m: DVec3::ZERO, has_error: false }
    }

    /// Advances the correlated error by one frame.
    pub(super) fn advance(&mut self, delta_secs: f32, noise: &mut Noise) {
        let spec = &self.spec;
        let keep = if self.has_error && spec.wander_secs > 0.0 {
            (-f64::from(delta_secs) / f64::from(spec.wander_secs)).exp()
        } else {
            0.0
        };
        let push = (1.0 - keep * keep).sqrt();
        let [east, north] = [noise.normal(spec.wander_m), noise.normal(spec.wander_m)];
        let drawn = DVec3::new(east, north, noise.normal(spec.wander_up_m));
        self.wander_m = self.wander_m * keep + drawn * push;
        self.has_error = true;
    }

    /// Returns the reading at a position in world space.
    pub(super) fn read(&self, place: Vec3, network: &Network, noise: &mut Noise) -> GnssReading {
        let spec = &self.spec;
        let point = locate(place.as_dvec3() + self.wander_m, network, spec.geodesy);
        let error = |noise: &mut Noise, deviation: f32, bias: f32| {
            noise.normal(deviation) + f64::from(bias)
        };
        GnssReading {
            latitude_deg: point.latitude_deg
                + error(noise, spec.latitude_stddev_deg, spec.latitude_bias_deg),
            longitude_deg: point.longitude_deg
                + error(noise, spec.longitude_stddev_deg, spec.longitude_bias_deg),
            altitude_m: point.altitude_m
                + error(noise, spec.altitude_stddev_m, spec.altitude_bias_m),
        }
    }
}

/// Returns the geographic position of a point in world space.
pub(super) fn locate(place: DVec3, network: &Network, geodesy: u32) -> GeoPoint {
    let sphere = CarlaMercator::from_proj(&network.header().geo_reference);
    if geodesy == geodesy::CARLA {
        return sphere.unproject(place.x, -place.y, place.z);
    }
    network.geo(place).unwrap_or_else(|| sphere.unproject(place.x, place.y, place.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROAD: &str = r#"<road length="9" id="1" junction="-1"><planView><geometry s="0" x="0"
        y="0" hdg="0" length="9"><line/></geometry></planView><lanes><laneSection s="0"><center>
        <lane id="0" type="none"/></center><right><lane id="-1" type="driving"><width sOffset="0"
        a="3" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>"#;

    /// Results of the official client of CARLA 0.9.16 for these positions in CARLA's axes.
    #[test]
    fn positions_agree_with_the_official_client() {
        let proj = "+proj=tmerc +lat_0=52.52 +lon_0=13.4 +k=1";
        let network = |proj: &str| {
            let reference = format!("<geoReference>{proj}</geoReference>");
            let header = format!("<header revMajor=\"1\" revMinor=\"6\">{reference}</header>");
            Network::parse(&format!("<OpenDRIVE>{header}{ROAD}</OpenDRIVE>")).unwrap()
        };
        let berlin = network(proj);
        for (x, y, latitude, longitude) in [
            (1000.0, 0.0, 52.519_999_080_851_05, 13.414_769_066_390_54),
            (-5000.0, 3000.0, 52.546_937_241_502_65, 13.326_109_347_458_086),
            (20_000.0, -10_000.0, 52.429_766_059_846_85, 13.694_776_589_487_285),
        ] {
            let point = locate(DVec3::new(x, -y, 7.0), &berlin, geodesy::CARLA);
            assert!((point.latitude_deg - latitude).abs() < 1e-9);
            assert!((point.longitude_deg - longitude).abs() < 1e-9 && point.altitude_m == 7.0);
        }
        let nowhere = locate(DVec3::ZERO, &network(""), geodesy::CARLA);
        assert!((nowhere.latitude_deg - 42.0).abs() < 1e-9);
        // The projection of the map has its own north.
        let north = locate(DVec3::new(0.0, 1000.0, 0.0), &berlin, geodesy::MAP);
        assert!((north.latitude_deg - 52.52 - 1000.0 / 111_270.0).abs() < 1e-5, "{north:?}");
    }
}
