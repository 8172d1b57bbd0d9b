//! Single ray, tested against eight boxes at once; for rays that diverge too much to be traversed
//! as one beam.

use std::marker::PhantomData;

use glam::{Mat4, Vec3, Vec4};

use super::traversal::{Probe, Stack, Visitor, walk};
use crate::hit::{EDGE_SLACK, Hit, NONE, T_MIN};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::simd::Float8;
use crate::triangle::Triangle;
use crate::wide::WideNode;
use crate::world::World;

/// Bound on the rounding error of the side of a box, as a share of the largest coordinate.
const ROUNDING: f32 = 3e-7;

/// Ray; its parameter counts lengths of `direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SingleRay {
    origin: Vec3,
    direction: Vec3,
    /// `side * inverse + near` is the parameter at which the ray enters between two sides, `side *
    /// inverse + far` the one at which it leaves.
    inverse: Vec3,
    near: Vec3,
    far: Vec3,
    /// Rows of a node's bounds that the ray reaches first, by axis.
    rows: [usize; 3],
    reach: f32,
}

impl SingleRay {
    /// Returns a ray. `reach` is the largest coordinate in this space.
    #[inline(always)]
    pub(crate) fn new(origin: Vec3, direction: Vec3, reach: f32) -> SingleRay {
        let inverse = Vec3::from(
            direction
                .to_array()
                .map(|d| 1.0 / if d.abs() < 1e-12 { 1e-12f32.copysign(d) } else { d }),
        );
        let (shift, slack) = (-origin * inverse, inverse.abs() * (ROUNDING * reach));
        let first = |axis: usize| 2 * axis + usize::from(inverse[axis] < 0.0);
        SingleRay {
            origin,
            direction,
            inverse,
            near: shift - slack,
            far: shift + slack,
            rows: [first(0), first(1), first(2)],
            reach,
        }
    }

    /// Replaces `hit` by the first intersection before it, if there is one.
    #[inline(always)]
    pub(crate) fn closest<E: Float8>(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        hit: &mut Hit,
    ) {
        let mut town = TriangleVisitor { scene, ray: self, instance: NONE, hit, any: false };
        walk::<E, _, _>(&scene.wide, scene.town_blas.wide_root, self, town.hit.t, stack, &mut town);
        if let Some(root) = world.wide_root {
            let limit = hit.t;
            let mut actors = InstanceVisitor::<E> {
                scene,
                world,
                ray: self,
                hit,
                any: false,
                lanes: PhantomData,
            };
            walk::<E, _, _>(&world.wide, root, self, limit, stack, &mut actors);
        }
    }

    /// Returns whether the ray hits anything before `t_max`.
    #[inline(always)]
    pub(crate) fn is_blocked<E: Float8>(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        t_max: f32,
    ) -> bool {
        let mut hit = Hit::none(t_max);
        let mut town =
            TriangleVisitor { scene, ray: self, instance: NONE, hit: &mut hit, any: true };
        walk::<E, _, _>(&scene.wide, scene.town_blas.wide_root, self, t_max, stack, &mut town);
        if let Some(root) = world.wide_root
            && !hit.is_some()
        {
            let mut actors = InstanceVisitor::<E> {
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

    /// Returns the ray in the space of an instance, with the same parameter.
    #[inline(always)]
    fn to_instance_space(self, instance: &Instance) -> SingleRay {
        let rows = instance.actor_from_world;
        let turn = |row: [f32; 4], v: Vec3| row[0] * v.x + row[1] * v.y + row[2] * v.z;
        SingleRay::new(
            Vec3::from(rows.map(|row| turn(row, self.origin) + row[3])),
            Vec3::from(rows.map(|row| turn(row, self.direction))),
            self.reach,
        )
    }
}

impl Probe for SingleRay {
    #[inline(always)]
    fn touch<E: Float8>(&self, node: &WideNode, limit: f32) -> (u32, [f32; 8]) {
        let row = |row: usize| E::load(node.row(row));
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

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a> {
    scene: &'a Scene,
    ray: &'a SingleRay,
    instance: u32,
    hit: &'a mut Hit,
    /// Whether any hit ends the search.
    any: bool,
}

impl Visitor for TriangleVisitor<'_> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        let triangles = &self.scene.triangles[first as usize..(first + count) as usize];
        for (four, first) in triangles.chunks(4).zip((first..).step_by(4)) {
            self.meet_four(four, first);
        }
        limit(self.any, self.hit)
    }
}

#[inline(always)]
fn limit(any: bool, hit: &Hit) -> f32 {
    if any && hit.is_some() { f32::NEG_INFINITY } else { hit.t }
}

impl TriangleVisitor<'_> {
    /// Möller and Trumbore 1997, with the signs of [`super::ray_packet`], for one to four triangles at once.
    #[inline(always)]
    fn meet_four(&mut self, triangles: &[Triangle], first: u32) {
        let last = triangles.len() - 1;
        let four = [0, 1, 2, 3].map(|at: usize| Triangle::floats(&triangles[at.min(last)]));
        let (corner, edge1, edge2) = (column(&four, 0), column(&four, 4), column(&four, 8));
        let (origin, direction) = (Four::splat(self.ray.origin), Four::splat(self.ray.direction));
        let from_corner = origin.minus(&corner);
        let across = direction.cross(&edge2);
        let along = from_corner.cross(&edge1);
        let det = edge1.dot(&across);
        let side = Vec4::select(det.cmplt(Vec4::ZERO), Vec4::NEG_ONE, Vec4::ONE);
        let det = det * side;
        let u = from_corner.dot(&across) * side;
        let v = direction.dot(&along) * side;
        let t = edge2.dot(&along) * side;
        let inside = u.min(v).min(det - u - v).cmpge(det * -EDGE_SLACK);
        let mut met = (inside & t.cmpgt(det * T_MIN)).bitmask() & ((2 << last) - 1);
        if met == 0 {
            return;
        }
        let (t, det) = (t.to_array(), det.to_array());
        while met != 0 {
            let at = met.trailing_zeros() as usize & 3;
            met &= met - 1;
            if t[at] < self.hit.t * det[at] {
                let (triangle, instance) = (first + at as u32, self.instance);
                *self.hit = Hit { t: t[at] / det[at], triangle, instance, ..*self.hit };
            }
        }
    }
}

/// Four vectors, component by component.
struct Four {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

/// Returns the vectors that begin at number `first` of the values of each triangle.
#[inline(always)]
fn column(of: &[&[f32; 12]; 4], first: usize) -> Four {
    let rows = Mat4::from_cols(
        Vec4::from_slice(&of[0][first..]),
        Vec4::from_slice(&of[1][first..]),
        Vec4::from_slice(&of[2][first..]),
        Vec4::from_slice(&of[3][first..]),
    );
    let columns = rows.transpose();
    Four { x: columns.x_axis, y: columns.y_axis, z: columns.z_axis }
}

impl Four {
    #[inline(always)]
    fn splat(v: Vec3) -> Four {
        Four { x: Vec4::splat(v.x), y: Vec4::splat(v.y), z: Vec4::splat(v.z) }
    }

    #[inline(always)]
    fn minus(&self, other: &Four) -> Four {
        Four { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    fn cross(&self, other: &Four) -> Four {
        Four {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    #[inline(always)]
    fn dot(&self, other: &Four) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, E> {
    scene: &'a Scene,
    world: &'a World,
    ray: &'a SingleRay,
    hit: &'a mut Hit,
    any: bool,
    lanes: PhantomData<E>,
}

impl<E: Float8> Visitor for InstanceVisitor<'_, E> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = self.scene.blases[instance.blas as usize].wide_root;
            let ray = self.ray.to_instance_space(instance);
            let (any, limit) = (self.any, self.hit.t);
            let mut triangles = TriangleVisitor {
                scene: self.scene,
                ray: &ray,
                instance: index,
                hit: self.hit,
                any,
            };
            walk::<E, _, _>(&self.scene.wide, root, &ray, limit, stack, &mut triangles);
            if self.any && self.hit.is_some() {
                break;
            }
        }
        limit(self.any, self.hit)
    }
}
