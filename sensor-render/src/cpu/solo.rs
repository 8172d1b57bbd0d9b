//! One ray alone, against eight boxes at once: for rays that have too little in common with their
//! neighbours to travel as a beam.

use std::marker::PhantomData;

use glam::Vec3;

use super::walk::{Probe, Stack, Visitor, walk};
use crate::hit::{EDGE_SLACK, Hit, NONE, T_MIN};
use crate::simd::Float8;
use crate::scene::Triangle;
use crate::wide::WideNode;
use crate::world::Instance;
use crate::{Scene, World};

/// What rounding may move the side of a box by, as a share of the largest coordinate.
const ROUNDING: f32 = 3e-7;

/// A half-line; its parameter counts lengths of `direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Solo {
    origin: Vec3,
    direction: Vec3,
    /// `side * inverse + near` is where the ray enters between two sides, `+ far` where it leaves.
    inverse: Vec3,
    near: Vec3,
    far: Vec3,
    /// Rows of a node's bounds that the ray meets first.
    rows: [usize; 3],
    reach: f32,
}

impl Solo {
    /// No coordinate in this space is larger than `reach`.
    #[inline(always)]
    pub(crate) fn new(origin: Vec3, direction: Vec3, reach: f32) -> Solo {
        let inverse = Vec3::from(
            direction
                .to_array()
                .map(|d| 1.0 / if d.abs() < 1e-12 { 1e-12f32.copysign(d) } else { d }),
        );
        let (shift, slack) = (-origin * inverse, inverse.abs() * (ROUNDING * reach));
        let first = |axis: usize| 2 * axis + usize::from(inverse[axis] < 0.0);
        Solo {
            origin,
            direction,
            inverse,
            near: shift - slack,
            far: shift + slack,
            rows: [first(0), first(1), first(2)],
            reach,
        }
    }

    /// Lowers `hit` to the first thing that the ray meets before it.
    #[inline(always)]
    pub(crate) fn closest<E: Float8>(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        hit: &mut Hit,
    ) {
        let mut town = Level { scene, ray: self, instance: NONE, hit, any: false };
        walk::<E, _, _>(&scene.wide, scene.ground.wide_root, self, town.hit.t, stack, &mut town);
        if let Some(root) = world.wide_root {
            let limit = hit.t;
            let mut actors =
                Actors::<E> { scene, world, ray: self, hit, any: false, lanes: PhantomData };
            walk::<E, _, _>(&world.wide, root, self, limit, stack, &mut actors);
        }
    }

    /// Whether the ray meets anything before `t_max`.
    #[inline(always)]
    pub(crate) fn is_blocked<E: Float8>(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        t_max: f32,
    ) -> bool {
        let mut hit = Hit::none(t_max);
        let mut town = Level { scene, ray: self, instance: NONE, hit: &mut hit, any: true };
        walk::<E, _, _>(&scene.wide, scene.ground.wide_root, self, t_max, stack, &mut town);
        if let Some(root) = world.wide_root
            && !hit.is_some()
        {
            let mut actors = Actors::<E> {
                scene,
                world,
                ray: self,
                hit: &mut hit,
                any: true,
                lanes: PhantomData,
            };
            walk::<E, _, _>(&world.wide, root, self, t_max, stack, &mut actors);
        }
        hit.is_some()
    }

    /// The same ray in the actor's space; its parameter stays.
    #[inline(always)]
    fn seen_from(&self, instance: &Instance) -> Solo {
        let rows = instance.actor_from_world;
        let turn = |row: [f32; 4], v: Vec3| row[0] * v.x + row[1] * v.y + row[2] * v.z;
        Solo::new(
            Vec3::from(rows.map(|row| turn(row, self.origin) + row[3])),
            Vec3::from(rows.map(|row| turn(row, self.direction))),
            self.reach,
        )
    }
}

impl Probe for Solo {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, limit: f32) -> (u32, [f32; 8]) {
        let row = |row: usize| E::load(&node.bounds[row & 7]);
        let mut near = E::splat(0.0);
        let mut far = E::splat(limit);
        for axis in 0..3 {
            let inverse = E::splat(self.inverse[axis]);
            let first = self.rows[axis];
            near = near.max(row(first).mul_add(inverse, E::splat(self.near[axis])));
            far = far.min(row(first ^ 1).mul_add(inverse, E::splat(self.far[axis])));
        }
        (far.ge(near), near.to_array())
    }
}

/// Visits the triangles of one bottom level.
struct Level<'a> {
    scene: &'a Scene,
    ray: &'a Solo,
    instance: u32,
    hit: &'a mut Hit,
    /// Whether the first hit that is found will do.
    any: bool,
}

impl Visitor for Level<'_> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            self.meet(&self.scene.triangles[index as usize], index);
        }
        limit(self.any, self.hit)
    }
}

#[inline(always)]
fn limit(any: bool, hit: &Hit) -> f32 {
    if any && hit.is_some() { f32::NEG_INFINITY } else { hit.t }
}

impl Level<'_> {
    /// Möller and Trumbore 1997, in the terms of [`super::pencil`].
    #[inline(always)]
    fn meet(&mut self, triangle: &Triangle, index: u32) {
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let direction = self.ray.direction;
        let from_corner = self.ray.origin - corner;
        let across = direction.cross(edge2);
        let along = from_corner.cross(edge1);
        let det = edge1.dot(across);
        let side = if det < 0.0 { -1.0 } else { 1.0 };
        let det = det * side;
        let u = from_corner.dot(across) * side;
        let v = direction.dot(along) * side;
        let t = edge2.dot(along) * side;
        let inside = u.min(v).min(det - u - v) >= -EDGE_SLACK * det;
        if inside && t > T_MIN * det && t < self.hit.t * det {
            *self.hit = Hit { t: t / det, triangle: index, instance: self.instance, ..*self.hit };
        }
    }
}

/// Visits the actors of the top level.
struct Actors<'a, E> {
    scene: &'a Scene,
    world: &'a World,
    ray: &'a Solo,
    hit: &'a mut Hit,
    any: bool,
    lanes: PhantomData<E>,
}

impl<E: Float8> Visitor for Actors<'_, E> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = self.scene.levels[instance.level as usize].wide_root;
            let ray = self.ray.seen_from(instance);
            let (any, limit) = (self.any, self.hit.t);
            let mut level =
                Level { scene: self.scene, ray: &ray, instance: index, hit: self.hit, any };
            walk::<E, _, _>(&self.scene.wide, root, &ray, limit, stack, &mut level);
            if self.any && self.hit.is_some() {
                break;
            }
        }
        limit(self.any, self.hit)
    }
}
