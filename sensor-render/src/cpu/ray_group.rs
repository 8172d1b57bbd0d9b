//! Sixteen rays with origins and directions of their own, traversed together: of lidars, of coarse images, of
//! cameras with effects, from lamps, and of reflections.

use std::cell::Cell;

use glam::Vec3;

use super::slabs::Slabs;
use super::traversal::{Probe, Stack, Visitor, walk};
use crate::hit::{EDGE_SLACK, NONE, T_MIN};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::simd::{Float, Float8, Mask, V3, Word};
use crate::triangle::Triangle;
use crate::wide::WideNode;
use crate::world::World;

/// Bound on the rounding error of a distance along the axis, as a share of the largest coordinate.
const ROUNDING: f32 = 6e-7;

/// Sixteen rays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayGroup<F: Float> {
    pub(crate) origins: V3<F>,
    pub(crate) directions: V3<F>,
    /// Rays that are traced.
    pub(crate) active: F::Mask,
}

/// First intersection of each active ray; see [`crate::hit::Hit`]. The distances of others are minus infinity.
#[derive(Clone, Debug)]
pub(crate) struct GroupHits<F: Float> {
    pub(crate) t: F,
    pub(crate) triangle: F::Word,
    pub(crate) instance: F::Word,
}

impl<F: Float> RayGroup<F> {
    /// Returns the first intersection of each active ray before `t_max`.
    #[inline(always)]
    pub(crate) fn closest(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        t_max: f32,
    ) -> GroupHits<F> {
        let none = F::Word::splat(NONE);
        let t = F::splat(t_max).or(self.active, F::splat(f32::NEG_INFINITY));
        let mut hits = GroupHits { t, triangle: none, instance: none };
        let sheaf = Sheaf::new(self, self.axis(), t, scene.reach);
        let root = scene.town_blas.wide_root;
        let mut town = TriangleVisitor::new(scene, self, &sheaf, NONE, &mut hits);
        walk::<F::Float8, _, _>(&scene.wide, root, &sheaf, t_max, stack, &mut town);
        if let Some(root) = world.wide_root {
            let limit = hits.t.largest();
            let mut actors =
                InstanceVisitor { scene, world, rays: self, sheaf: &sheaf, hits: &mut hits };
            walk::<F::Float8, _, _>(&world.wide, root, &sheaf, limit, stack, &mut actors);
        }
        hits
    }

    /// Returns an axis with `axis · direction <= 1` for each active ray.
    #[inline(always)]
    fn axis(&self) -> Vec3 {
        let traced = self.directions.or(self.active, V3::splat(Vec3::ZERO));
        let (x, y, z) = (traced.x.to_array(), traced.y.to_array(), traced.z.to_array());
        let sum = Vec3::new(x.iter().sum(), y.iter().sum(), z.iter().sum());
        let along = traced.dot(V3::splat(sum)).largest();
        // Rays in all directions have none: nothing is ordered.
        if along > 1e-3 { sum / (along * 1.000_001) } else { Vec3::ZERO }
    }

    /// Returns the rays in the space of an instance, with the same parameters.
    #[inline(always)]
    fn to_instance_space(self, instance: &Instance) -> Self {
        let [x, y, z] = instance.actor_from_world;
        let RayGroup { origins: o, directions: d, active } = self;
        RayGroup {
            origins: V3 { x: moved(x, o), y: moved(y, o), z: moved(z, o) },
            directions: V3 { x: turned(x, d), y: turned(y, d), z: turned(z, d) },
            active,
        }
    }
}

/// Returns a coordinate of directions in the space of an instance.
#[inline(always)]
fn turned<F: Float>(row: [f32; 4], directions: V3<F>) -> F {
    dot(V3::splat(Vec3::new(row[0], row[1], row[2])), directions)
}

/// Returns a dot product that rounds each step, as the shaders' does, so that the tracers agree at the edges of
/// triangles.
#[inline(always)]
fn dot<F: Float>(a: V3<F>, b: V3<F>) -> F {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// Returns a coordinate of points in the space of an instance.
#[inline(always)]
fn moved<F: Float>(row: [f32; 4], points: V3<F>) -> F {
    turned(row, points) + F::splat(row[3])
}

/// Rays prepared for boxes.
struct Sheaf<F: Float> {
    slabs: Slabs<F>,
    /// Axis along which the near side of a box is measured, from the origin farthest along it.
    axis: Vec3,
    axis_rows: [usize; 3],
    axis_offset: f32,
    /// Distance at which each ray ends. Visitors shorten it.
    end: Cell<F>,
}

impl<F: Float> Sheaf<F> {
    #[inline(always)]
    fn new(rays: &RayGroup<F>, axis: Vec3, end: F, reach: f32) -> Self {
        let along = rays.origins.dot(V3::splat(axis));
        let farthest = along.or(rays.active, F::splat(f32::NEG_INFINITY)).largest();
        Sheaf {
            slabs: Slabs::new(rays.origins, rays.directions, rays.active, reach),
            axis,
            axis_rows: [0, 1, 2].map(|i| 2 * i + usize::from(axis[i] < 0.0)),
            axis_offset: -farthest - ROUNDING * reach * axis.abs().element_sum(),
            end: Cell::new(end),
        }
    }
}

impl<F: Float> Probe for Sheaf<F> {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, _: f32) -> (u32, [f32; 8]) {
        let row = |axis: usize| E::load(node.row(self.axis_rows[axis]));
        let [x, y, z] = self.axis.to_array();
        let near = row(0).mul_add(E::splat(x), E::splat(self.axis_offset));
        let near = row(1).mul_add(E::splat(y), near);
        let near = row(2).mul_add(E::splat(z), near);
        (self.slabs.meet(node, self.end.get()), near.to_array())
    }
}

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a, F: Float> {
    scene: &'a Scene,
    rays: &'a RayGroup<F>,
    sheaf: &'a Sheaf<F>,
    instance: u32,
    hits: &'a mut GroupHits<F>,
    /// Largest distance of a hit.
    limit: f32,
}

impl<'a, F: Float> TriangleVisitor<'a, F> {
    #[inline(always)]
    fn new(
        scene: &'a Scene,
        rays: &'a RayGroup<F>,
        sheaf: &'a Sheaf<F>,
        instance: u32,
        hits: &'a mut GroupHits<F>,
    ) -> Self {
        let limit = hits.t.largest();
        TriangleVisitor { scene, rays, sheaf, instance, hits, limit }
    }

    /// Möller and Trumbore 1997, with the signs of [`super::ray_packet`]. Returns whether any ray hits the triangle.
    #[inline(always)]
    fn meet(&mut self, triangle: &Triangle, index: u32) -> bool {
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let (edge1, edge2) = (V3::<F>::splat(edge1), V3::<F>::splat(edge2));
        let from_corner = self.rays.origins - V3::splat(corner);
        let direction = self.rays.directions;
        let across = direction.cross(edge2);
        let along = from_corner.cross(edge1);
        let det = dot(edge1, across);
        let side = F::splat(-1.0).or(det.lt(F::splat(0.0)), F::splat(1.0));
        let det = det * side;
        let u = dot(from_corner, across) * side;
        let v = dot(direction, along) * side;
        let t = dot(edge2, along) * side;
        let inside = u.min(v).min(det - u - v).ge(det * F::splat(-EDGE_SLACK));
        let nearer = t.lt(self.hits.t * det);
        let met = inside & nearer & (det * F::splat(T_MIN)).lt(t);
        if !met.any() {
            return false;
        }
        let hits = &mut *self.hits;
        hits.t = (t / det).or(met, hits.t);
        hits.triangle = F::Word::splat(index).or(met, hits.triangle);
        hits.instance = F::Word::splat(self.instance).or(met, hits.instance);
        true
    }
}

impl<F: Float> Visitor for TriangleVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        let mut is_nearer = false;
        for index in first..first + count {
            let triangle = &self.scene.triangles[index as usize];
            is_nearer |= self.meet(triangle, index);
        }
        if is_nearer {
            self.sheaf.end.set(self.hits.t);
            self.limit = self.hits.t.largest();
        }
        self.limit
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float> {
    scene: &'a Scene,
    world: &'a World,
    rays: &'a RayGroup<F>,
    sheaf: &'a Sheaf<F>,
    hits: &'a mut GroupHits<F>,
}

impl<F: Float> Visitor for InstanceVisitor<'_, F> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        let scene = self.scene;
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = scene.blases[instance.blas as usize].wide_root;
            let rays = self.rays.to_instance_space(instance);
            let [x, y, z] = instance.actor_from_world.map(|row| Vec3::new(row[0], row[1], row[2]));
            let axis = self.sheaf.axis;
            // Along the axis, distances in a larger piece are as many times shorter as the directions.
            let axis = Vec3::new(x.dot(axis), y.dot(axis), z.dot(axis)) * instance.size_squared;
            let sheaf = Sheaf::new(&rays, axis, self.hits.t, scene.reach);
            let mut triangles = TriangleVisitor::new(scene, &rays, &sheaf, index, self.hits);
            let limit = triangles.limit;
            walk::<F::Float8, _, _>(&scene.wide, root, &sheaf, limit, stack, &mut triangles);
        }
        self.sheaf.end.set(self.hits.t);
        self.hits.t.largest()
    }
}
