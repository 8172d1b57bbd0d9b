use glam::Vec3;

use super::grain::{noise, smooth};
use crate::light::Light;
use crate::scene::Scene;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::smooth_triangle::{Normals, SmoothTriangle};
use crate::surface_material::{DIRT_M, DUST, SurfaceMaterial};
use crate::world::World;

/// Shading parameters at sixteen points, and the positions of the points on their surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceMaterials<F: Float> {
    pub(crate) albedo: V3<F>,
    pub(crate) specular: F,
    pub(crate) emission: V3<F>,
    pub(crate) roughness: F,
    pub(crate) wrap: F,
    pub(crate) pattern: F::Word,
    pub(crate) grain: [F; 4],
    pub(crate) wall: [F; 4],
    pub(crate) seed: F::Word,
    /// Normals between those of the corners, of unit length, towards either side; 0 on flat surfaces.
    pub(crate) smooth: V3<F>,
    /// Position along the surface and up the surface, and height above z = 0. Metres.
    pub(crate) along: F,
    pub(crate) up: F,
    pub(crate) height: F,
}

impl<F: Float> SurfaceMaterials<F> {
    /// Looks up the shading parameters of the hits, once per triangle.
    #[inline(always)]
    pub(crate) fn new(
        scene: &Scene,
        world: &World,
        light: &Light,
        hit: F::Mask,
        triangle: F::Word,
        instance: F::Word,
        at: V3<F>,
    ) -> Self {
        let (zero, black) = (F::splat(0.0), V3::splat(Vec3::ZERO));
        let mut surfaces = SurfaceMaterials {
            albedo: black,
            specular: zero,
            emission: black,
            roughness: F::splat(1.0),
            wrap: zero,
            pattern: F::Word::splat(0),
            grain: [zero; 4],
            wall: [zero; 4],
            seed: F::Word::splat(0),
            smooth: black,
            along: zero,
            up: zero,
            height: at.z,
        };
        let (triangles, instances) = (triangle.to_array(), instance.to_array());
        let mut left = hit.bits();
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            let (index, of) = (triangles[lane], instances[lane]);
            let same = triangle.eq(F::Word::splat(index)) & instance.eq(F::Word::splat(of));
            left &= !same.bits();
            let surface = SurfaceMaterial::new(scene, world, light, index, of);
            if let Some(normals) = Normals::of(scene, world, index, of) {
                let normal = match normals {
                    Normals::Leaf(normal) => V3::splat(normal),
                    Normals::Corners(triangle) => interpolated(&triangle, at),
                };
                surfaces.smooth = normal.or(same, surfaces.smooth);
            }
            let mut albedo = V3::splat(surface.albedo);
            if surface.dirt > 0.0 {
                let height = at.dot(V3::splat(surface.road.truncate())) + F::splat(surface.road.w);
                let [low, high] = DIRT_M;
                let share = smooth(F::splat(high), F::splat(low), height);
                let dirt = share * F::splat(surface.dirt);
                albedo = albedo.lerp(V3::splat(DUST), dirt);
            }
            surfaces.albedo = albedo.or(same, surfaces.albedo);
            surfaces.emission = V3::splat(surface.emission).or(same, surfaces.emission);
            surfaces.specular = F::splat(surface.specular).or(same, surfaces.specular);
            surfaces.roughness = F::splat(surface.roughness).or(same, surfaces.roughness);
            surfaces.wrap = F::splat(surface.wrap).or(same, surfaces.wrap);
            surfaces.pattern = F::Word::splat(surface.pattern).or(same, surfaces.pattern);
            surfaces.seed = F::Word::splat(surface.seed).or(same, surfaces.seed);
            surfaces.along = at.dot(V3::splat(surface.along)).or(same, surfaces.along);
            surfaces.up = at.dot(V3::splat(surface.up)).or(same, surfaces.up);
            for number in 0..4 {
                surfaces.grain[number] =
                    F::splat(surface.grain[number]).or(same, surfaces.grain[number]);
                surfaces.wall[number] =
                    F::splat(surface.wall[number]).or(same, surfaces.wall[number]);
            }
        }
        surfaces
    }

    /// Adds grain to the albedo where a pixel, `pixel` metres wide on the surface, can resolve it.
    #[inline(always)]
    pub(crate) fn apply_grain(&mut self, pixel: F) {
        let [fine, fine_per_m, coarse, coarse_per_m] = self.grain;
        let mut wave = F::splat(1.0);
        for (strength, per_m) in [(fine, fine_per_m), (coarse, coarse_per_m)] {
            let strength = strength * (F::splat(1.5) - pixel * per_m).clamp01();
            if F::splat(0.0).lt(strength).any() {
                let spot = noise(self.along * per_m, self.up * per_m, F::Word::splat(3));
                wave = (spot - F::splat(0.5)).mul_add(strength * F::splat(2.0), wave);
            }
        }
        self.albedo = self.albedo * wave.max(F::splat(0.05));
    }
}

/// Returns the normals between those of the corners of a triangle.
#[inline(always)]
fn interpolated<F: Float>(triangle: &SmoothTriangle, at: V3<F>) -> V3<F> {
    let from_corner = at - V3::splat(triangle.corner);
    let u = from_corner.dot(V3::splat(triangle.for_u)).clamp01();
    let v = from_corner.dot(V3::splat(triangle.for_v)).clamp01();
    let [a, b, c] = triangle.normals;
    let (a, b, c) = (V3::splat(a), V3::splat(b), V3::splat(c));
    let sum = c.mul_add(v, b.mul_add(u, a * (F::splat(1.0) - u - v)));
    sum * (F::splat(1.0) / sum.dot(sum).max(F::splat(1e-12)).sqrt())
}
