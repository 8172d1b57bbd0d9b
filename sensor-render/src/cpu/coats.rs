use glam::Vec3;

use super::grain::noise;
use crate::coat::Coat;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::light::Light;
use crate::{Scene, World};

/// The coats of sixteen points, and where the points lie on their surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coats<F: Float> {
    pub(crate) albedo: V3<F>,
    pub(crate) shine: F,
    pub(crate) glow: V3<F>,
    pub(crate) rough: F,
    pub(crate) wrap: F,
    pub(crate) pattern: F::Word,
    pub(crate) grain: [F; 4],
    pub(crate) wall: [F; 4],
    pub(crate) seed: F::Word,
    /// Metres along the surface and up it, and over the ground.
    pub(crate) along: F,
    pub(crate) up: F,
    pub(crate) height: F,
}

impl<F: Float> Coats<F> {
    /// Looks up the coats of what was hit, once for each triangle.
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
        let mut coats = Coats {
            albedo: black,
            shine: zero,
            glow: black,
            rough: F::splat(1.0),
            wrap: zero,
            pattern: F::Word::splat(0),
            grain: [zero; 4],
            wall: [zero; 4],
            seed: F::Word::splat(0),
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
            let coat = Coat::new(scene, world, light, index, of);
            coats.albedo = V3::splat(coat.albedo).or(same, coats.albedo);
            coats.glow = V3::splat(coat.glow).or(same, coats.glow);
            coats.shine = F::splat(coat.shine).or(same, coats.shine);
            coats.rough = F::splat(coat.rough).or(same, coats.rough);
            coats.wrap = F::splat(coat.wrap).or(same, coats.wrap);
            coats.pattern = F::Word::splat(coat.pattern).or(same, coats.pattern);
            coats.seed = F::Word::splat(coat.seed).or(same, coats.seed);
            coats.along = at.dot(V3::splat(coat.along)).or(same, coats.along);
            coats.up = at.dot(V3::splat(coat.up)).or(same, coats.up);
            for number in 0..4 {
                coats.grain[number] = F::splat(coat.grain[number]).or(same, coats.grain[number]);
                coats.wall[number] = F::splat(coat.wall[number]).or(same, coats.wall[number]);
            }
        }
        coats
    }

    /// Makes the albedo grainy where a pixel, `pixel` metres wide on the surface, can show it.
    #[inline(always)]
    pub(crate) fn roughen(&mut self, pixel: F) {
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
