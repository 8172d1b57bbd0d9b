//! Ambient occlusion: what keeps the light of one direction of the sky from sixteen neighbouring points.
//! Twin of `sky_share` in shade.wgsl.
//!
//! Zhukov, Iones, Kronin 1998, *An Ambient Light Illumination Model*: the nearer an obstacle, the more
//! light it keeps away. Rays of one direction are a packet, as shadow rays are.

use super::beam::Slab;
use super::shadow::Shadow;
use super::shortlist::Shortlists;
use super::traversal::{Stack, Visitor, walk_in_any_order};
use crate::hit::Hit;
use crate::light::OCCLUSION_REACH_M;
use crate::scene::Scene;
use crate::simd::{Float, Mask};
use crate::world::World;

/// Extent of the origins up to which rays are traversed as one beam. Metres.
pub(super) const SPREAD_MAX: f32 = 6.0;

impl<F: Float> Shadow<F> {
    /// Returns the distance of the first obstacle along each active ray, at most [`OCCLUSION_REACH_M`].
    #[inline(always)]
    pub(crate) fn nearest(
        &self,
        scene: &Scene,
        world: &World,
        near: Option<&Shortlists>,
        stack: &mut Stack,
    ) -> F {
        if self.spread() <= SPREAD_MAX {
            return self.nearest_together(scene, world, near, stack);
        }
        let mut nearest = F::splat(OCCLUSION_REACH_M);
        let mut left = self.active;
        while left.any() {
            let part = self.near_first(left, SPREAD_MAX * 0.5);
            left = left & !part.active;
            let of_part = match part.lone(scene.reach) {
                Some((_, ray)) => {
                    let mut hit = Hit::none(OCCLUSION_REACH_M);
                    ray.closest::<F::Float8>(scene, world, stack, &mut hit);
                    F::splat(hit.t)
                }
                None => part.nearest_together(scene, world, near, stack),
            };
            nearest = of_part.or(part.active, nearest);
        }
        nearest
    }

    /// Traverses all rays as one beam.
    #[inline(always)]
    fn nearest_together(
        &self,
        scene: &Scene,
        world: &World,
        near: Option<&Shortlists>,
        stack: &mut Stack,
    ) -> F {
        let mut nearest = F::splat(OCCLUSION_REACH_M);
        let slab = self.slab(scene.reach);
        let mut town = TriangleVisitor { scene, rays: self, nearest: &mut nearest };
        let root = scene.town_blas.wide_root;
        match near {
            Some(near) => near.town.walk::<F::Float8, _, _>(&scene.wide, &slab, stack, &mut town),
            None => {
                _ = walk_in_any_order::<F::Float8, _, _>(&scene.wide, root, &slab, stack, &mut town)
            }
        }
        if let Some(root) = world.wide_root {
            let mut actors = InstanceVisitor { scene, world, rays: self, nearest: &mut nearest };
            match near {
                Some(near) => {
                    near.world.walk::<F::Float8, _, _>(&world.wide, &slab, stack, &mut actors)
                }
                None => {
                    _ = walk_in_any_order::<F::Float8, _, _>(
                        &world.wide,
                        root,
                        &slab,
                        stack,
                        &mut actors,
                    )
                }
            }
        }
        nearest
    }

    /// Returns the volume up to [`OCCLUSION_REACH_M`] from the origins.
    #[inline(always)]
    fn slab(&self, reach: f32) -> Slab {
        let beam = self.beam(reach);
        Slab::new(beam, &self.origins, self.active, self.direction, OCCLUSION_REACH_M, reach)
    }
}

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a, F: Float> {
    scene: &'a Scene,
    rays: &'a Shadow<F>,
    nearest: &'a mut F,
}

impl<F: Float> Visitor for TriangleVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        for triangle in &self.scene.triangles[first as usize..(first + count) as usize] {
            let (met, t) = self.rays.meet(triangle);
            *self.nearest = t.or(met & t.lt(*self.nearest), *self.nearest);
        }
        0.0
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float> {
    scene: &'a Scene,
    world: &'a World,
    rays: &'a Shadow<F>,
    nearest: &'a mut F,
}

impl<F: Float> Visitor for InstanceVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = self.scene.blases[instance.blas as usize].wide_root;
            let rays = self.rays.to_instance_space(instance);
            let slab = rays.slab(self.scene.reach);
            let mut triangles =
                TriangleVisitor { scene: self.scene, rays: &rays, nearest: self.nearest };
            let nodes = &self.scene.wide;
            walk_in_any_order::<F::Float8, _, _>(nodes, root, &slab, stack, &mut triangles);
        }
        0.0
    }
}
