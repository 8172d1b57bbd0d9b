use protocol::{SensorSpec, Weather};

/// Nearest distance from which a receiver gets light of its own beam.
pub(crate) const BLIND_M: f32 = 1.0;

/// Duration of a pulse at half its power, times the speed of light: 20 ns.
const PULSE_M: f64 = 6.0;

/// Reflectivity of the weakest surface that is detected at the range of a lidar, in clear air.
const LEAST_REFLECTIVITY: f32 = 0.1;

/// Divergence of a beam that states none, radians: as in LISA, see [`Air`].
const DIVERGENCE_RAD: f64 = 3e-3;

/// Fog and rain, as a lidar sees them.
///
/// The power that a receiver gets is in units of that from a white surface at 1 m: a surface of
/// reflectivity ρ at distance d has `ρ · exp(−2αd) / d²`.
///
/// Fog is that of M. Hahner, C. Sakaridis, D. Dai and L. Van Gool, *Fog Simulation on Real LiDAR Point
/// Clouds for 3D Object Detection in Adverse Weather*, ICCV 2021: extinction α = ln 20 / visibility,
/// backscatter β = 0.046 / visibility per metre and steradian, and an echo that is the convolution of a
/// sin² pulse with β · exp(−2αr) / r². The stronger one of this echo and that of the surface is received.
///
/// Rain is a Monte Carlo model as LISA's (V. Kilic et al., *Lidar Light Scattering Augmentation*, 2021):
/// drops of J. Marshall and W. Palmer, *The Distribution of Raindrops with Size*, 1948,
/// n(D) = N · exp(−ΛD), Λ = 4.1 mm⁻¹ · rate^−0.21, are in the cone of the beam, and the strongest of
/// their echoes counts. A drop of diameter D fills (D / θr)² of the beam, θ being the divergence, and
/// reflects 2 % of that. The number of drops whose echo is stronger than Q has the mean
/// ∫ N/Λ · exp(−kr²) · (π/4) θ²r² dr = (N/Λ) (π^1.5 / 16) θ² k^−1.5 with k = Λθ √(Q / 0.02): the
/// distribution of the strongest is that of the first event of a Poisson process, and kr² of that drop
/// has a gamma distribution of shape 5/2. Extinction is that of twice the cross-section of all drops.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Air {
    /// Extinction by fog and rain, 1/m.
    pub(crate) extinction_per_m: f32,
    /// Distance of the echo of fog, metres.
    pub(crate) fog_m: f32,
    /// Its power; 0: there is no fog.
    pub(crate) fog_power: f32,
    /// Mean number of drops with an echo stronger than 1; that of Q is `rain · Q^(−3/4)`. 0: no rain.
    pub(crate) rain: f32,
    /// k / √Q, see above.
    pub(crate) drop_scale: f32,
    /// Weakest power that is detected.
    pub(crate) least_power: f32,
}

impl Air {
    /// Returns the air of a weather for a lidar.
    pub(crate) fn of(spec: &SensorSpec, weather: &Weather) -> Air {
        let fog_per_m = fog_extinction_per_m(weather);
        let (fog_m, fog_power) = fog_echo(fog_per_m);
        let divergence_rad = match spec.lidar.divergence_rad {
            0.0 => DIVERGENCE_RAD,
            given => f64::from(given),
        };
        let rain = Rain::of(weather);
        let (mean, drop_scale) = rain.map_or((0.0, 0.0), |rain| rain.echoes(divergence_rad));
        let rain_per_m = rain.map_or(0.0, |rain| rain.extinction_per_m());
        Air {
            extinction_per_m: (fog_per_m + rain_per_m) as f32,
            fog_m: fog_m as f32,
            fog_power: fog_power as f32,
            rain: mean as f32,
            drop_scale: drop_scale as f32,
            least_power: LEAST_REFLECTIVITY / (spec.range_m * spec.range_m),
        }
    }
}

/// Returns the extinction of fog, 1/m: the same as in images.
pub(crate) fn fog_extinction_per_m(weather: &Weather) -> f64 {
    let fog = f64::from((weather.fog_density / 100.0).clamp(0.0, 1.0));
    0.03 * fog * fog + 0.0006 * fog
}

/// Returns distance and power of the strongest echo of fog.
fn fog_echo(extinction_per_m: f64) -> (f64, f64) {
    // β = 0.046 / visibility, and α = ln 20 / visibility.
    let backscatter = 0.046 / 20f64.ln() * extinction_per_m;
    let response = |distance_m: f64| {
        const STEPS: u32 = 64;
        let step_m = PULSE_M / f64::from(STEPS);
        let parts = (0..STEPS).map(|step| {
            let ago_m = (f64::from(step) + 0.5) * step_m;
            let r = distance_m - ago_m;
            if r < f64::from(BLIND_M) {
                return 0.0;
            }
            let pulse = (std::f64::consts::PI * ago_m / PULSE_M).sin().powi(2);
            pulse * (-2.0 * extinction_per_m * r).exp() / (r * r) * step_m
        });
        std::f64::consts::PI * backscatter * parts.sum::<f64>()
    };
    let steps = (0..128).map(|step| f64::from(BLIND_M) + 0.05 * f64::from(step));
    let all = steps.map(|distance_m| (distance_m, response(distance_m)));
    all.fold((0.0, 0.0), |best, one| if one.1 > best.1 { one } else { best })
}

/// Raindrops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rain {
    /// Λ, 1/m.
    decay_per_m: f64,
}

/// N, drops per volume and diameter, 1/m⁴.
const DROPS_PER_M4: f64 = 8e6;

/// Share of the light on a drop that it reflects: Fresnel's formula for water.
const DROP_REFLECTIVITY: f64 = 0.02;

impl Rain {
    /// Returns the rain of a weather, 0.5 mm/h for each percent; `None` if it is dry.
    pub(crate) fn of(weather: &Weather) -> Option<Rain> {
        let rate_mm_per_h = 0.5 * f64::from(weather.precipitation.clamp(0.0, 100.0));
        (rate_mm_per_h > 0.0).then(|| Rain { decay_per_m: 4.1e3 * rate_mm_per_h.powf(-0.21) })
    }

    /// Returns the number of drops with at least this diameter in a cubic metre: ∫ n(D) dD = N exp(−ΛD) / Λ.
    pub(crate) fn drops_per_m3(&self, diameter_m: f32) -> f32 {
        let decay = -self.decay_per_m * f64::from(diameter_m);
        (DROPS_PER_M4 * decay.exp() / self.decay_per_m) as f32
    }

    /// Returns the extinction, 1/m: ∫ 2 (π/4) D² n(D) dD = π N / Λ³.
    fn extinction_per_m(&self) -> f64 {
        std::f64::consts::PI * DROPS_PER_M4 / self.decay_per_m.powi(3)
    }

    /// Returns `rain` and `drop_scale` of [`Air`].
    fn echoes(&self, divergence_rad: f64) -> (f64, f64) {
        let drop_scale = self.decay_per_m * divergence_rad / DROP_REFLECTIVITY.sqrt();
        let drops_per_m3 = DROPS_PER_M4 / self.decay_per_m;
        let shape = std::f64::consts::PI.powf(1.5) / 16.0;
        (drops_per_m3 * shape * divergence_rad.powi(2) * drop_scale.powf(-1.5), drop_scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Light;

    #[test]
    fn fog_and_rain_have_the_numbers_of_the_papers() {
        let thick = Weather { fog_density: 100.0, ..Weather::default() };
        let alpha = fog_extinction_per_m(&thick);
        assert!((3.0 / alpha - 98.0).abs() < 1.0, "visibility {} m", 3.0 / alpha);
        // The echo of fog lies about half a pulse behind the blind zone, as in figure 4 of Hahner et al.
        let (distance_m, power) = fog_echo(alpha);
        assert!((3.0..6.0).contains(&distance_m), "{distance_m}");
        assert!((1e-4..1e-2).contains(&power), "{power}");
        assert_eq!(fog_echo(0.0), (0.0, 0.0));
        // 10 mm/h: Λ is 2.53 per mm, and twice the cross-section of all drops 1.56e-3 per metre.
        let rain = Rain::of(&Weather { precipitation: 20.0, ..Weather::default() }).unwrap();
        assert!((rain.decay_per_m - 2528.0).abs() < 1.0, "{}", rain.decay_per_m);
        assert!((rain.extinction_per_m() - 1.556e-3).abs() < 1e-5);
        assert!(Rain::of(&Weather::default()).is_none());
    }

    #[test]
    fn fog_is_as_thick_as_in_images() {
        for fog_density in [0.0, 2.0, 30.0, 100.0] {
            let weather = Weather { fog_density, precipitation: 0.0, ..Weather::default() };
            let in_images = f64::from(Light::new(&weather, 0).air.x) - 0.00016;
            assert!((in_images - fog_extinction_per_m(&weather)).abs() < 1e-7, "{fog_density}");
        }
    }
}
