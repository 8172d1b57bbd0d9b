use glam::Vec3;
use mesh::Tag;
use protocol::{SensorSpec, Weather, lidar_flag};

use crate::lidar_air::{Air, BLIND_M};
use crate::lidar_return::{LidarReturn, Receiver, mixed, normal};
use crate::lidar_spray::{CLUMP_REFLECTIVITY, Spray};
use crate::rain::Puff;

/// Rays of a beam with a width.
pub(crate) const SUB_RAYS: usize = 7;

/// Returns of one pulse that are nearer to each other than this are one echo: the length of a pulse of
/// 5 ns. Metres.
const ECHO_M: f32 = 0.75;

/// Distance from the axis of the six outer rays of a beam, as a share of its radius: each of the seven
/// stands for a seventh of a disc.
const RING: f32 = 0.736;

/// What the pulses of a lidar meet besides the first surface on their axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Echoes {
    /// Rays per beam: 1, or [`SUB_RAYS`].
    pub(crate) rays: u32,
    /// Distance from the axis of the outer rays, at distance 1.
    pub(crate) ring: f32,
    /// All 0: clear air.
    pub(crate) air: Air,
    /// No puffs: there is none.
    pub(crate) spray: Spray,
}

/// What one ray of a beam met.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Met {
    /// Distance in metres.
    pub(crate) t: f32,
    /// Reflectivity towards the sensor, 0 to 1: that of [`LidarReturn`] without attenuation.
    pub(crate) reflectivity: f32,
    /// Cosine of the angle of incidence.
    pub(crate) cosine: f32,
    /// Instance and tag.
    pub(crate) label: [u32; 2],
}

/// Echo of a pulse.
#[derive(Clone, Copy, Debug, Default)]
struct Echo {
    distance_m: f32,
    /// Received power, see [`Air`]; 0: none.
    power: f32,
    /// Reflectivity with the extinction of the air.
    reflectivity: f32,
    cosine: f32,
    label: [u32; 2],
}

/// A return, and instance and tag of what it is from.
pub(crate) type LabelledReturn = (LidarReturn, [u32; 2]);

impl Echoes {
    /// Returns the echoes of a lidar at `origin`.
    pub(crate) fn of(spec: &SensorSpec, weather: &Weather, puffs: &[Puff], origin: Vec3) -> Echoes {
        let is_wide = spec.lidar.divergence_rad > 0.0;
        Echoes {
            rays: if is_wide { SUB_RAYS as u32 } else { 1 },
            ring: RING * (spec.lidar.divergence_rad / 2.0).tan(),
            air: match spec.lidar.has(lidar_flag::WEATHER) {
                true => Air::of(spec, weather),
                false => Air::default(),
            },
            spray: Spray::of(spec, puffs, origin),
        }
    }

    /// Returns the direction of ray number `ray` of the beam with these cosines and sines of azimuth and
    /// elevation, in sensor space.
    #[inline(always)]
    pub(crate) fn direction(&self, [azimuth, elevation]: [[f32; 2]; 2], ray: u32) -> Vec3 {
        let ([ca, sa], [ce, se]) = (azimuth, elevation);
        let axis = Vec3::new(ce * ca, ce * sa, se);
        if ray == 0 {
            return axis;
        }
        let [x, y] = HEXAGON[(ray as usize - 1) % HEXAGON.len()];
        let (left, up) = (Vec3::new(-sa, ca, 0.0), Vec3::new(-se * ca, -se * sa, ce));
        let direction = axis + (left * x + up * y) * self.ring;
        direction * (1.0 / direction.length_squared().sqrt())
    }

    /// Returns the strongest return of beam number `beam` and the last one, or if that is the strongest
    /// the second strongest. `axis` is its origin and its direction in world space, `met` are the surfaces that
    /// its rays met.
    pub(crate) fn returns(
        &self,
        receiver: &Receiver,
        beam: u32,
        axis: [Vec3; 2],
        met: &mut [Met],
    ) -> [Option<LabelledReturn>; 2] {
        let start = mixed(receiver.seed ^ beam);
        let word = |step: u32| mixed(start.wrapping_add(step));
        if (word(1) >> 8) as f32 * (1.0 / 16_777_216.0) < receiver.dropoff {
            return [None; 2];
        }
        let mut best = Best { least_power: self.air.least_power, ..Best::default() };
        met.sort_by(|a, b| a.t.total_cmp(&b.t));
        let weight = 1.0 / self.rays as f32;
        let mut first = 0;
        for end in 1..=met.len() {
            if end == met.len() || met[end].t - met[end - 1].t > ECHO_M {
                best.consider(self.of_surface(axis, &met[first..end], weight));
                first = end;
            }
        }
        let nearest_m = met.first().map_or(receiver.range_m, |met| met.t);
        if self.air.fog_power > 0.0 && self.air.fog_m < nearest_m {
            best.consider(of_air(self.air.fog_m, self.air.fog_power));
        }
        if self.air.rain > 0.0 {
            let (distance_m, power) = self.drop(word(6), normal(word(7), word(8)));
            if distance_m >= BLIND_M && distance_m < nearest_m {
                best.consider(of_air(distance_m, power));
            }
        }
        let clump = self.spray.first_clump(axis, nearest_m, |puff| word(9 + puff));
        if let Some(distance_m) = clump.filter(|distance_m| *distance_m >= BLIND_M) {
            let through = (-2.0 * self.air.extinction_per_m * distance_m).exp();
            let power = CLUMP_REFLECTIVITY * through / (distance_m * distance_m);
            best.consider(of_air(distance_m, power));
        }
        let noise = |a: u32, b: u32| normal(a, b) * receiver.noise_m;
        let received = |echo: Echo, noise_m: f32| {
            let intensity = if receiver.attenuation_per_m < 0.0 {
                echo.cosine.min(1.0)
            } else {
                echo.reflectivity * (-receiver.attenuation_per_m * echo.distance_m).exp()
            };
            let distance_m = echo.distance_m + noise_m;
            let intensity = intensity.clamp(1e-6, 1.0);
            (echo.power > 0.0).then_some((LidarReturn { distance_m, intensity }, echo.label))
        };
        let second =
            if best.last.distance_m == best.strongest.distance_m { best.second } else { best.last };
        [
            received(best.strongest, noise(word(2), word(3))),
            received(second, noise(word(4), word(5))),
        ]
    }

    /// Returns the echo of neighbouring returns of a beam, each of which has this share of it.
    #[inline(always)]
    fn of_surface(&self, axis: [Vec3; 2], met: &[Met], weight: f32) -> Echo {
        let (mut sum, mut moment, mut brightest) = (0.0, 0.0, met[0]);
        for one in met {
            sum += one.reflectivity;
            moment += one.reflectivity * one.t;
            if one.reflectivity > brightest.reflectivity {
                brightest = *one;
            }
        }
        let distance_m = if met.len() == 1 || sum == 0.0 { met[0].t } else { moment / sum };
        let in_spray = self.spray.optical_depth(axis, distance_m);
        let through = (-2.0 * (self.air.extinction_per_m * distance_m + in_spray)).exp();
        let reflectivity = sum * weight * through;
        Echo {
            distance_m,
            power: reflectivity / (distance_m * distance_m),
            reflectivity,
            cosine: brightest.cosine,
            label: brightest.label,
        }
    }

    /// Returns distance and power of the strongest echo of a drop, from a random word and a normally
    /// distributed number: see [`Air`].
    #[inline(always)]
    fn drop(&self, word: u32, normal: f32) -> (f32, f32) {
        let exponential = -(((word >> 8) as f32 + 0.5) * (1.0 / 16_777_216.0)).ln();
        let power = (self.air.rain / exponential).powf(4.0 / 3.0);
        // E. Wilson and M. Hilferty, The Distribution of Chi-Square, 1931: shape 5/2.
        let root = 1.0 - 1.0 / 22.5 + normal * (1.0 / (3.0 * 1.581_138_8));
        let gamma = 2.5 * root * root * root;
        ((gamma / (self.air.drop_scale * power.sqrt())).sqrt(), power)
    }
}

/// Directions of the outer rays across their beam: to the left and up.
const HEXAGON: [[f32; 2]; SUB_RAYS - 1] = [
    [1.0, 0.0],
    [0.5, 0.866_025_4],
    [-0.5, 0.866_025_4],
    [-1.0, 0.0],
    [-0.5, -0.866_025_4],
    [0.5, -0.866_025_4],
];

/// Returns the echo of fog, of a drop or of spray, which is from no object. Its intensity is that of a surface
/// with the same power in clear air.
fn of_air(distance_m: f32, power: f32) -> Echo {
    let reflectivity = power * distance_m * distance_m;
    Echo { distance_m, power, reflectivity, cosine: 1.0, label: [0, Tag::Other as u32] }
}

/// The echoes of one pulse that count.
#[derive(Clone, Copy, Debug, Default)]
struct Best {
    least_power: f32,
    strongest: Echo,
    second: Echo,
    last: Echo,
}

impl Best {
    #[inline(always)]
    fn consider(&mut self, echo: Echo) {
        if echo.power < self.least_power {
            return;
        }
        if echo.power > self.strongest.power {
            self.second = self.strongest;
            self.strongest = echo;
        } else if echo.power > self.second.power {
            self.second = echo;
        }
        if echo.distance_m > self.last.distance_m {
            self.last = echo;
        }
    }
}
