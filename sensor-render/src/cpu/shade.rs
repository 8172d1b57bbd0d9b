//! Shading: colours of surfaces and sky. Twin of shade.wgsl.

use glam::Vec3;
use mesh::{Material, Tag};

use super::grain::{noise, smooth};
use super::lamplight::LitSurface;
use super::pattern;
use super::ray_packet::Hits;
use super::shadow::Shadow;
use super::single_ray::SingleRay;
use super::sky::{ambient, gradient, haze_share, reflection, sky, splat};
use super::surface_materials::SurfaceMaterials;
use super::traversal::Stack;
use super::wear;
use crate::hit::{Hit, NONE};
use crate::lamps::LampGrid;
use crate::light::{Light, OCCLUSION_FADE_M, OCCLUSION_REACH_M};
use crate::quality::Sample;
use crate::rays::Camera;
use crate::scene::Scene;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::surface_sample::SurfaceSample;
use crate::world::World;

/// Distance from a surface at which shadow rays begin. Metres.
const LIFT: f32 = 0.01;

/// Roughness below which, and share of mirrored light above which, a reflection is traced.
const ROUGHNESS_MAX: f32 = 0.3;
const MIRROR_MIN: f32 = 0.05;

/// Share of light that a window pane lets through, and panes that a view passes at most.
const PANE: f32 = 0.72;
const PANES_MAX: usize = 4;

/// Share of the light outside of a vehicle that arrives within it.
const CABIN: f32 = 0.3;

/// Rings of rain drops on a metre of water.
const RIPPLES_PER_M: f32 = 14.0;

/// Inputs of shading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shade<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) world: &'a World,
    pub(crate) light: &'a Light,
    pub(crate) lamps: &'a LampGrid,
    pub(crate) camera: &'a Camera,
}

/// Radiance towards the camera, divided by what shadow rays decide about.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Radiance<F: Float> {
    /// Part that no ray decides about.
    base: V3<F>,
    /// Diffuse light of the sky, if nothing near keeps it away.
    sky: V3<F>,
    /// By the sun, if it is not in shadow.
    sun: V3<F>,
    /// By the strongest lamp, if it is not in shadow.
    lamp: V3<F>,
    /// Index of that lamp; [`NONE`] if there is none.
    lamp_number: F::Word,
}

impl<F: Float> Radiance<F> {
    #[inline(always)]
    pub(crate) fn black() -> Self {
        let black = V3::splat(Vec3::ZERO);
        Radiance {
            base: black,
            sky: black,
            sun: black,
            lamp: black,
            lamp_number: F::Word::splat(NONE),
        }
    }

    /// Returns `self` where the mask is set, else `other`.
    #[inline(always)]
    pub(crate) fn or(self, mask: F::Mask, other: Self) -> Self {
        Radiance {
            base: self.base.or(mask, other.base),
            sky: self.sky.or(mask, other.sky),
            sun: self.sun.or(mask, other.sun),
            lamp: self.lamp.or(mask, other.lamp),
            lamp_number: self.lamp_number.or(mask, other.lamp_number),
        }
    }
}

impl Shade<'_> {
    /// Returns the radiance along the rays of `active`; it is unspecified along others. With `DETAILED`,
    /// the reflections of smooth surfaces are traced.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "inlined; a struct would name them again")]
    pub(crate) fn radiance<F: Float, const G: usize, const DETAILED: bool>(
        &self,
        origin: V3<F>,
        direction: V3<F>,
        hits: &Hits<F, G>,
        group: usize,
        sample: &SurfaceSample<F>,
        active: F::Mask,
        stack: &mut Stack,
    ) -> Radiance<F> {
        let light = self.light;
        let stretch = direction.dot(direction).sqrt();
        let view = direction * (F::splat(1.0) / stretch);
        let mut radiance = Radiance::black();
        let hit = sample.hit & active;
        if hit.any() {
            let t = sample.t.or(sample.hit, F::splat(1.0));
            let at = direction.mul_add(t, origin);
            let (triangle, instance) = (hits.triangle[group], hits.instance[group]);
            let surfaces =
                SurfaceMaterials::new(self.scene, self.world, light, hit, triangle, instance, at);
            radiance = self.surface::<F, DETAILED>(view, t, at, sample, surfaces, hit, stack);
            let haze = haze_share(light, t * stretch);
            let clear = F::splat(1.0) - haze;
            radiance.base = radiance.base.lerp(splat(light.haze), haze);
            radiance.sky = radiance.sky * clear;
            radiance.sun = radiance.sun * clear;
            radiance.lamp = radiance.lamp * clear;
        }
        let missed = !sample.hit & active;
        if missed.any() {
            let sky = Radiance { base: sky::<F, DETAILED>(light, view), ..Radiance::black() };
            radiance = sky.or(missed, radiance);
        }
        radiance
    }

    /// Returns a radiance with the sun and the strongest lamp where they are not in shadow. `of_pixel`
    /// is the point of the sun's disc that shadows are computed for, `of_sky` the direction of the sky that
    /// ambient occlusion is computed for; without it there is none.
    #[expect(clippy::too_many_arguments, reason = "inlined; a struct would name them again")]
    #[inline(always)]
    pub(crate) fn with_shadows<F: Float>(
        &self,
        radiance: Radiance<F>,
        origin: V3<F>,
        direction: V3<F>,
        sample: &SurfaceSample<F>,
        of_pixel: Sample,
        of_sky: Option<Vec3>,
        stack: &mut Stack,
    ) -> V3<F> {
        let (light, zero) = (self.light, F::splat(0.0));
        let mut color = radiance.base;
        if !sample.hit.any() {
            return color;
        }
        let t = sample.t.or(sample.hit, F::splat(1.0));
        let at = direction.mul_add(t, origin);
        let away = zero.lt(sample.normal.dot(direction));
        let normal = (-sample.normal).or(away, sample.normal);
        let origins = normal.mul_add(F::splat(LIFT), at);
        let sky_share = match of_sky {
            Some(of_sky) => {
                let shaded = sample.hit & !is_foliage::<F>(sample.face);
                self.sky_share(of_sky, origins, normal, t, shaded, stack)
            }
            None => F::splat(1.0),
        };
        color = color + radiance.sky * sky_share;
        let sun = light.sun.truncate();
        let mut open = zero.lt(normal.dot(V3::splat(sun))) & sample.hit;
        if open.any() && light.sun.w > 0.0 {
            let direction = light.on_sun(of_pixel);
            let shadow = Shadow { direction, origins, active: open };
            open = open & !shadow.blocked(self.scene, self.world, stack);
        }
        color = color + radiance.sun.or(open, V3::splat(Vec3::ZERO));
        let lit = !radiance.lamp_number.eq(F::Word::splat(NONE)) & sample.hit;
        if lit.any() {
            let Shade { scene, world, lamps, .. } = *self;
            let open = lamps.reaches(scene, world, origins, radiance.lamp_number, lit, stack);
            color = color + radiance.lamp.or(open, V3::splat(Vec3::ZERO));
        }
        color
    }

    /// Returns the share of the light from a direction of the sky that reaches the active points; 1 where they
    /// face another direction or are far from the camera.
    #[inline(always)]
    fn sky_share<F: Float>(
        &self,
        of_sky: Vec3,
        origins: V3<F>,
        normal: V3<F>,
        t: F,
        active: F::Mask,
        stack: &mut Stack,
    ) -> F {
        let one = F::splat(1.0);
        let [near, far] = OCCLUSION_FADE_M;
        let faces = F::splat(0.05).lt(normal.dot(V3::splat(of_sky)));
        let traced = active & faces & t.lt(F::splat(far));
        if !traced.any() {
            return one;
        }
        let rays = Shadow { direction: of_sky, origins, active: traced };
        let open = rays.nearest(self.scene, self.world, stack);
        let share = open * F::splat(1.0 / OCCLUSION_REACH_M);
        share.lerp(one, smooth(F::splat(near), F::splat(far), t)).or(traced, one)
    }

    /// Returns the radiance from a surface towards the camera, without the atmosphere between.
    #[expect(clippy::too_many_arguments, reason = "inlined; a struct would name them again")]
    #[inline(always)]
    fn surface<F: Float, const DETAILED: bool>(
        &self,
        view: V3<F>,
        t: F,
        at: V3<F>,
        sample: &SurfaceSample<F>,
        mut surfaces: SurfaceMaterials<F>,
        active: F::Mask,
        stack: &mut Stack,
    ) -> Radiance<F> {
        let (light, zero, one) = (self.light, F::splat(0.0), F::splat(1.0));
        let away = zero.lt(sample.normal.dot(view));
        let flat = (-sample.normal).or(away, sample.normal);
        // The normal between those of the corners, unless the camera looked at its back.
        let smooth = (-surfaces.smooth).or(surfaces.smooth.dot(flat).lt(zero), surfaces.smooth);
        let normal = flat.or(smooth.dot(view).ge(zero), smooth);
        let cosine = -normal.dot(view);
        let pixel = t * F::splat(self.camera.pixel);
        let long = pixel / cosine.max(F::splat(0.06));
        surfaces.apply_grain(long);
        if (!surfaces.pattern.eq(F::Word::splat(0))).any() {
            let pixel = (pixel * long).sqrt();
            if DETAILED {
                wear::apply(&mut surfaces, pixel);
            }
            pattern::draw(&mut surfaces, pixel, light.horizon.w);
        }
        self.apply_wetness(&mut surfaces, at, normal);

        // Schlick 1994, attenuated by roughness.
        let low = one - cosine.clamp01();
        let fifth = low * low * (low * low) * low;
        let clear = one - surfaces.roughness;
        let mirror = (one - surfaces.specular).mul_add(fifth * clear * clear, surfaces.specular);
        let mirror = mirror.or(zero.lt(surfaces.specular), zero);
        let r = normal.mul_add(cosine * F::splat(2.0), view);

        let sun = light.sun.truncate();
        let sun_color = splat::<F>(light.sun_color);
        let facing = normal.dot(V3::splat(sun));
        let around = surfaces.wrap * F::splat(0.22);
        let ambient = ambient(light, normal.z);
        let shaded = surfaces.albedo.times(sun_color * around);
        let mut mirrored = reflection(light, r);
        if DETAILED {
            let sharp = surfaces.roughness.lt(F::splat(ROUGHNESS_MAX));
            let strong = F::splat(MIRROR_MIN).lt(mirror * clear);
            let traced = active & sharp & strong;
            if traced.any() {
                let origins = flat.mul_add(F::splat(LIFT), at);
                let r = rippled(light, at, normal, r, long);
                mirrored = self.mirrored(origins, r, traced, stack).or(traced, mirrored);
            }
        }
        let reflected = mirrored.lerp(ambient, surfaces.roughness);
        let mut base = shaded.lerp(reflected, mirror) + surfaces.emission;
        if DETAILED {
            let panes = active & is_pane::<F>(sample.face);
            if panes.any() {
                let behind = self.behind(at, view, sample.id, panes, stack) * (one - mirror);
                base = (base + behind).or(panes, base);
            }
        }
        let sky = surfaces.albedo.times(ambient) * (one - mirror);

        let direct = surfaces.albedo * (facing.max(around) - around);
        let spread = surfaces.roughness.mul_add(surfaces.roughness, F::splat(0.004));
        let lobe = spread / (one - r.dot(V3::splat(sun)) + spread);
        let spot = (lobe * lobe * F::splat(0.16) / spread).min(F::splat(16.0));
        let spot = V3 { x: spot, y: spot, z: spot };
        let sun = direct.lerp(spot, mirror).times(sun_color);

        let lit = LitSurface { at, normal, view, mirror, materials: &surfaces, active };
        let lamps = self.lamps.illuminate(&lit);
        Radiance {
            base: base + lamps.others,
            sky,
            sun,
            lamp: lamps.strongest,
            lamp_number: lamps.number,
        }
    }

    /// Returns the radiance along rays from mirroring surfaces.
    #[inline(always)]
    fn mirrored<F: Float>(
        &self,
        origins: V3<F>,
        directions: V3<F>,
        active: F::Mask,
        stack: &mut Stack,
    ) -> V3<F> {
        let Shade { scene, world, .. } = *self;
        let V3 { x, y, z } = origins;
        let (x, y, z) = (x.to_array(), y.to_array(), z.to_array());
        let (dx, dy) = (directions.x.to_array(), directions.y.to_array());
        let dz = directions.z.to_array();
        let mut hits = [Hit::none(f32::INFINITY); LANES];
        let mut left = active.bits();
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let origin = Vec3::new(x[lane], y[lane], z[lane]);
            let direction = Vec3::new(dx[lane], dy[lane], dz[lane]);
            let ray = SingleRay::new(origin, direction, scene.reach);
            ray.closest::<F::Float8>(scene, world, stack, &mut hits[lane]);
        }
        self.glimpse(origins, directions, &hits, F::Word::splat(NONE))
    }

    /// Returns the radiance that arrives through panes at `at` of the vehicles with these ids, as that of
    /// [`Shade::mirrored`].
    #[inline(always)]
    fn behind<F: Float>(
        &self,
        at: V3<F>,
        view: V3<F>,
        id: F::Word,
        active: F::Mask,
        stack: &mut Stack,
    ) -> V3<F> {
        let Shade { scene, world, .. } = *self;
        let (x, y, z) = (at.x.to_array(), at.y.to_array(), at.z.to_array());
        let (dx, dy, dz) = (view.x.to_array(), view.y.to_array(), view.z.to_array());
        let mut hits = [Hit::none(f32::INFINITY); LANES];
        let mut passed = [0.0; LANES];
        let mut left = active.bits();
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            left &= left - 1;
            let origin = Vec3::new(x[lane], y[lane], z[lane]);
            let direction = Vec3::new(dx[lane], dy[lane], dz[lane]);
            let (mut from, mut share) = (LIFT, PANE);
            for _ in 0..PANES_MAX {
                let mut hit = Hit::none(f32::INFINITY);
                let ray = SingleRay::new(origin + direction * from, direction, scene.reach);
                ray.closest::<F::Float8>(scene, world, stack, &mut hit);
                hit.t += from;
                (hits[lane], passed[lane]) = (hit, share);
                if hit.triangle == NONE || !is_clear(scene.triangles[hit.triangle as usize].face) {
                    break;
                }
                (from, share) = (hit.t + LIFT, share * PANE);
            }
        }
        self.glimpse(at, view, &hits, id) * F::from_array(passed)
    }

    /// Returns the radiance of surfaces in the distance: their diffuse light, without shadows and patterns, and
    /// their emission; of the sky where there are none. Surfaces with the id `around` lie within a vehicle.
    #[inline(always)]
    fn glimpse<F: Float>(
        &self,
        origins: V3<F>,
        directions: V3<F>,
        hits: &[Hit; LANES],
        around: F::Word,
    ) -> V3<F> {
        let Shade { scene, world, light, .. } = *self;
        let t = F::from_array(hits.map(|hit| hit.t));
        let triangle = F::Word::from_array(hits.map(|hit| hit.triangle));
        let instance = F::Word::from_array(hits.map(|hit| hit.instance));
        let sample = SurfaceSample::<F>::new(scene, world, t, triangle, instance);
        let sky = gradient(light, directions.z);
        if !sample.hit.any() {
            return sky;
        }
        let zero = F::splat(0.0);
        let t = t.or(sample.hit, F::splat(1.0));
        let at = directions.mul_add(t, origins);
        let surfaces =
            SurfaceMaterials::new(scene, world, light, sample.hit, triangle, instance, at);
        let away = zero.lt(sample.normal.dot(directions));
        let normal = (-sample.normal).or(away, sample.normal);
        let facing = normal.dot(splat(light.sun)).max(zero) * F::splat(0.7);
        let arriving = splat::<F>(light.sun_color).mul_add(facing, ambient(light, normal.z));
        let inside = F::splat(CABIN).or(sample.id.eq(around), F::splat(1.0));
        let surface = surfaces.albedo.times(arriving) * inside + surfaces.emission;
        surface.lerp(splat(light.haze), haze_share(light, t)).or(sample.hit, sky)
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
        let sealed = zero.lt(surfaces.specular);
        surfaces.specular = surfaces.specular.max(film * F::splat(0.05));
        surfaces.roughness = surfaces.roughness.lerp(F::splat(0.25), film);
        let level = F::splat(0.995).lt(normal.z) & sealed;
        if puddles > 0.0 && level.any() {
            // Large hollows with ragged edges.
            let (x, y) = (at.x * F::splat(0.19), at.y * F::splat(0.19));
            let low = noise(x, y, F::Word::splat(11)) * F::splat(0.72);
            let (x, y) = (at.x * F::splat(1.1), at.y * F::splat(1.1));
            let low = noise(x, y, F::Word::splat(12)).mul_add(F::splat(0.2), low);
            let (x, y) = (at.x * F::splat(5.3), at.y * F::splat(5.3));
            let low = noise(x, y, F::Word::splat(13)).mul_add(F::splat(0.08), low);
            let begin = F::splat(0.9 - 0.42 * puddles);
            let pool = smooth(begin, begin + F::splat(0.05), low).or(level, zero);
            surfaces.albedo = surfaces.albedo * pool.mul_add(F::splat(-0.45), one);
            surfaces.specular = surfaces.specular.max(pool * F::splat(0.02));
            surfaces.roughness = surfaces.roughness.lerp(F::splat(0.01), pool);
        }
    }
}

/// Returns which faces are window panes of vehicles.
#[inline(always)]
fn is_pane<F: Float>(face: F::Word) -> F::Mask {
    let [tag, material] = [F::Word::splat(0xff), face.shr::<8>() & F::Word::splat(0xff)];
    let of_building = (face & tag).eq(F::Word::splat(Tag::Building as u32));
    material.eq(F::Word::splat(Material::Glass as u32)) & !of_building
}

/// As [`is_pane`], of one face.
fn is_clear(face: u32) -> bool {
    let [tag, material, ..] = face.to_le_bytes();
    material == Material::Glass as u8 && tag != Tag::Building as u8
}

/// Returns which faces are leaves or needles: their colours already have the darkness of their crown.
#[inline(always)]
fn is_foliage<F: Float>(face: F::Word) -> F::Mask {
    let material = face.shr::<8>() & F::Word::splat(0xff);
    material.eq(F::Word::splat(Material::Leaves as u32))
        | material.eq(F::Word::splat(Material::Needles as u32))
}

/// Returns reflected directions that the rings of rain drops on level water turn, where a pixel, `pixel`
/// metres long on the water, can resolve the rings.
#[inline(always)]
fn rippled<F: Float>(light: &Light, at: V3<F>, normal: V3<F>, r: V3<F>, pixel: F) -> V3<F> {
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
