//! Path loss of radio transmissions.
//!
//! The channel models of ETSI TR 103 257-1 (2019): WINNER+ path loss, shadow fading of its table 6,
//! and knife-edge diffraction by vehicles (ITU-R P.526); or a geometric model with two-ray ground
//! reflection (C. Sommer and F. Dressler, *Using the right two-ray model?*, MobiCom 2011), free
//! space and a log-distance law. The formulas are those of CARLA's sensor.

use std::f64::consts::{PI, TAU};

use glam::Vec3;
use protocol::{RadioSpec, radio};

use super::noise::Noise;

const LIGHT_MPS: f64 = 299_792_458.0;
/// Relative permittivity of the road, for the reflected ray.
const ROAD_PERMITTIVITY: f64 = 1.02;

/// Obstruction of the line of sight.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sight {
    /// No obstruction.
    Clear,
    /// Vehicles, by the tops of their boxes.
    Vehicles(Vec<Vec3>),
    /// A building or the ground.
    Blocked,
}

/// The positions of two antennas, and the lower of the ground heights below them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) from: Vec3,
    pub(super) to: Vec3,
    pub(super) ground_m: f32,
}

/// Returns the loss in dB, shadow fading included.
pub(super) fn loss_db(spec: &RadioSpec, span: &Span, sight: &Sight, noise: &mut Noise) -> f64 {
    let distance = f64::from(span.from.distance(span.to)).max(0.1);
    let path = if spec.flags & radio::GEOMETRIC != 0 {
        geometric_db(spec, span, sight, distance)
    } else {
        winner_db(spec, span, sight, distance)
    };
    path + noise.normal(fading_db(spec, sight))
}

fn wavelength_m(spec: &RadioSpec) -> f64 {
    LIGHT_MPS / (f64::from(spec.frequency_ghz) * 1e9)
}

fn winner_db(spec: &RadioSpec, span: &Span, sight: &Sight, distance_m: f64) -> f64 {
    let (distance, frequency) = (distance_m.log10(), f64::from(spec.frequency_ghz).log10());
    if *sight == Sight::Blocked {
        return 36.85 + 30.0 * distance + 18.9 * frequency;
    }
    let open = if spec.scenario == radio::HIGHWAY {
        32.4 + 20.0 * distance + 20.0 * frequency
    } else {
        38.77 + 16.7 * distance + 18.2 * frequency
    };
    open + edges_db(spec, span, sight)
}

fn geometric_db(spec: &RadioSpec, span: &Span, sight: &Sight, distance_m: f64) -> f64 {
    let free_db = |distance_m: f64| 20.0 * (4.0 * PI * distance_m / wavelength_m(spec)).log10();
    match sight {
        Sight::Clear => two_rays_db(spec, span, distance_m),
        Sight::Vehicles(_) => free_db(distance_m) + edges_db(spec, span, sight),
        Sight::Blocked => {
            let reference = f64::from(spec.reference_m);
            let exponent = f64::from(spec.path_loss_exponent);
            free_db(reference) + 10.0 * exponent * (distance_m / reference).log10()
        }
    }
}

/// Returns the loss of the direct and the reflected ray.
fn two_rays_db(spec: &RadioSpec, span: &Span, distance_m: f64) -> f64 {
    let height = |at: Vec3| f64::from(at.z - span.ground_m);
    let (from, to) = (height(span.from), height(span.to));
    let level = (distance_m.powi(2) - (from - to).powi(2)).max(1e-6).sqrt();
    let reflected = (distance_m.powi(2) + 4.0 * from * to).sqrt();
    let (sin, cos) = ((from + to) / reflected, level / reflected);
    let bent = (ROAD_PERMITTIVITY - cos * cos).max(0.0).sqrt();
    let gamma = (sin - bent) / (sin + bent);
    let phase = TAU / wavelength_m(spec) * (distance_m - reflected);
    let both = (1.0 + gamma * phase.cos()).hypot(gamma * phase.sin()).max(1e-6);
    20.0 * (4.0 * PI * level / wavelength_m(spec) / both).log10()
}

/// Returns the largest diffraction loss among the vehicles on the line.
fn edges_db(spec: &RadioSpec, span: &Span, sight: &Sight) -> f64 {
    let Sight::Vehicles(tops) = sight else { return 0.0 };
    let edge = |top: &Vec3| {
        let level = |at: Vec3| f64::from(at.truncate().distance(top.truncate())).max(0.1);
        let (before, after) = (level(span.from), level(span.to));
        let height = if spec.flags & radio::AS_CARLA != 0 {
            f64::from(top.z - span.ground_m)
        } else {
            let share = (before / (before + after)) as f32;
            f64::from(top.z - (span.from.z + (span.to.z - span.from.z) * share))
        };
        let v = height * (2.0 * (before + after) / (wavelength_m(spec) * before * after)).sqrt();
        if v < -0.78 {
            return 0.0;
        }
        6.9 + 20.0 * (((v - 0.1).powi(2) + 1.0).sqrt() + v - 0.1).log10()
    };
    tops.iter().map(edge).fold(0.0, f64::max)
}

/// Returns the standard deviation of shadow fading. Rural roads are not in the table; they have the
/// mean.
fn fading_db(spec: &RadioSpec, sight: &Sight) -> f32 {
    if spec.flags & radio::ETSI_FADING == 0 {
        return spec.fading_stddev_db;
    }
    match (sight, spec.scenario) {
        (Sight::Blocked, _) => 6.8,
        (Sight::Clear, radio::HIGHWAY) => 3.3,
        (Sight::Clear, radio::URBAN) => 5.2,
        (Sight::Clear, _) => 4.25,
        (Sight::Vehicles(_), radio::HIGHWAY) => 3.8,
        (Sight::Vehicles(_), radio::URBAN) => 5.3,
        (Sight::Vehicles(_), _) => 4.55,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loss(spec: RadioSpec, meters: f32, sight: &Sight) -> f64 {
        let quiet = RadioSpec { flags: spec.flags & !radio::ETSI_FADING, ..spec };
        let [from, to] = [0.0, meters].map(|x| Vec3::new(x, 0.0, 1.5));
        loss_db(&quiet, &Span { from, to, ground_m: 0.0 }, sight, &mut Noise::at(1, 1))
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 0.05, "{found} dB, not {expected}");
    }

    #[test]
    fn formulas_agree_with_calculation_by_hand() {
        let (highway, urban) =
            (RadioSpec::default(), RadioSpec { scenario: radio::URBAN, ..RadioSpec::default() });
        // 32.4 + 40 + 20 · lg 5.9; 38.77 + 33.4 + 18.2 · lg 5.9; 36.85 + 60 + 18.9 · lg 5.9.
        close(loss(highway, 100.0, &Sight::Clear), 87.817);
        close(loss(urban, 100.0, &Sight::Clear), 86.199);
        close(loss(urban, 100.0, &Sight::Blocked), 111.419);
        let geometric = RadioSpec { flags: radio::GEOMETRIC, ..highway };
        // Free space loss over 1 m at 5.9 GHz is 47.864 dB; 2.7 decades follow.
        close(loss(geometric, 100.0, &Sight::Blocked), 47.864 + 54.0);
        // An edge on the line of sight, in its middle: ν = 0, 6.03 dB.
        let grazing = Sight::Vehicles(vec![Vec3::new(50.0, 0.0, 1.5)]);
        close(loss(geometric, 100.0, &grazing), 87.864 + 6.03);
        // A low edge has no effect; in CARLA's formula its height counts from the ground.
        let low = Sight::Vehicles(vec![Vec3::new(50.0, 0.0, 0.2)]);
        close(loss(geometric, 100.0, &low), 87.864);
        let as_carla = RadioSpec { flags: radio::GEOMETRIC | radio::AS_CARLA, ..highway };
        assert!(loss(as_carla, 100.0, &low) > 93.0);
    }

    #[test]
    fn two_ray_loss_is_free_space_nearby_and_grows_faster_far_away() {
        let spec = RadioSpec { flags: radio::GEOMETRIC, ..RadioSpec::default() };
        let far = loss(spec, 8000.0, &Sight::Clear) - loss(spec, 4000.0, &Sight::Clear);
        assert!((10.0..13.0).contains(&far), "{far} dB for twice the way");
        let near: f64 = (0..400)
            .map(|i| 20.0 + 0.05 * f64::from(i))
            .map(|d| loss(spec, d as f32, &Sight::Clear) - (47.864 + 20.0 * d.log10()))
            .sum::<f64>()
            / 400.0;
        assert!(near.abs() < 2.0, "{near} dB");
    }

    #[test]
    fn fading_has_the_deviation_of_the_table() {
        let spec = RadioSpec { scenario: radio::URBAN, ..RadioSpec::default() };
        let span = Span { from: Vec3::Z, to: Vec3::new(50.0, 0.0, 1.0), ground_m: 0.0 };
        let drawn: Vec<f64> = (0..4000)
            .map(|i| loss_db(&spec, &span, &Sight::Blocked, &mut Noise::at(2, i)))
            .collect();
        let mean = drawn.iter().sum::<f64>() / 4000.0;
        let spread = (drawn.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        assert!((spread - 6.8).abs() < 0.3, "{spread}");
    }
}
