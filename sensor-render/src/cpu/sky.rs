//! Sky, atmosphere and tone mapping. Twin of sky.wgsl.

use glam::Vec3;

use super::grain::{noise, smooth};
use crate::light::Light;
use crate::simd::{Float, V3, Word};
use crate::tone_curve::{HABLE, LUMA, MUTED};

/// Light of the sky around the sun over that of the sun on a surface that faces it, in the sun's direction, and how
/// fast it falls with 1 − cosine: 30° above the horizon a clear sky is 1.7 and 1.2 times as bright at 20° and 45°
/// from the sun as far from it. That is less than of type 12 in CIE S 011, *Spatial distribution of daylight*, 2003
/// (4.5 and 2): with it, the sky of a camera towards the sun is white.
const GLOW: f32 = 0.2;
const GLOW_PER: f32 = 5.0;

#[inline(always)]
pub(crate) fn splat<F: Float>(v: glam::Vec4) -> V3<F> {
    V3::splat(v.truncate())
}

/// Returns the radiance of the clear sky in a direction with vertical component `z`: as air scatters red light
/// least, red grows only near the horizon, and blue over the whole sky.
#[inline(always)]
pub(crate) fn gradient<F: Float>(light: &Light, z: F) -> V3<F> {
    let low = F::splat(1.0) - z.clamp01();
    let square = low * low;
    let (above, along) = (splat::<F>(light.zenith), splat::<F>(light.horizon));
    V3 {
        x: above.x.lerp(along.x, square * square),
        y: above.y.lerp(along.y, square * low),
        z: above.z.lerp(along.z, square),
    }
}

/// Returns the radiance of the sky with clouds and haze; with `DETAILED`, clouds have fine edges and are lit from
/// the side; with `DISC`, the sun is there.
#[inline(always)]
pub(crate) fn sky<F: Float, const DETAILED: bool, const DISC: bool>(
    light: &Light,
    view: V3<F>,
) -> V3<F> {
    let one = F::splat(1.0);
    let mut color = gradient(light, view.z);
    let apart = one - view.dot(splat(light.sun));
    let wide = apart.mul_add(F::splat(GLOW_PER), one);
    let mut glow = F::splat(GLOW) / (wide * wide);
    if DISC {
        let disc = smooth(F::splat(0.000_11), F::splat(0.000_06), apart);
        glow = disc.mul_add(F::splat(24.0), glow);
    }
    color = splat::<F>(light.sun_color).mul_add(glow * F::splat(light.sun_color.w), color);
    let cover = light.zenith.w;
    if cover > 0.0 {
        let scale = F::splat(1.1) / (view.z.max(F::splat(0.0)) + F::splat(0.08));
        let drift = F::splat(light.air.w * 0.01);
        let (x, y) = (view.x.mul_add(scale, drift), view.y * scale);
        let mut sum = cloud(x, y);
        if DETAILED {
            let (x, y) = (x * F::splat(11.3), y * F::splat(11.3));
            let fine = noise(x, y, F::Word::splat(9)) - F::splat(0.5);
            sum = fine.mul_add(F::splat(0.12), sum);
        }
        // A cloud that gets thinner towards the sun shows its bright side.
        let (to_x, to_y) = (F::splat(light.sun.x * 0.2), F::splat(light.sun.y * 0.2));
        let slope = if DETAILED { sum - cloud(x + to_x, y + to_y) } else { F::splat(0.0) };
        let lit = slope.mul_add(F::splat(1.8), F::splat(0.75)).max(F::splat(0.3));
        let begin = 0.76 - 0.76 * cover;
        let thick = smooth(F::splat(begin), F::splat(begin + 0.2), sum);
        let fade = smooth(F::splat(0.0), F::splat(0.18), view.z);
        let by_sun = splat::<F>(light.sun_color) * (lit.min(F::splat(1.5)) * F::splat(0.3));
        let white = splat::<F>(light.horizon) * F::splat(0.75) + by_sun;
        // A closed layer of clouds shows where it is thick.
        let relief = F::splat(0.3 + 1.5 * cover * cover);
        let white =
            white * (F::splat(0.45) - sum).mul_add(relief, F::splat(0.965)).max(F::splat(0.3));
        color = color.lerp(white, thick * fade * F::splat(0.9));
    }
    // Haze near the horizon.
    let haze_share =
        haze_share(light, F::splat(500.0) / view.z.max(F::splat(0.0)).mul_add(F::splat(9.0), one));
    color.lerp(splat(light.haze), haze_share)
}

/// Returns the density of clouds at a place of their layer, from 0 to 1.
#[inline(always)]
fn cloud<F: Float>(x: F, y: F) -> F {
    let seed = F::Word::splat(7);
    let sum = noise(x, y, seed) * F::splat(0.55);
    let (x, y) = (x * F::splat(2.3), y * F::splat(2.3));
    let sum = noise(x, y, seed).mul_add(F::splat(0.3), sum);
    let (x, y) = (x * F::splat(2.1), y * F::splat(2.1));
    noise(x, y, seed).mul_add(F::splat(0.15), sum)
}

/// Returns the share of radiance that the atmosphere replaces at a distance in metres.
#[inline(always)]
pub(crate) fn haze_share<F: Float>(light: &Light, distance: F) -> F {
    let one = F::splat(1.0);
    let through = (distance - F::splat(light.haze.w)).max(F::splat(0.0));
    let x = through * F::splat(light.air.x);
    // Truncated series of the exponential function.
    let growth = x.mul_add(x.mul_add(x.mul_add(F::splat(0.2), F::splat(0.5)), one), one);
    one - one / growth
}

/// Converts radiance to linear display light, from 0 to 1. The rays of a pixel are averaged after this
/// curve, so that the edge of a lamp is as smooth as any other.
#[inline(always)]
pub(crate) fn tone_map<F: Float>(light: &Light, color: V3<F>) -> V3<F> {
    let color = color * F::splat(light.air.z);
    V3 { x: film(color.x), y: film(color.y), z: film(color.z) }
}

#[inline(always)]
fn film<F: Float>(x: F) -> F {
    let x = x.max(F::splat(0.0));
    const C: [f64; 5] = HABLE;
    let [square, line] = [F::splat(C[0] as f32), F::splat(C[1] as f32)];
    let [square_below, line_below] = [F::splat(C[2] as f32), F::splat(C[3] as f32)];
    let below = x.mul_add(x.mul_add(square_below, line_below), F::splat(C[4] as f32));
    (x * x.mul_add(square, line) / below).min(F::splat(1.0))
}

/// Converts linear display light to bytes with muted colours: red in bits 0 to 7, green, blue, 255.
#[inline(always)]
pub(crate) fn encode<F: Float>(color: V3<F>) -> F::Word {
    let opaque = F::Word::splat(0xff00_0000);
    let values = V3 { x: encoded(color.x), y: encoded(color.y), z: encoded(color.z) };
    let luma = values.dot(V3::splat(LUMA * MUTED));
    let values = V3 { x: luma, y: luma, z: luma } + values * F::splat(1.0 - MUTED);
    byte(values.x) | byte(values.y).shl::<8>() | byte(values.z).shl::<16>() | opaque
}

#[inline(always)]
fn byte<F: Float>(value: F) -> F::Word {
    value.mul_add(F::splat(255.0), F::splat(0.5)).to_int()
}

#[inline(always)]
fn encoded<F: Float>(x: F) -> F {
    // The sRGB curve as a sum of roots (Taylor 2012).
    let a = x.sqrt();
    let b = a.sqrt();
    let y = a * F::splat(0.662_002_7) + b * F::splat(0.684_122_1)
        - b.sqrt() * F::splat(0.323_583_6)
        - x * F::splat(0.022_541_147);
    y.clamp01()
}

/// Returns the environment that a mirror reflects along `r`: the sky above, dim buildings and
/// ground below.
#[inline(always)]
pub(crate) fn reflection<F: Float>(light: &Light, r: V3<F>) -> V3<F> {
    let houses = light.horizon.truncate() * 0.28 + light.ground.truncate() * 0.5;
    let above = smooth(F::splat(0.02), F::splat(0.42), r.z);
    let below = smooth(F::splat(-0.25), F::splat(0.0), r.z);
    let city = splat::<F>(light.ground).lerp(V3::splat(houses), below);
    city.lerp(gradient(light, r.z), above)
}

/// Returns the environment that the flakes of a paint reflect, most of them turned by up to 30 degrees, about a
/// direction with the vertical component `z`.
#[inline(always)]
pub(crate) fn blurred_reflection<F: Float>(light: &Light, z: F) -> V3<F> {
    let low = F::splat(1.0) - z.clamp01();
    let sky = splat::<F>(light.zenith).lerp(splat(light.horizon), low * low);
    splat::<F>(light.ground).lerp(sky, smooth(F::splat(-0.4), F::splat(0.5), z))
}

/// Returns the ambient light of the sky and the ground on a surface whose normal has vertical
/// component `z`.
#[inline(always)]
pub(crate) fn ambient<F: Float>(light: &Light, z: F) -> V3<F> {
    let sky: Vec3 = light.zenith.truncate() * 0.3 + light.horizon.truncate() * 0.52;
    let up = z.mul_add(F::splat(0.5), F::splat(0.5));
    splat::<F>(light.ground).lerp(V3::splat(sky), up)
}
