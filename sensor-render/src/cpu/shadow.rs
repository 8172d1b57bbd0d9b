use glam::Vec3;

use super::beam::Beam;
use super::shortlist::Shortlists;
use super::single_ray::SingleRay;
use super::traversal::{Stack, Visitor, walk_in_any_order};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::simd::{Float, LANES, Mask, V3};
use crate::triangle::Triangle;
use crate::world::World;

/// Extent of the origins up to which shadow rays are traversed as one beam. Metres.
pub(super) const SPREAD_MAX: f32 = 2.0;

/// Sixteen parallel shadow rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadow<F: Float> {
    /// Direction to the light, of unit length.
    pub(crate) direction: Vec3,
    pub(crate) origins: V3<F>,
    /// Rays that are traced.
    pub(crate) active: F::Mask,
}

impl<F: Float> Shadow<F> {
    /// Returns the rays that hit anything.
    #[inline(always)]
    pub(crate) fn blocked(
        &self,
        scene: &Scene,
        world: &World,
        near: Option<&Shortlists>,
        stack: &mut Stack,
    ) -> F::Mask {
        if self.spread() <= SPREAD_MAX {
            return self.blocked_together(scene, world, near, stack);
        }
        let mut blocked = F::Mask::from_bits(0);
        let mut left = self.active;
        while left.any() {
            let part = self.near_first(left, SPREAD_MAX * 0.5);
            left = left & !part.active;
            blocked = blocked
                | match part.lone(scene.reach) {
                    Some((lane, ray)) => {
                        let is_blocked =
                            ray.is_blocked::<F::Float8>(scene, world, stack, f32::INFINITY);
                        F::Mask::from_bits(u16::from(is_blocked) << lane)
                    }
                    None => part.blocked_together(scene, world, near, stack),
                };
        }
        blocked
    }

    /// Traverses all rays as one beam.
    #[inline(always)]
    fn blocked_together(
        &self,
        scene: &Scene,
        world: &World,
        near: Option<&Shortlists>,
        stack: &mut Stack,
    ) -> F::Mask {
        let mut open = self.active;
        let beam = self.beam(scene.reach);
        let mut town = TriangleVisitor { scene, shadow: self, open: &mut open };
        let root = scene.town_blas.wide_root;
        match near {
            Some(near) => near.town.walk::<F::Float8, _, _>(&scene.wide, &beam, stack, &mut town),
            None => {
                _ = walk_in_any_order::<F::Float8, _, _>(&scene.wide, root, &beam, stack, &mut town)
            }
        }
        if let Some(root) = world.wide_root
            && open.any()
        {
            let mut actors = InstanceVisitor { scene, world, shadow: self, open: &mut open };
            match near {
                Some(near) => {
                    near.world.walk::<F::Float8, _, _>(&world.wide, &beam, stack, &mut actors)
                }
                None => {
                    _ = walk_in_any_order::<F::Float8, _, _>(
                        &world.wide,
                        root,
                        &beam,
                        stack,
                        &mut actors,
                    )
                }
            }
        }
        self.active & !open
    }

    /// Returns the rays of `left` whose origins are within `near` metres of that of the first of them, along
    /// each axis.
    #[inline(always)]
    pub(super) fn near_first(&self, left: F::Mask, near: f32) -> Self {
        let lane = left.bits().trailing_zeros() as usize % LANES;
        let apart = self.origins - V3::splat(self.origin(lane));
        let most = apart.x.abs().max(apart.y.abs()).max(apart.z.abs());
        let close = left & F::splat(near).ge(most);
        // The first itself, whatever its coordinates are.
        Shadow { active: close | F::Mask::from_bits(1 << lane), ..*self }
    }

    /// Returns the only active ray and its lane; `None` if there are several.
    #[inline(always)]
    pub(super) fn lone(&self, reach: f32) -> Option<(usize, SingleRay)> {
        let bits = self.active.bits();
        if bits & bits.wrapping_sub(1) != 0 {
            return None;
        }
        let lane = bits.trailing_zeros() as usize % LANES;
        Some((lane, SingleRay::new(self.origin(lane), self.direction, reach)))
    }

    #[inline(always)]
    fn origin(&self, lane: usize) -> Vec3 {
        let V3 { x, y, z } = self.origins;
        let (x, y, z) = (x.to_array(), y.to_array(), z.to_array());
        Vec3::new(x[lane], y[lane], z[lane])
    }

    /// Returns the longest side of the bounding box of the origins. Metres.
    #[inline(always)]
    pub(super) fn spread(&self) -> f32 {
        let mut most = 0.0f32;
        for value in [self.origins.x, self.origins.y, self.origins.z] {
            let low = value.or(self.active, F::splat(f32::INFINITY)).smallest();
            let high = value.or(self.active, F::splat(f32::NEG_INFINITY)).largest();
            most = most.max(high - low);
        }
        most
    }

    #[inline(always)]
    pub(super) fn beam(&self, reach: f32) -> Beam {
        Beam::parallel(&[self.origins], &[self.active], self.direction, reach)
    }

    /// Returns the rays in the space of an instance.
    #[inline(always)]
    pub(super) fn to_instance_space(self, instance: &Instance) -> Self {
        let [x, y, z] = instance.actor_from_world;
        let Shadow { direction, origins, active } = self;
        Shadow {
            direction: Vec3::new(turned(x, direction), turned(y, direction), turned(z, direction)),
            origins: V3 { x: moved(x, origins), y: moved(y, origins), z: moved(z, origins) },
            active,
        }
    }

    /// Returns the rays that a triangle lies ahead of, and the ray parameters: Möller and Trumbore 1997,
    /// rearranged for rays of one direction, since everything but three dot products depends on the triangle
    /// alone.
    #[inline(always)]
    pub(super) fn meet(&self, triangle: &Triangle) -> (F::Mask, F) {
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let direction = self.direction;
        let across = direction.cross(edge2);
        let inverse = 1.0 / edge1.dot(across);
        let for_u = V3::<F>::splat(across * inverse);
        let for_v = V3::<F>::splat(edge1.cross(direction) * inverse);
        let for_t = V3::<F>::splat(edge1.cross(edge2) * inverse);
        let from_corner = self.origins - V3::splat(corner);
        let u = from_corner.dot(for_u);
        let v = from_corner.dot(for_v);
        let t = from_corner.dot(for_t);
        let least = u.min(v).min(F::splat(1.0) - u - v);
        (least.min(t).ge(F::splat(0.0)), t)
    }
}

/// Returns a coordinate of a direction in the space of an instance.
#[inline(always)]
fn turned(row: [f32; 4], direction: Vec3) -> f32 {
    Vec3::new(row[0], row[1], row[2]).dot(direction)
}

/// Returns a coordinate of points in the space of an instance.
#[inline(always)]
fn moved<F: Float>(row: [f32; 4], points: V3<F>) -> F {
    let sum = points.x.mul_add(F::splat(row[0]), F::splat(row[3]));
    let sum = points.y.mul_add(F::splat(row[1]), sum);
    points.z.mul_add(F::splat(row[2]), sum)
}

/// Returns the limit of a traversal, which goes on while any ray is unblocked.
#[inline(always)]
fn limit<F: Float>(open: F::Mask) -> f32 {
    if open.any() { 0.0 } else { f32::NEG_INFINITY }
}

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a, F: Float> {
    scene: &'a Scene,
    shadow: &'a Shadow<F>,
    /// Rays that have not hit anything.
    open: &'a mut F::Mask,
}

impl<F: Float> Visitor for TriangleVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        for triangle in &self.scene.triangles[first as usize..(first + count) as usize] {
            let (met, _) = self.shadow.meet(triangle);
            *self.open = *self.open & !met;
        }
        limit::<F>(*self.open)
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float> {
    scene: &'a Scene,
    world: &'a World,
    shadow: &'a Shadow<F>,
    open: &'a mut F::Mask,
}

impl<F: Float> Visitor for InstanceVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            if !self.open.any() {
                break;
            }
            let instance = &self.world.instances[index as usize];
            let root = self.scene.blases[instance.blas as usize].wide_root;
            let shadow = Shadow { active: *self.open, ..self.shadow.to_instance_space(instance) };
            let beam = shadow.beam(self.scene.reach);
            let mut triangles =
                TriangleVisitor { scene: self.scene, shadow: &shadow, open: self.open };
            let nodes = &self.scene.wide;
            walk_in_any_order::<F::Float8, _, _>(nodes, root, &beam, stack, &mut triangles);
        }
        limit::<F>(*self.open)
    }
}
