//! Ambient occlusion: what keeps the light of one direction of the sky from sixteen neighbouring points.
//! Twin of `sky_share` in shade.wgsl.
//!
//! Zhukov, Iones, Kronin 1998, *An Ambient Light Illumination Model*: the nearer an obstacle, the more
//! light it keeps away. Rays of one direction are a packet, as shadow rays are.

use super::shadow::{Shadow, ShadowSheaf};
use super::shortlist::Shortlists;
use super::traversal::{Stack, Visitor, walk_in_any_order};
use crate::light::OCCLUSION_REACH_M;
use crate::scene::Scene;
use crate::simd::Float;
use crate::world::World;

/// Extent of the points of a block up to which what is around them is searched once. Metres.
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
        let mut nearest = F::splat(OCCLUSION_REACH_M);
        let sheaf = self.sheaf(nearest, scene.reach);
        let mut town = TriangleVisitor { scene, rays: self, sheaf: &sheaf, nearest: &mut nearest };
        let root = scene.town_blas.wide_root;
        match near {
            Some(near) => near.town.walk::<F::Float8, _, _>(&scene.wide, &sheaf, stack, &mut town),
            None => {
                _ = walk_in_any_order::<F::Float8, _, _>(
                    &scene.wide,
                    root,
                    &sheaf,
                    stack,
                    &mut town,
                )
            }
        }
        if let Some(root) = world.wide_root {
            let mut actors =
                InstanceVisitor { scene, world, rays: self, sheaf: &sheaf, nearest: &mut nearest };
            match near {
                Some(near) => {
                    near.world.walk::<F::Float8, _, _>(&world.wide, &sheaf, stack, &mut actors)
                }
                None => {
                    _ = walk_in_any_order::<F::Float8, _, _>(
                        &world.wide,
                        root,
                        &sheaf,
                        stack,
                        &mut actors,
                    )
                }
            }
        }
        nearest
    }
}

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a, F: Float> {
    scene: &'a Scene,
    rays: &'a Shadow<F>,
    sheaf: &'a ShadowSheaf<F>,
    nearest: &'a mut F,
}

impl<F: Float> Visitor for TriangleVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        for triangle in &self.scene.triangles[first as usize..(first + count) as usize] {
            let (met, t) = self.rays.meet(triangle);
            *self.nearest = t.or(met & t.lt(*self.nearest), *self.nearest);
        }
        self.sheaf.shorten(self.rays.active, *self.nearest);
        0.0
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float> {
    scene: &'a Scene,
    world: &'a World,
    rays: &'a Shadow<F>,
    sheaf: &'a ShadowSheaf<F>,
    nearest: &'a mut F,
}

impl<F: Float> Visitor for InstanceVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = self.scene.blases[instance.blas as usize].wide_root;
            let rays = self.rays.to_instance_space(instance);
            let sheaf = rays.sheaf(*self.nearest, self.scene.reach);
            let mut triangles = TriangleVisitor {
                scene: self.scene,
                rays: &rays,
                sheaf: &sheaf,
                nearest: self.nearest,
            };
            let nodes = &self.scene.wide;
            walk_in_any_order::<F::Float8, _, _>(nodes, root, &sheaf, stack, &mut triangles);
        }
        self.sheaf.shorten(self.rays.active, *self.nearest);
        0.0
    }
}
