//! Shading: colours of surfaces and sky. Twin of shade.wgsl.

use glam::Vec3;
use mesh::{Material, Tag};

use super::grain::smooth;
use super::lamplight::LitSurface;
use super::pattern;
use super::ray_group::{GroupHits, RayGroup};
use super::ray_packet::Hits;
use super::room;
use super::shadow::Shadow;
use super::shortlist::Surroundings;
use super::sky::{ambient, blurred_reflection, haze_share, reflection, sky, splat};
use super::surface_materials::SurfaceMaterials;
use super::traversal::Stack;
use super::{occlusion, shadow};
use super::{wear, wet};
use crate::hit::NONE;
use crate::lamps::LampGrid;
use crate::light::{Light, OCCLUSION_DARK_M, OCCLUSION_FADE_M, OCCLUSION_REACH_M};
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

/// Roughness from which on traced reflections fade into those of a plain street, and how fast: a rough surface
/// blurs what it mirrors. Level ones do so less by [`FILM`]: the film of water on a wet road is smoother.
const SOFT_FROM: f32 = 0.08;
const FILM: f32 = 0.4;
const SOFT_PER: f32 = 4.0;
const SOFT_MAX: f32 = 0.7;

/// Share of the sun's light on the back of a leaf that passes it, by colour.
const THROUGH_LEAF: Vec3 = Vec3::new(0.62, 0.70, 0.30);

/// Share of mirrored light above which a paint of no albedo mirrors traced surroundings, how much of it more by
/// the albedo, at most [`MIRROR_MIN`]: what a clear coat mirrors shows on dark paint.
const COAT_MIN: f32 = 0.03;
const COAT_PER_ALBEDO: f32 = 0.1;

/// Paint with metal flakes under its clear coat, of the albedo: the diffuse share, the flakes about the mirrored
/// sun, their share of the light of sky and ground, and how far they are turned, as 1 − cosine.
///
/// The first, second and last give a silver paint luminances of about 200 %, 35 % and 11 % of white at 15°, 45° and
/// 110° from the mirrored light, the angles at which ASTM E2194 measures metallic paint, with the albedo that at
/// 45°; H. Westlund and G. Meyer, *Applying Appearance Standards to Light Reflection Models*, SIGGRAPH 2001, derive
/// reflection models from such measurements. The third is the integral of that lobe over
/// the hemisphere, 1.39, without the tenth of light from all sides that the clear coat mirrors.
const PIGMENT: f32 = 0.3;
const FLAKES: f32 = 7.5;
const FLAKES_SKY: f32 = 1.25;
const FLAKES_SPREAD: f32 = 0.13;
/// Albedo between which paint has fewer and fewer flakes: aluminium is grey at 45°, and white paint is solid.
const SOLID: [f32; 2] = [0.32, 0.48];

/// The mirrored sun: what its disc and unevenness of the surface add to the spread of the reflection, as
/// 1 − cosine, and the largest radiance over that of a white surface that faces the sun, so that few pixels of a
/// mirror are much brighter than all others. The reflection has an integral of π, as a white surface reflects 1 / π
/// of its irradiance, where the disc is seen: not behind clouds, and not of the moon: its light stands for all
/// that a night sky sends.
const SPOT_LEAST: f32 = 0.0008;
const SPOT_MAX: f32 = 300.0;

/// Share of light that a window pane lets through: 0.75 of windscreens, 0.15 to 0.7 of the others. Surfaces that a view
/// through one meets at most.
const PANE: f32 = 0.5;
const PANES_MAX: usize = 4;

/// Share of the light outside of a vehicle that arrives within it, and the distances behind a pane between which
/// it falls to that: the roof keeps the sun and most of the sky away. Metres.
const CABIN: f32 = 0.14;
const CABIN_M: [f32; 2] = [0.06, 0.3];

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
            let sky = Radiance { base: sky::<F, DETAILED, true>(light, view), ..Radiance::black() };
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
        mut of_sky: Option<(Vec3, &mut Surroundings<F>)>,
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
        let mut origins = normal.mul_add(F::splat(LIFT), at);
        let sky_share = match &mut of_sky {
            Some((of_sky, around)) => {
                let shaded = sample.hit & !is_foliage::<F>(sample.face);
                self.sky_share(*of_sky, around, origins, normal, t, shaded, stack)
            }
            None => F::splat(1.0),
        };
        color = color + radiance.sky * sky_share;
        let sun = light.sun.truncate();
        let facing = normal.dot(V3::splat(sun));
        let mut open = zero.lt(facing) & sample.hit;
        if of_sky.is_some() {
            // Leaves are lit from behind, too.
            let behind = is_foliage::<F>(sample.face) & facing.lt(zero) & sample.hit;
            origins = normal.mul_add(F::splat(-LIFT), at).or(behind, origins);
            open = open | behind;
        }
        if open.any() && light.sun.w > 0.0 {
            let direction = light.on_sun(of_pixel);
            let shadow = Shadow { direction, origins, active: open };
            let near = match of_sky {
                Some((_, around)) => {
                    around.towards_sun(self.scene, self.world, LIFT, shadow::SPREAD_MAX)
                }
                None => None,
            };
            open = open & !shadow.blocked(self.scene, self.world, near, stack);
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
    #[expect(clippy::too_many_arguments, reason = "inlined; a struct would name them again")]
    #[inline(always)]
    fn sky_share<F: Float>(
        &self,
        of_sky: Vec3,
        around: &mut Surroundings<F>,
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
        let around = around.towards_sky(self.scene, self.world, LIFT, occlusion::SPREAD_MAX);
        let open = rays.nearest(self.scene, self.world, around, stack);
        let [dark, reach] = [OCCLUSION_DARK_M, OCCLUSION_REACH_M];
        let share = ((open - F::splat(dark)) * F::splat(1.0 / (reach - dark))).max(F::splat(0.0));
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
        let between = (-surfaces.smooth).or(surfaces.smooth.dot(flat).lt(zero), surfaces.smooth);
        let normal = flat.or(between.dot(view).ge(zero), between);
        let cosine = -normal.dot(view);
        let pixel = t * F::splat(self.camera.pixel);
        let long = pixel / cosine.max(F::splat(0.06));
        surfaces.apply_grain(long);
        if (!surfaces.pattern.eq(F::Word::splat(0))).any() {
            let pixel = (pixel * long).sqrt();
            pattern::lay_bricks(&mut surfaces, pixel);
            if DETAILED {
                wear::apply(&mut surfaces, pixel);
            }
            pattern::draw(&mut surfaces, pixel, light.horizon.w);
            if DETAILED {
                room::furnish(&mut surfaces, light, view, flat, active);
            }
        }
        wet::apply(&mut surfaces, light, at, normal, long);

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
        let paint = active & is_of::<F>(sample.face, Material::CarPaint);
        if DETAILED {
            let sharp = surfaces.roughness.lt(F::splat(ROUGHNESS_MAX));
            let coat = surfaces.albedo.y.mul_add(F::splat(COAT_PER_ALBEDO), F::splat(COAT_MIN));
            let least = coat.min(F::splat(MIRROR_MIN)).or(paint, F::splat(MIRROR_MIN));
            let strong = least.lt(mirror * clear);
            let traced = active & sharp & strong;
            if traced.any() {
                let origins = flat.mul_add(F::splat(LIFT), at);
                let r = wet::rippled(light, at, normal, r, long);
                let outside = F::Word::splat(NONE);
                let seen = self.seen::<F, 1>(origins, r, outside, traced, stack);
                let soft = (surfaces.roughness - F::splat(SOFT_FROM)) * F::splat(SOFT_PER);
                let level = normal.z.max(zero).mul_add(F::splat(-FILM), one);
                let soft = soft.max(zero).min(F::splat(SOFT_MAX)) * level;
                // No step where reflections are no longer traced.
                let rough = surfaces.roughness - F::splat(ROUGHNESS_MAX - 0.1);
                let soft = soft.max((rough * F::splat(10.0)).clamp01());
                mirrored = seen.lerp(mirrored, soft).or(traced, mirrored);
            }
        }
        // What a rough surface reflects comes from all of the sky, as its diffuse light does.
        let rough = surfaces.roughness.ge(F::splat(ROUGHNESS_MAX));
        let smooth_mirror = zero.or(rough, mirror);
        let rough_mirror = mirror.or(rough, zero);
        let reflected = mirrored.lerp(ambient, surfaces.roughness);
        let mut base = shaded * (one - mirror) + reflected * smooth_mirror + surfaces.emission;
        if DETAILED {
            let panes = active & is_pane::<F>(sample.face);
            if panes.any() {
                let origins = view.mul_add(F::splat(LIFT), at);
                let behind = self.seen::<F, PANES_MAX>(origins, view, sample.id, panes, stack);
                let behind = behind * ((one - mirror) * F::splat(PANE));
                base = (base + behind).or(panes, base);
            }
        }
        let mut sky = surfaces.albedo.times(ambient) * (one - mirror) + reflected * rough_mirror;

        let mut direct = surfaces.albedo * (facing.max(around) - around);
        if DETAILED {
            let leaves = is_foliage::<F>(sample.face);
            if leaves.any() {
                let through = surfaces.albedo.times(V3::splat(THROUGH_LEAF)) * (-facing).max(zero);
                direct = (direct + through).or(leaves, direct);
            }
            if paint.any() {
                let [low, high] = SOLID;
                let V3 { x, y, z } = surfaces.albedo;
                let metal = smooth(F::splat(high), F::splat(low), x.max(y).max(z));
                let pigment = metal.mul_add(F::splat(PIGMENT - 1.0), one);
                let apart = one - r.dot(V3::splat(sun)) + F::splat(FLAKES_SPREAD);
                let lobe = F::splat(FLAKES_SPREAD) / apart;
                let flakes = lobe * lobe * facing.clamp01() * (metal * F::splat(FLAKES));
                let flaky = direct * pigment + surfaces.albedo * flakes;
                direct = flaky.or(paint, direct);
                let around = surfaces.albedo.times(blurred_reflection(light, r.z));
                let flaky =
                    sky * pigment + around * (metal * F::splat(FLAKES_SKY) * (one - mirror));
                sky = flaky.or(paint, sky);
            }
        }
        let spread = surfaces.roughness.mul_add(surfaces.roughness, F::splat(SPOT_LEAST));
        let lobe = spread / (one - r.dot(V3::splat(sun)) + spread);
        let spot = (lobe * lobe * F::splat(0.5) / spread).min(F::splat(SPOT_MAX));
        let spot = spot * F::splat(light.sun_color.w);
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

    /// Returns the radiance along rays from mirroring surfaces or panes: the diffuse light of what they hit, without
    /// shadows and patterns, and its emission; that of the sky where they hit nothing. Of up to `SURFACES` surfaces
    /// that a ray hits, those before the last are panes, which it passes. Surfaces with the id `around` lie within
    /// a vehicle.
    #[inline(always)]
    fn seen<F: Float, const SURFACES: usize>(
        &self,
        origins: V3<F>,
        directions: V3<F>,
        around: F::Word,
        active: F::Mask,
        stack: &mut Stack,
    ) -> V3<F> {
        let Shade { scene, world, light, .. } = *self;
        let none = F::Word::splat(NONE);
        let mut hits = GroupHits { t: F::splat(0.0), triangle: none, instance: none };
        // Length of each ray up to its last pane, and the share of light that its panes let through.
        let (mut from, mut passed) = ([0.0; LANES], [1.0; LANES]);
        let mut left = active;
        for surface in 1..=SURFACES {
            let starts = directions.mul_add(F::from_array(from), origins);
            let rays = RayGroup { origins: starts, directions, active: left };
            let found = rays.closest(scene, world, stack, f32::INFINITY);
            hits.t = (found.t + F::from_array(from)).or(left, hits.t);
            hits.triangle = found.triangle.or(left, hits.triangle);
            hits.instance = found.instance.or(left, hits.instance);
            let mut met = (left & !found.triangle.eq(none)).bits();
            left = F::Mask::from_bits(0);
            if surface == SURFACES {
                break;
            }
            let (t, triangle) = (hits.t.to_array(), found.triangle.to_array());
            while met != 0 {
                let lane = met.trailing_zeros() as usize % LANES;
                met &= met - 1;
                if is_clear(scene.triangles[triangle[lane] as usize].face) {
                    from[lane] = t[lane] + LIFT;
                    passed[lane] *= PANE;
                    left = left | F::Mask::from_bits(1 << lane);
                }
            }
            if !left.any() {
                break;
            }
        }
        let GroupHits { t, triangle, instance } = hits;
        let sample = SurfaceSample::<F>::new(scene, world, t, triangle, instance);
        let passed = F::from_array(passed);
        let mut seen = V3::splat(Vec3::ZERO);
        if (active & !sample.hit).any() {
            seen = sky::<F, false, false>(light, directions);
        }
        if !sample.hit.any() {
            return seen * passed;
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
        let [near, far] = CABIN_M;
        let inside = smooth(F::splat(near), F::splat(far), t);
        let inside = inside.mul_add(F::splat(CABIN - 1.0), F::splat(1.0));
        let inside = inside.or(sample.id.eq(around), F::splat(1.0));
        let surface = surfaces.albedo.times(arriving) * inside + surfaces.emission;
        surface.lerp(splat(light.haze), haze_share(light, t)).or(sample.hit, seen) * passed
    }
}

/// Returns which faces are window panes of vehicles.
#[inline(always)]
fn is_pane<F: Float>(face: F::Word) -> F::Mask {
    let of_building = (face & F::Word::splat(0xff)).eq(F::Word::splat(Tag::Building as u32));
    is_of::<F>(face, Material::Glass) & !of_building
}

/// Returns which faces are of a material.
#[inline(always)]
fn is_of<F: Float>(face: F::Word, material: Material) -> F::Mask {
    (face.shr::<8>() & F::Word::splat(0xff)).eq(F::Word::splat(material as u32))
}

/// Returns whether a face is such a pane.
fn is_clear(face: u32) -> bool {
    let [tag, material, ..] = face.to_le_bytes();
    material == Material::Glass as u8 && tag != Tag::Building as u8
}

/// Returns which faces are leaves or needles: their colours already have the darkness of their crown.
#[inline(always)]
fn is_foliage<F: Float>(face: F::Word) -> F::Mask {
    is_of::<F>(face, Material::Leaves) | is_of::<F>(face, Material::Needles)
}
