//! Falling drops and the spray of wheels, as cameras see them; lidars see the same spray (`lidar_spray.rs`).

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use protocol::{ActorState, EffectsSpec, Weather, kind};

use crate::lidar_air::Rain;

/// Distances of the layers of drops along the dominant axis of a ray, metres: each is that of the drops up to
/// 1.9 times as far.
pub(crate) const LAYERS_M: [f32; 4] = [0.8, 1.5, 2.9, 5.5];
const LAYER_RATIO: f32 = 1.9;

/// Drops that a cell of a layer has at most.
pub(crate) const DROPS_PER_CELL: u32 = 2;

/// Diameters of the drops that are drawn, metres; those between are equally frequent by their square root.
pub(crate) const DIAMETERS_M: [f32; 2] = [0.001, 0.003_5];

/// Speeds at which drops of [`DIAMETERS_M`] fall, m/s: D. Atlas, R. Srivastava and R. Sekhon, *Doppler radar
/// characteristics of precipitation at vertical incidence*, 1973.
const FALL_MPS: [f32; 2] = [4.0, 8.4];

/// Wind of a weather at full intensity, m/s.
const WIND_MPS: f32 = 10.0;

/// Exposure of a camera that states none, seconds.
const EXPOSURE_SECS: f32 = 1.0 / 200.0;

/// Speed above which wheels throw spray, and speed at which it is densest, m/s.
const SPRAY_MPS: [f32; 2] = [6.0, 28.0];

/// Extinction in the middle of the densest spray, 1/m.
const SPRAY_PER_M: f32 = 1.4;

/// Puffs that a sensor sees at most: the nearest.
pub(crate) const PUFFS_MAX: usize = 8;

/// Distance from which on spray is left out, metres.
const SPRAY_FAR_M: f32 = 120.0;

/// Spray behind a vehicle. The density at distance r from the middle, in units of the half axes, is
/// `density · (1 + r²)^(−7/2)`; its integral along a ray has a closed form. The shaders read the same 32
/// bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Puff {
    /// Middle in world space.
    pub(crate) center: [f32; 3],
    /// Extinction in the middle, 1/m.
    pub(crate) density_per_m: f32,
    /// Level direction of the long half axis, 1 / its length, and 1 / the length of the half axis across; that
    /// upwards is [`FLATNESS`] times as long.
    pub(crate) along: [f32; 2],
    pub(crate) per_length: f32,
    pub(crate) per_width: f32,
}

/// Height of a puff relative to its width.
pub(crate) const FLATNESS: f32 = 0.8;

impl Puff {
    /// Returns the spray of an actor; `None` for what throws none.
    pub(crate) fn of(actor: &ActorState, wetness: f32) -> Option<Puff> {
        let velocity = actor.velocity();
        let speed_mps = velocity.length();
        if actor.kind != kind::VEHICLE || wetness <= 0.0 || speed_mps <= SPRAY_MPS[0] {
            return None;
        }
        let blueprint = town::catalogue().get(actor.blueprint as usize)?;
        let half = blueprint.half_extents_m;
        let strength = (speed_mps - SPRAY_MPS[0]) / (SPRAY_MPS[1] - SPRAY_MPS[0]);
        let along = velocity.truncate().try_normalize()?;
        let length = 1.2 + 0.12 * speed_mps;
        let width = half.y * 0.9;
        let middle = actor.pose.position() - (along * (half.x + length * 0.7)).extend(0.0);
        let center = middle + Vec3::Z * (0.35 * width + 0.1);
        Some(Puff {
            center: center.to_array(),
            density_per_m: SPRAY_PER_M * wetness * strength.min(1.0),
            along: along.to_array(),
            per_length: 1.0 / length,
            per_width: 1.0 / width,
        })
    }

    /// Returns the optical depth along a ray of unit direction up to `distance_m`.
    ///
    /// With k² = 1 + the square of the distance of the ray from the middle and x along the ray from the point
    /// nearest to it, both in half axes, the integral of (k² + x²)^(−7/2) is (u − 2u³/3 + u⁵/5) / k⁶ with
    /// u = x / √(k² + x²).
    #[inline(always)]
    pub(crate) fn optical_depth(&self, origin: Vec3, direction: Vec3, distance_m: f32) -> f32 {
        let from = self.in_half_axes(origin - Vec3::from(self.center));
        let along = self.in_half_axes(direction);
        let stretch = along.length_squared().sqrt();
        let near = from.dot(along) / stretch;
        let apart = (from.length_squared() - near * near).max(0.0) + 1.0;
        let primitive = |x: f32| {
            let u = x / (apart + x * x).sqrt();
            let square = u * u;
            u * (1.0 + square * (square * 0.2 - 2.0 / 3.0))
        };
        let sum = primitive(near + distance_m * stretch) - primitive(near);
        sum * self.density_per_m / (stretch * apart * apart * apart)
    }

    /// Returns a vector along the axes of the puff, in their units.
    #[inline(always)]
    fn in_half_axes(&self, v: Vec3) -> Vec3 {
        let [x, y] = self.along;
        Vec3::new(
            (v.x * x + v.y * y) * self.per_length,
            (v.y * x - v.x * y) * self.per_width,
            v.z * self.per_width / FLATNESS,
        )
    }
}

/// Returns the puffs nearest to a sensor, and their number.
pub(crate) fn nearest(puffs: &[Puff], origin: Vec3) -> ([Puff; PUFFS_MAX], u32) {
    let away = |puff: &Puff| Vec3::from(puff.center).distance_squared(origin);
    let mut near: Vec<&Puff> =
        puffs.iter().filter(|puff| away(puff) < SPRAY_FAR_M * SPRAY_FAR_M).collect();
    near.sort_by(|a, b| away(a).total_cmp(&away(b)));
    let mut found = [Puff::default(); PUFFS_MAX];
    let mut count = 0;
    for (own, puff) in found.iter_mut().zip(near) {
        *own = *puff;
        count += 1;
    }
    (found, count)
}

/// Rain and spray that a camera sees. The shaders read the same bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rainfall {
    /// Way of the largest drops relative to the camera during the exposure in world space, metres.
    pub(crate) streak: [f32; 3],
    /// 1 / the side of a cell of a layer, 1/m.
    pub(crate) per_cell: f32,
    /// Probability that a drop of a cell exists, by layer; 0 without rain.
    pub(crate) chances: [f32; 4],
    /// Seed of the places of the drops of this frame.
    pub(crate) seed: u32,
    /// Number of puffs.
    pub(crate) count: u32,
    /// Length of the way of the smallest drops, by that of the largest.
    pub(crate) shortest: f32,
    pub(crate) reserved: u32,
    pub(crate) puffs: [Puff; PUFFS_MAX],
}

const _: () = assert!(size_of::<Rainfall>() == 304);

impl Rainfall {
    /// Returns what a camera at `origin` sees. `drops` is false below a roof.
    ///
    /// Drops are those of Marshall and Palmer, as for lidars: ∫ N exp(−ΛD) dD from 1 mm on per cubic metre.
    pub(crate) fn new(
        weather: &Weather,
        effects: &EffectsSpec,
        seed: u32,
        origin: Vec3,
        velocity: Vec3,
        puffs: &[Puff],
        has_roof: impl Fn() -> bool,
    ) -> Rainfall {
        let mut rainfall = Rainfall { seed, ..Rainfall::default() };
        if let Some(rain) = Rain::of(weather)
            && !has_roof()
        {
            let exposure_secs = [effects.blur_secs, effects.shutter_secs, EXPOSURE_SECS]
                .into_iter()
                .find(|secs| *secs > 0.0)
                .unwrap_or(EXPOSURE_SECS);
            let wind = WIND_MPS * (weather.wind_intensity / 100.0).clamp(0.0, 1.0);
            let [short, streak] = FALL_MPS
                .map(|fall_mps| (Vec3::new(wind, 0.0, -fall_mps) - velocity) * exposure_secs);
            let cell_m = (1.2 * streak.length()).max(0.05);
            let per_m3 = rain.drops_per_m3(DIAMETERS_M[0]);
            rainfall.streak = streak.to_array();
            rainfall.shortest = (short.length() / streak.length().max(1e-6)).min(1.0);
            rainfall.per_cell = 1.0 / cell_m;
            rainfall.chances = LAYERS_M.map(|layer_m| {
                let drops = per_m3 * (LAYER_RATIO - 1.0) * layer_m * cell_m * cell_m;
                (drops / DROPS_PER_CELL as f32).min(1.0)
            });
        }
        (rainfall.puffs, rainfall.count) = nearest(puffs, origin);
        rainfall
    }

    /// Returns whether neither drops nor spray are seen.
    pub(crate) fn is_none(&self) -> bool {
        self.count == 0 && self.chances[3] <= 0.0
    }
}
