//! Reference implementation, one ray at a time, that both tracers must agree with.

use glam::Vec3;

use crate::bvh::{Link, Node};
use crate::hit::{EDGE_SLACK, Hit, NONE, T_MIN};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::triangle::Triangle;
use crate::world::World;

/// Returns the first intersection of a ray before `t_max`.
pub(crate) fn closest(scene: &Scene, world: &World, ray: Ray, t_max: f32) -> Hit {
    let mut hit = Hit::none(t_max);
    walk(&scene.nodes, scene.town_blas.root, &ray, &mut hit, &mut |first, count, hit| {
        meet(&scene.triangles, first, count, &ray, NONE, hit);
    });
    if let Some(root) = world.root {
        walk(&world.nodes, root, &ray, &mut hit, &mut |first, count, hit| {
            for index in first..first + count {
                let instance = &world.instances[index as usize];
                let ray = ray.to_instance_space(instance);
                walk(&scene.nodes, instance.root, &ray, hit, &mut |first, count, hit| {
                    meet(&scene.triangles, first, count, &ray, index, hit);
                });
            }
        });
    }
    hit
}

/// Ray; its parameter counts lengths of `direction`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
}

impl Ray {
    /// Returns the ray in the space of an instance, with the same parameter.
    fn to_instance_space(self, instance: &Instance) -> Ray {
        let rows = instance.actor_from_world;
        let turn = |row: [f32; 4], v: Vec3| row[0] * v.x + row[1] * v.y + row[2] * v.z;
        Ray {
            origin: Vec3::from(rows.map(|row| turn(row, self.origin) + row[3])),
            direction: Vec3::from(rows.map(|row| turn(row, self.direction))),
        }
    }
}

/// Calls `leaf` for the leaves that the ray enters before `hit.t`, near ones first.
fn walk(
    nodes: &[Node],
    root: Link,
    ray: &Ray,
    hit: &mut Hit,
    leaf: &mut dyn FnMut(u32, u32, &mut Hit),
) {
    let inverse = Vec3::from(
        ray.direction
            .to_array()
            .map(|d| 1.0 / if d.abs() < 1e-12 { 1e-12f32.copysign(d) } else { d }),
    );
    let mut stack = vec![(root, 0.0)];
    while let Some((link, entry)) = stack.pop() {
        if entry > hit.t {
            continue;
        }
        if link.is_leaf() {
            let (first, count) = link.primitives();
            leaf(first, count, hit);
            continue;
        }
        let node = &nodes[link.0 as usize];
        let near = enter(&node.low0, &node.high0, ray.origin, inverse, hit.t);
        let far = enter(&node.low1, &node.high1, ray.origin, inverse, hit.t);
        let mut children = [(node.child0, near), (node.child1, far)];
        if far < near {
            children.swap(0, 1);
        }
        stack.extend(children.into_iter().rev().filter(|(_, entry)| *entry < f32::INFINITY));
    }
}

/// Returns the ray parameter at which the ray enters the box before `t_max`, or infinity.
fn enter(low: &[f32; 3], high: &[f32; 3], origin: Vec3, inverse: Vec3, t_max: f32) -> f32 {
    let (a, b) = ((Vec3::from(*low) - origin) * inverse, (Vec3::from(*high) - origin) * inverse);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(t_max));
    if near <= far { near } else { f32::INFINITY }
}

/// Intersects the ray with both sides of triangles (Möller and Trumbore 1997).
fn meet(triangles: &[Triangle], first: u32, count: u32, ray: &Ray, instance: u32, hit: &mut Hit) {
    for index in first..first + count {
        let triangle = &triangles[index as usize];
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let across = ray.direction.cross(edge2);
        let inverse = 1.0 / edge1.dot(across);
        let from_corner = ray.origin - corner;
        let u = from_corner.dot(across) * inverse;
        let along = from_corner.cross(edge1);
        let v = ray.direction.dot(along) * inverse;
        let t = edge2.dot(along) * inverse;
        let inside = u >= -EDGE_SLACK && v >= -EDGE_SLACK && u + v <= 1.0 + EDGE_SLACK;
        if inside && t > T_MIN && t < hit.t {
            *hit = Hit { t, triangle: index, instance, u, v };
        }
    }
}
