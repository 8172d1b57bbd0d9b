use std::cell::Cell;

use glam::Vec3;

use super::shortlist::Shortlists;
use super::slabs::Slabs;
use super::traversal::{Probe, Stack, Visitor, walk_in_any_order};
use crate::hit::{EDGE_SLACK, T_MIN};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::simd::{Float, Float8, Mask, V3};
use crate::triangle::Triangle;
use crate::wide::WideNode;
use crate::world::World;

/// Extent of the points of a block up to which what lies between them and the sun is searched once. Metres.
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
        let mut open = self.active;
        let sheaf = self.sheaf(F::splat(f32::INFINITY), scene.reach);
        let mut town = TriangleVisitor { scene, shadow: self, sheaf: &sheaf, open: &mut open };
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
        if let Some(root) = world.wide_root
            && open.any()
        {
            let mut actors =
                InstanceVisitor { scene, world, shadow: self, sheaf: &sheaf, open: &mut open };
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
        self.active & !open
    }

    /// Returns the active rays up to the distance `end`, prepared for boxes.
    #[inline(always)]
    pub(super) fn sheaf(&self, end: F, reach: f32) -> ShadowSheaf<F> {
        let directions = V3::splat(self.direction);
        let slabs = Slabs::new(self.origins, directions, self.active, reach);
        let sheaf = ShadowSheaf { slabs, end: Cell::new(end) };
        sheaf.shorten(self.active, end);
        sheaf
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
        (least.ge(F::splat(-EDGE_SLACK)) & F::splat(T_MIN).lt(t), t)
    }
}

/// Parallel rays prepared for boxes.
pub(super) struct ShadowSheaf<F: Float> {
    slabs: Slabs<F>,
    /// Distance at which each ray ends, minus infinity if it need not be traced further.
    end: Cell<F>,
}

impl<F: Float> ShadowSheaf<F> {
    /// Sets the distance `end` at which the rays of `open` end, and that the others need not be traced further.
    #[inline(always)]
    pub(super) fn shorten(&self, open: F::Mask, end: F) {
        self.end.set(end.or(open, F::splat(f32::NEG_INFINITY)));
    }
}

impl<F: Float> Probe for ShadowSheaf<F> {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, _: f32) -> (u32, [f32; 8]) {
        (self.slabs.meet(node, self.end.get()), [0.0; 8])
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
    sheaf: &'a ShadowSheaf<F>,
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
        self.sheaf.shorten(*self.open, F::splat(f32::INFINITY));
        limit::<F>(*self.open)
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float> {
    scene: &'a Scene,
    world: &'a World,
    shadow: &'a Shadow<F>,
    sheaf: &'a ShadowSheaf<F>,
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
            let sheaf = shadow.sheaf(F::splat(f32::INFINITY), self.scene.reach);
            let mut triangles = TriangleVisitor {
                scene: self.scene,
                shadow: &shadow,
                sheaf: &sheaf,
                open: self.open,
            };
            let nodes = &self.scene.wide;
            walk_in_any_order::<F::Float8, _, _>(nodes, root, &sheaf, stack, &mut triangles);
        }
        self.sheaf.shorten(*self.open, F::splat(f32::INFINITY));
        limit::<F>(*self.open)
    }
}
