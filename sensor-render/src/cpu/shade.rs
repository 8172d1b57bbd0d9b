//! Shading: colours of surfaces and sky. Twin of shade.wgsl.

use super::grain::{noise, smooth};
use super::pattern;
use super::ray_packet::Hits;
use super::shadow::Shadow;
use super::sky::{ambient, haze_share, reflection, sky, splat, tone_map};
use super::surface_materials::SurfaceMaterials;
use super::traversal::Stack;
use crate::light::Light;
use crate::rays::Camera;
use crate::scene::Scene;
use crate::simd::{Float, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Distance from a surface at which shadow rays begin. Metres.
const LIFT: f32 = 0.01;

/// Inputs of shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) light: &'a Light,
    pub(crate) camera: &'a Camera,
}

impl Shade<'_> {
    /// Returns the colours of sixteen rays: red in bits 0 to 7, green, blue, 255.
    #[inline(always)]
    pub(crate) fn colors<F: Float, const G: usize>(
        &self,
        direction: V3<F>,
        hits: &Hits<F, G>,
        group: usize,
        sample: &SurfaceSample<F>,
        stack: &mut Stack,
    ) -> F::Word {
        let light = self.light;
        let stretch = direction.dot(direction).sqrt();
        let view = direction * (F::splat(1.0) / stretch);
        let mut color = V3::splat(glam::Vec3::ZERO);
        if sample.hit.any() {
            let t = sample.t.or(sample.hit, F::splat(1.0));
            let at = direction.mul_add(t, V3::splat(self.camera.origin));
            let (triangle, instance) = (hits.triangle[group], hits.instance[group]);
            let surfaces = SurfaceMaterials::new(
                self.scene, self.world, light, sample.hit, triangle, instance, at,
            );
            let surface = self.surface(view, t, at, sample, surfaces, stack);
            color = surface.lerp(splat(light.haze), haze_share(light, t * stretch));
        }
        if !sample.hit.bits() != 0 {
            color = color.or(sample.hit, sky(light, view));
        }
        tone_map(light, color)
    }

    /// Returns the radiance from a surface towards the camera.
    #[inline(always)]
    fn surface<F: Float>(
        &self,
        view: V3<F>,
        t: F,
        at: V3<F>,
        sample: &SurfaceSample<F>,
        mut surfaces: SurfaceMaterials<F>,
        stack: &mut Stack,
    ) -> V3<F> {
        let (light, zero, one) = (self.light, F::splat(0.0), F::splat(1.0));
        let away = zero.lt(sample.normal.dot(view));
        let normal = (-sample.normal).or(away, sample.normal);
        let cosine = -normal.dot(view);
        let pixel = t * F::splat(self.camera.pixel);
        let long = pixel / cosine.max(F::splat(0.06));
        surfaces.apply_grain(long);
        if (!surfaces.pattern.eq(F::Word::splat(0))).any() {
            pattern::draw(&mut surfaces, (pixel * long).sqrt(), light.horizon.w);
        }
        self.apply_wetness(&mut surfaces, at, normal);

        let sun = light.sun.truncate();
        let facing = normal.dot(V3::splat(sun));
        let mut open = zero.lt(facing) & sample.hit;
        if open.any() && light.sun.w > 0.0 {
            let origins = normal.mul_add(F::splat(LIFT), at);
            let shadow = Shadow { direction: sun, origins, active: open };
            open = open & !shadow.blocked(self.scene, self.world, stack);
        }
        let direct = facing.max(zero).or(open, zero).max(surfaces.wrap * F::splat(0.22));
        let sun_color = splat::<F>(light.sun_color);
        let scattered = surfaces.albedo.times(sun_color.mul_add(direct, ambient(light, normal.z)));

        // Schlick 1994, attenuated by roughness.
        let low = one - cosine.clamp01();
        let fifth = low * low * (low * low) * low;
        let clear = one - surfaces.roughness;
        let mirror = (one - surfaces.specular).mul_add(fifth * clear * clear, surfaces.specular);
        let mirror = mirror.or(zero.lt(surfaces.specular), zero);
        let r = normal.mul_add(cosine * F::splat(2.0), view);
        let reflected = reflection(light, r).lerp(ambient(light, normal.z), surfaces.roughness);
        let spread = surfaces.roughness.mul_add(surfaces.roughness, F::splat(0.004));
        let lobe = spread / (one - r.dot(V3::splat(sun)) + spread);
        let spot = (lobe * lobe * F::splat(0.16) / spread).min(F::splat(16.0)).or(open, zero);
        let shining = sun_color.mul_add(spot, reflected);
        scattered.lerp(shining, mirror) + surfaces.emission
    }

    /// Applies rain: wet surfaces are darker and glossier, and level ground has puddles.
    #[inline(always)]
    fn apply_wetness<F: Float>(
        &self,
        surfaces: &mut SurfaceMaterials<F>,
        at: V3<F>,
        normal: V3<F>,
    ) {
        let (wetness, puddles) = (self.light.ground.w, self.light.air.y);
        if wetness <= 0.0 && puddles <= 0.0 {
            return;
        }
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let upward = normal.z.max(zero);
        let damp = upward.mul_add(F::splat(0.7), F::splat(0.3)) * F::splat(wetness);
        surfaces.albedo = surfaces.albedo * damp.mul_add(F::splat(-0.45), one);
        let film = upward * F::splat(wetness);
        surfaces.specular = surfaces.specular.max(film * F::splat(0.05));
        surfaces.roughness = surfaces.roughness.lerp(F::splat(0.25), film);
        let level = F::splat(0.995).lt(normal.z);
        if puddles > 0.0 && level.any() {
            let (x, y) = (at.x * F::splat(0.3), at.y * F::splat(0.3));
            let low = noise(x, y, F::Word::splat(11));
            let begin = F::splat(1.0 - 0.75 * puddles);
            let pool = smooth(begin, begin + F::splat(0.08), low).or(level, zero);
            surfaces.albedo = surfaces.albedo * pool.mul_add(F::splat(-0.5), one);
            surfaces.specular = surfaces.specular.lerp(F::splat(0.06), pool);
            surfaces.roughness = surfaces.roughness.lerp(F::splat(0.02), pool);
        }
    }
}
