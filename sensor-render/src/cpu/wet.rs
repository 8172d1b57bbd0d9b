//! Wet surfaces: puddles, and the rings of rain drops on them. Twin of the end of shade.wgsl.

use super::grain::{noise, smooth};
use super::surface_materials::SurfaceMaterials;
use crate::light::Light;
use crate::simd::{Float, Mask, V3, Word};

/// Rings of rain drops on a metre of water.
const RIPPLES_PER_M: f32 = 14.0;

/// Applies rain: wet surfaces are darker, sealed ones also glossier, and sealed level ground has puddles. A
/// pixel is `long` metres long on the surface.
#[inline(always)]
pub(crate) fn apply<F: Float>(
    surfaces: &mut SurfaceMaterials<F>,
    light: &Light,
    at: V3<F>,
    normal: V3<F>,
    long: F,
) {
    let (wetness, puddles) = (light.ground.w, light.air.y);
    if wetness <= 0.0 && puddles <= 0.0 {
        return;
    }
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let upward = normal.z.max(zero);
    let damp = upward.mul_add(F::splat(0.7), F::splat(0.3)) * F::splat(wetness);
    surfaces.albedo = surfaces.albedo * damp.mul_add(F::splat(-0.45), one);
    // Grass, leaves and soil hold no film of water.
    let sealed = zero.lt(surfaces.specular);
    let film = (upward * F::splat(wetness)).or(sealed, zero);
    surfaces.specular = surfaces.specular.max(film * F::splat(0.05));
    surfaces.roughness = surfaces.roughness.lerp(F::splat(0.25), film);
    let level = F::splat(0.995).lt(normal.z) & sealed;
    if puddles > 0.0 && level.any() {
        // Large hollows with uneven edges, across the lattices of roads.
        let (x, y) = (at.x * F::splat(0.8) + at.y * F::splat(0.6), at.y * F::splat(0.8));
        let y = y - at.x * F::splat(0.6);
        let (u, v) = (x * F::splat(0.19), y * F::splat(0.19));
        let low = noise(u, v, F::Word::splat(11)) * F::splat(0.72);
        let (u, v) = (x * F::splat(0.83), y * F::splat(0.83));
        let low = noise(u, v, F::Word::splat(12)).mul_add(F::splat(0.2), low);
        // Where a pixel resolves the finest ones; else their mean.
        let (u, v) = (x * F::splat(3.1), y * F::splat(3.1));
        let near = long.mul_add(F::splat(-3.1), F::splat(1.5)).clamp01();
        let fine = noise(u, v, F::Word::splat(13)) - F::splat(0.5);
        let low = (fine * near).mul_add(F::splat(0.05), low + F::splat(0.04));
        // The hollows change by about a third per metre, and an edge is as wide as a pixel at least.
        let middle = F::splat(0.925 - 0.42 * puddles);
        let half = long.mul_add(F::splat(0.17), F::splat(0.035));
        let pool = smooth(middle - half, middle + half, low).or(level, zero);
        surfaces.albedo = surfaces.albedo * pool.mul_add(F::splat(-0.45), one);
        surfaces.specular = surfaces.specular.max(pool * F::splat(0.02));
        surfaces.roughness = surfaces.roughness.lerp(F::splat(0.01), pool);
    }
}

/// Returns reflected directions that the rings of rain drops on level water turn, where a pixel, `pixel`
/// metres long on the water, can resolve the rings.
#[inline(always)]
pub(crate) fn rippled<F: Float>(
    light: &Light,
    at: V3<F>,
    normal: V3<F>,
    r: V3<F>,
    pixel: F,
) -> V3<F> {
    let rain = light.sun_radius.w;
    if rain <= 0.0 {
        return r;
    }
    let strength = pixel.mul_add(F::splat(-RIPPLES_PER_M), F::splat(1.5)).clamp01();
    let strength = strength * F::splat(0.16 * rain);
    let x = at.x * F::splat(RIPPLES_PER_M) + F::splat(light.air.w * 9.0);
    let y = at.y * F::splat(RIPPLES_PER_M) + F::splat(light.air.w * 9.0);
    let to_x = (noise(x, y, F::Word::splat(17)) - F::splat(0.5)) * strength;
    let to_y = (noise(x, y, F::Word::splat(18)) - F::splat(0.5)) * strength;
    let level = F::splat(0.995).lt(normal.z);
    let turned = V3 { x: r.x + to_x, y: r.y + to_y, z: r.z };
    let turned = turned * (F::splat(1.0) / turned.dot(turned).sqrt());
    turned.or(level, r)
}
