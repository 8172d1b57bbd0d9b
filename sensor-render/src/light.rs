use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};
use protocol::Weather;

use crate::quality::Sample;

/// Sun, sky and atmosphere of one frame, for shading. The shaders read the same 128 bytes.
///
/// Radiances are linear; a white diffuse surface in full sunlight has a radiance of about 1.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Light {
    /// Direction to the sun, or at night to the moon; w: 1 if it casts shadows. The moon's are fainter
    /// than those of any lamp and are left out.
    pub(crate) sun: Vec4,
    /// Irradiance of a surface that faces it; w: brightness of its disc.
    pub(crate) sun_color: Vec4,
    /// Radiance of the sky at the zenith; w: share of the sky that clouds cover.
    pub(crate) zenith: Vec4,
    /// Radiance of the sky at the horizon; w: darkness, from 0 by day to 1 at night.
    pub(crate) horizon: Vec4,
    /// Radiance that the ground reflects upwards; w: wetness of surfaces, 0 to 1.
    pub(crate) ground: Vec4,
    /// Radiance of haze; w: distance in metres at which fog begins.
    pub(crate) haze: Vec4,
    /// x: extinction by haze per metre; y: share of the ground under puddles; z: exposure; w:
    /// simulated time scaled by the wind, for drifting clouds.
    pub(crate) air: Vec4,
    /// Radius of the sun's disc at distance 1, perpendicular to its direction; w: share of
    /// the heaviest rain.
    pub(crate) sun_radius: Vec4,
}

const _: () = assert!(size_of::<Light>() == 128);

impl Light {
    /// Returns the light for a weather at a simulated time.
    pub(crate) fn new(weather: &Weather, sim_time_nanos: u64) -> Light {
        let share = |percent: f32| (percent / 100.0).clamp(0.0, 1.0);
        let (sin_altitude, cos_altitude) = weather.sun_altitude_rad.sin_cos();
        let (sin_azimuth, cos_azimuth) = weather.sun_azimuth_rad.sin_cos();
        let sun = Vec3::new(cos_altitude * cos_azimuth, cos_altitude * sin_azimuth, sin_altitude);
        let sun = sun.try_normalize().filter(|s| s.is_finite()).unwrap_or(Vec3::Z);

        // Daylight: 0 at night, 1 when the sun is clear of the horizon.
        let day = smooth(-0.12, 0.18, sun.z);
        let low = 1.0 - smooth(0.0, 0.45, sun.z);
        let clouds = share(weather.cloudiness);
        let overcast = smooth(0.4, 1.0, clouds);

        let noon = Vec3::new(2.9, 2.75, 2.45);
        let dusk = Vec3::new(2.6, 1.35, 0.55);
        let moonlight = Vec3::new(0.05, 0.06, 0.09);
        // Fog scatters the sun's light; what is left of it casts faint shadows.
        let fog = share(weather.fog_density);
        let through = 1.0 - 0.97 * smooth(0.05, 0.6, fog);
        let by_day =
            noon.lerp(dusk, low) * smooth(-0.04, 0.2, sun.z) * (1.0 - 0.93 * overcast) * through;
        let by_night = moonlight * (1.0 - day) * (1.0 - 0.8 * overcast);
        // At night the moon is opposite to the sun.
        let is_sun = sun.z > -0.04;
        let (sun, sun_color) = if is_sun {
            (sun, by_day)
        } else {
            (Vec3::new(-sun.x, -sun.y, -sun.z.min(-0.35)).normalize_or(Vec3::Z), by_night)
        };

        let grey = |blue: Vec3, grey: f32| blue.lerp(Vec3::splat(grey), overcast);
        let zenith = grey(Vec3::new(0.16, 0.33, 0.75), 0.52);
        let horizon = grey(Vec3::new(0.70, 0.81, 0.95), 0.72);
        let glow = Vec3::new(1.0, 0.62, 0.35);
        let horizon = horizon.lerp(glow, 0.55 * low * day * (1.0 - overcast));
        // Haze above a town scatters the light of its lamps.
        let night_zenith = Vec3::new(0.0075, 0.0095, 0.0165);
        let night_horizon = Vec3::new(0.040, 0.035, 0.036);
        let zenith = night_zenith.lerp(zenith, day);
        let horizon = night_horizon.lerp(horizon, day);

        let ground = (zenith * 0.35 + horizon * 0.25 + sun_color * sun.z.max(0.0) * 0.3)
            * Vec3::new(0.30, 0.29, 0.27);
        let haze = horizon.lerp(Vec3::splat((horizon.x + horizon.y + horizon.z) / 3.0), fog);
        let rain = share(weather.precipitation);
        let extinction = 0.00016 + 0.0008 * rain + 0.03 * fog * fog + 0.0006 * fog;
        let exposure = 0.62 + 0.9 * (1.0 - day) + 0.35 * overcast * day;
        let seconds = (sim_time_nanos % 3_600_000_000_000) as f32 * 1e-9;
        Light {
            sun: sun.extend(f32::from(is_sun && sun_color.max_element() > 0.004)),
            sun_color: sun_color.extend((1.0 - overcast) * day),
            zenith: zenith.extend(clouds),
            horizon: horizon.extend(1.0 - day),
            ground: ground.extend(share(weather.wetness).max(0.6 * rain)),
            haze: haze.extend(weather.fog_distance_m.clamp(0.0, 1000.0)),
            air: Vec4::new(
                extinction,
                share(weather.precipitation_deposits),
                exposure,
                seconds * (0.3 + share(weather.wind_intensity)),
            ),
            sun_radius: (sun.any_orthonormal_vector() * SUN_RADIUS).extend(rain),
        }
    }

    /// Returns the direction to a point of the sun's disc.
    pub(crate) fn on_sun(&self, [_, _, across, along]: Sample) -> Vec3 {
        let (sun, radius) = (self.sun.truncate(), self.sun_radius.truncate());
        sun + radius * across + sun.cross(radius) * along
    }
}

/// Distance from which on an obstacle keeps none of a sky direction's light from a point. Metres.
pub(crate) const OCCLUSION_REACH_M: f32 = 2.0;

/// Distance up to which an obstacle keeps all of it away. Metres.
pub(crate) const OCCLUSION_DARK_M: f32 = 0.5;

/// Distances from the camera along its axis between which ambient occlusion fades out, because it is as
/// small as a few pixels. Metres.
pub(crate) const OCCLUSION_FADE_M: [f32; 2] = [25.0, 40.0];

/// Tangent of the sun's angular radius, 0.266 degrees.
const SUN_RADIUS: f32 = 0.004_64;

/// Returns 0 below `low`, 1 above `high`, and a smooth transition between.
fn smooth(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
