//! Light of lamps on surfaces. Twin of lamplight.wgsl.

use glam::Vec3;

use super::grain::smooth;
use super::ray_group::RayGroup;
use super::surface_materials::SurfaceMaterials;
use super::traversal::Stack;
use crate::hit::NONE;
use crate::lamps::{Lamp, LampGrid, kind};
use crate::scene::Scene;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::world::World;

/// Radiance that lamps cause towards the camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lamplight<F: Float> {
    /// By all lamps but the strongest, without shadows.
    pub(crate) others: V3<F>,
    /// By the strongest, where it is not in shadow.
    pub(crate) strongest: V3<F>,
    /// Index of the strongest; [`NONE`] if there is none.
    pub(crate) number: F::Word,
}

/// Surface points that are lit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitSurface<'a, F: Float> {
    pub(crate) at: V3<F>,
    pub(crate) normal: V3<F>,
    pub(crate) view: V3<F>,
    /// Share of specular reflection towards the camera.
    pub(crate) mirror: F,
    pub(crate) materials: &'a SurfaceMaterials<F>,
    pub(crate) active: F::Mask,
}

impl LampGrid {
    /// Returns the light of the lamps near to each surface point.
    #[inline(always)]
    pub(crate) fn illuminate<F: Float>(&self, surface: &LitSurface<F>) -> Lamplight<F> {
        let black = V3::splat(Vec3::ZERO);
        let mut light = Lamplight { others: black, strongest: black, number: F::Word::splat(NONE) };
        if self.lamps.is_empty() {
            return light;
        }
        let per_m = F::splat(1.0 / self.side);
        let column = ((surface.at.x - F::splat(self.low.x)) * per_m).floor();
        let row = ((surface.at.y - F::splat(self.low.y)) * per_m).floor();
        let (columns, rows) = (F::splat(self.columns as f32), F::splat(self.rows as f32));
        let zero = F::splat(0.0);
        let within = column.ge(zero) & column.lt(columns) & row.ge(zero) & row.lt(rows);
        let cells = row.mul_add(columns, column).or(within, zero).to_int();
        let numbers = cells.to_array();
        let mut left = (within & surface.active).bits();
        let mut best = zero;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            let same = cells.eq(F::Word::splat(numbers[lane])) & F::Mask::from_bits(left);
            left &= !same.bits();
            for number in self.cells[numbers[lane] as usize] {
                if number == NONE {
                    break;
                }
                let radiance = radiance(&self.lamps[number as usize], surface, same);
                let strength = radiance.x + radiance.y + radiance.z;
                let stronger = best.lt(strength);
                best = strength.or(stronger, best);
                let weaker = light.strongest.or(stronger, radiance);
                light.others = light.others + weaker;
                light.strongest = radiance.or(stronger, light.strongest);
                light.number = F::Word::splat(number).or(stronger, light.number);
            }
        }
        light
    }

    /// Returns the points that the light of the lamps `numbers` reaches.
    #[inline(always)]
    pub(crate) fn reaches<F: Float>(
        &self,
        scene: &Scene,
        world: &World,
        points: V3<F>,
        numbers: F::Word,
        active: F::Mask,
        stack: &mut Stack,
    ) -> F::Mask {
        let of_lane = numbers.to_array();
        let mut left = active.bits();
        let mut reached = 0;
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            let same = numbers.eq(F::Word::splat(of_lane[lane])) & F::Mask::from_bits(left);
            left &= !same.bits();
            let lamp = Vec3::from(self.lamps[of_lane[lane] as usize].position);
            reached |= open_from(scene, world, lamp, points, same, stack).bits();
        }
        F::Mask::from_bits(reached)
    }
}

/// Returns the radiance that one lamp causes towards the camera; 0 outside of `mask`.
#[inline(always)]
fn radiance<F: Float>(lamp: &Lamp, surface: &LitSurface<F>, mask: F::Mask) -> V3<F> {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let to_lamp = V3::splat(Vec3::from(lamp.position)) - surface.at;
    let square = to_lamp.dot(to_lamp).max(F::splat(0.01));
    let direction = to_lamp * (one / square.sqrt());
    let incident = surface.normal.dot(direction);
    let wrap = surface.materials.wrap * F::splat(0.22);
    let reaches = mask & zero.lt(incident.max(wrap)) & square.lt(F::splat(lamp.reach * lamp.reach));
    if !reaches.any() {
        return V3::splat(Vec3::ZERO);
    }
    let incident = incident.max(zero);
    let near = one - square * square * F::splat(lamp.reach.powi(-4));
    let falloff = near * near * profile(lamp, direction) / square;
    let irradiance = falloff.or(reaches, zero);
    let half = direction - surface.view;
    let half = half * (one / half.dot(half).sqrt());
    // Trowbridge and Reitz's distribution of normals, with the visibility of Kelemen 2001.
    let rough = surface.materials.roughness;
    let a = (rough * rough).max(F::splat(0.02));
    let a2 = a * a;
    let along = surface.normal.dot(half).max(zero);
    let below = along.mul_add(along * (a2 - one), one);
    let grazing = direction.dot(half).max(F::splat(0.1));
    let low = one - grazing;
    let fresnel = low * low * (low * low) * low;
    let specular = surface.materials.specular;
    let clear = one - rough;
    let fresnel = (one - specular).mul_add(fresnel * clear * clear, specular);
    let fresnel = fresnel.or(zero.lt(specular), zero);
    let spot = a2 * fresnel / (below * below * grazing * grazing * F::splat(4.0));
    let spot = (spot * incident).min(F::splat(12.0));
    let diffuse = incident.max(wrap) * (one - surface.mirror);
    let color = V3::splat(Vec3::from(lamp.intensity));
    let of_surface = surface.materials.albedo * diffuse + V3 { x: spot, y: spot, z: spot };
    color.times(of_surface) * irradiance
}

/// Returns the radiant intensity of a lamp over that along its axis; `direction` leads to the lamp.
#[inline(always)]
fn profile<F: Float>(lamp: &Lamp, direction: V3<F>) -> F {
    let (zero, one) = (F::splat(0.0), F::splat(1.0));
    let axis = Vec3::from(lamp.direction);
    let along = -direction.dot(V3::splat(axis));
    match lamp.kind {
        kind::STREET => {
            let wide = F::splat(1.2) / along.mul_add(along, F::splat(0.2));
            smooth(F::splat(0.15), F::splat(0.5), along) * wide
        }
        kind::DIFFUSE => along.max(zero),
        beam => {
            let ahead = along.max(F::splat(0.02));
            let up = (-direction.z - along * F::splat(axis.z)) / ahead;
            let square = one / (ahead * ahead) - one;
            let aside = (square - up * up).max(zero);
            let sides = one / aside.mul_add(F::splat(9.0), one);
            let off = up + F::splat(0.03);
            let height = one / (off * off).mul_add(F::splat(25.0), one);
            let cut = match beam {
                kind::LOW_BEAM => smooth(F::splat(0.03), F::splat(-0.02), up),
                _ => one,
            };
            (sides * height * cut).or(F::splat(0.02).lt(along), zero)
        }
    }
}

/// Returns the points of `mask` from which a lamp is visible.
#[inline(always)]
fn open_from<F: Float>(
    scene: &Scene,
    world: &World,
    lamp: Vec3,
    points: V3<F>,
    mask: F::Mask,
    stack: &mut Stack,
) -> F::Mask {
    let origins = V3::splat(lamp);
    let rays = RayGroup { origins, directions: points - origins, active: mask };
    let hits = rays.closest(scene, world, stack, REACH);
    mask & hits.triangle.eq(F::Word::splat(NONE))
}

/// Share of the way from a lamp to a surface on which something may cast a shadow.
const REACH: f32 = 0.999;
