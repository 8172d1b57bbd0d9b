//! The colour of what is seen: the twin of surface.wgsl.

use super::coats::Coats;
use super::grain::{noise, smooth};
use super::pattern;
use super::pencil::Hits;
use super::shadow::Shadow;
use super::sky::{ambient, develop, mirrored, sky, splat, veil};
use super::walk::Stack;
use crate::simd::{Float, Mask, V3, Word};
use crate::light::Light;
use crate::rays::Camera;
use crate::surface::Seen;
use crate::{Scene, World};

/// How far from a surface shadow rays begin. Metres.
const LIFT: f32 = 0.01;

/// What a camera's colours need to know.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) light: &'a Light,
    pub(crate) camera: &'a Camera,
}

impl Shade<'_> {
    /// The colours that sixteen rays see: red in bits 0 to 7, green, blue, 255.
    #[inline(always)]
    pub(crate) fn colors<F: Float, const G: usize>(
        &self,
        direction: V3<F>,
        hits: &Hits<F, G>,
        group: usize,
        seen: &Seen<F>,
        stack: &mut Stack,
    ) -> F::Word {
        let light = self.light;
        let stretch = direction.dot(direction).sqrt();
        let view = direction * (F::splat(1.0) / stretch);
        let mut color = V3::splat(glam::Vec3::ZERO);
        if seen.hit.any() {
            let t = seen.t.or(seen.hit, F::splat(1.0));
            let at = direction.mul_add(t, V3::splat(self.camera.origin));
            let (triangle, instance) = (hits.triangle[group], hits.instance[group]);
            let coats = Coats::new(self.scene, self.world, light, seen.hit, triangle, instance, at);
            let surface = self.surface(view, t, at, seen, coats, stack);
            color = surface.lerp(splat(light.haze), veil(light, t * stretch));
        }
        if !seen.hit.bits() != 0 {
            color = color.or(seen.hit, sky(light, view));
        }
        develop(light, color)
    }

    /// What a surface sends towards the camera.
    #[inline(always)]
    fn surface<F: Float>(
        &self,
        view: V3<F>,
        t: F,
        at: V3<F>,
        seen: &Seen<F>,
        mut coats: Coats<F>,
        stack: &mut Stack,
    ) -> V3<F> {
        let (light, zero, one) = (self.light, F::splat(0.0), F::splat(1.0));
        let away = zero.lt(seen.normal.dot(view));
        let normal = (-seen.normal).or(away, seen.normal);
        let cosine = -normal.dot(view);
        let pixel = t * F::splat(self.camera.pixel);
        let long = pixel / cosine.max(F::splat(0.06));
        coats.roughen(long);
        if (!coats.pattern.eq(F::Word::splat(0))).any() {
            pattern::draw(&mut coats, (pixel * long).sqrt(), light.horizon.w);
        }
        self.wet(&mut coats, at, normal);

        let sun = light.sun.truncate();
        let facing = normal.dot(V3::splat(sun));
        let mut open = zero.lt(facing) & seen.hit;
        if open.any() && light.sun.w > 0.0 {
            let origins = normal.mul_add(F::splat(LIFT), at);
            let shadow = Shadow { direction: sun, origins, active: open };
            open = open & !shadow.blocked(self.scene, self.world, stack);
        }
        let direct = facing.max(zero).or(open, zero).max(coats.wrap * F::splat(0.22));
        let sun_color = splat::<F>(light.sun_color);
        let scattered = coats.albedo.times(sun_color.mul_add(direct, ambient(light, normal.z)));

        // Schlick 1994, for a mirror of that roughness.
        let low = one - cosine.clamp01();
        let fifth = low * low * (low * low) * low;
        let clear = one - coats.rough;
        let mirror = (one - coats.shine).mul_add(fifth * clear * clear, coats.shine);
        let mirror = mirror.or(zero.lt(coats.shine), zero);
        let r = normal.mul_add(cosine * F::splat(2.0), view);
        let seen_in_it = mirrored(light, r).lerp(ambient(light, normal.z), coats.rough);
        let spread = coats.rough.mul_add(coats.rough, F::splat(0.004));
        let lobe = spread / (one - r.dot(V3::splat(sun)) + spread);
        let spot = (lobe * lobe * F::splat(0.16) / spread).min(F::splat(16.0)).or(open, zero);
        let shining = sun_color.mul_add(spot, seen_in_it);
        scattered.lerp(shining, mirror) + coats.glow
    }

    /// Rain darkens what it wets, and stands in puddles on level ground.
    #[inline(always)]
    fn wet<F: Float>(&self, coats: &mut Coats<F>, at: V3<F>, normal: V3<F>) {
        let (wet, puddles) = (self.light.ground.w, self.light.air.y);
        if wet <= 0.0 && puddles <= 0.0 {
            return;
        }
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let upward = normal.z.max(zero);
        let damp = upward.mul_add(F::splat(0.7), F::splat(0.3)) * F::splat(wet);
        coats.albedo = coats.albedo * damp.mul_add(F::splat(-0.45), one);
        let film = upward * F::splat(wet);
        coats.shine = coats.shine.max(film * F::splat(0.05));
        coats.rough = coats.rough.lerp(F::splat(0.25), film);
        let level = F::splat(0.995).lt(normal.z);
        if puddles > 0.0 && level.any() {
            let (x, y) = (at.x * F::splat(0.3), at.y * F::splat(0.3));
            let low = noise(x, y, F::Word::splat(11));
            let begin = F::splat(1.0 - 0.75 * puddles);
            let pool = smooth(begin, begin + F::splat(0.08), low).or(level, zero);
            coats.albedo = coats.albedo * pool.mul_add(F::splat(-0.5), one);
            coats.shine = coats.shine.lerp(F::splat(0.06), pool);
            coats.rough = coats.rough.lerp(F::splat(0.02), pool);
        }
    }
}
