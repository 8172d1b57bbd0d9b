use glam::Vec3;

use super::beam::Beam;
use super::ray_group::RayGroup;
use super::slabs::OriginSlabs;
use super::traversal::{Stack, Visitor, walk};
use crate::hit::{EDGE_SLACK, NONE, T_MIN};
use crate::instance::Instance;
use crate::scene::Scene;
use crate::simd::{Float, Mask, V3, Word};
use crate::triangle::Triangle;
use crate::wide::WideNode;
use crate::world::World;

/// Packet of `G` × 16 rays from one origin.
#[derive(Clone, Debug)]
pub(crate) struct RayPacket<F: Float, const G: usize> {
    pub(crate) origin: Vec3,
    /// Directions whose convex hull contains all rays' directions.
    pub(crate) corners: [Vec3; 4],
    /// Axis with `axis · direction <= 1` for each ray.
    pub(crate) axis: Vec3,
    pub(crate) directions: [V3<F>; G],
}

/// First intersection of each ray; see [`crate::hit::Hit`].
#[derive(Clone, Debug)]
pub(crate) struct Hits<F: Float, const G: usize> {
    pub(crate) t: [F; G],
    pub(crate) triangle: [F::Word; G],
    pub(crate) instance: [F::Word; G],
}

impl<F: Float, const G: usize> Hits<F, G> {
    /// Returns misses, for rays that end at `t_max`.
    #[inline(always)]
    pub(crate) fn none(t_max: f32) -> Self {
        Hits {
            t: [F::splat(t_max); G],
            triangle: [F::Word::splat(NONE); G],
            instance: [F::Word::splat(NONE); G],
        }
    }

    #[inline(always)]
    fn farthest(&self) -> f32 {
        let mut farthest = self.t[0];
        for t in &self.t[1..] {
            farthest = farthest.max(*t);
        }
        farthest.largest()
    }
}

impl<F: Float, const G: usize> RayPacket<F, G> {
    /// Returns the first intersection of each ray before `t_max`. The packet is traversed as one
    /// beam.
    #[inline(always)]
    pub(crate) fn closest(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        t_max: f32,
    ) -> Hits<F, G> {
        let mut hits = Hits::none(t_max);
        let beam = Beam::from_origin(self.origin, &self.corners, self.axis, scene.reach);
        let slabs = OriginSlabs::new(self.origin, &self.directions, scene.reach);
        let mut town = TriangleVisitor {
            scene,
            packet: self,
            slabs: &slabs,
            instance: NONE,
            hits: &mut hits,
            limit: t_max,
            entered: !0,
        };
        walk::<F::Float8, _, _>(
            &scene.wide,
            scene.town_blas.wide_root,
            &beam,
            t_max,
            stack,
            &mut town,
        );
        if let Some(root) = world.wide_root {
            let limit = hits.farthest();
            let mut actors =
                InstanceVisitor { scene, world, packet: self, slabs: &slabs, hits: &mut hits };
            walk::<F::Float8, _, _>(&world.wide, root, &beam, limit, stack, &mut actors);
        }
        hits
    }

    /// As [`RayPacket::closest`], but traverses each group of rays on its own, without a beam around them.
    #[inline(always)]
    pub(crate) fn closest_separately(
        &self,
        scene: &Scene,
        world: &World,
        stack: &mut Stack,
        t_max: f32,
    ) -> Hits<F, G> {
        let origins = [V3::splat(self.origin); G];
        self.closest_from(&origins, scene, [world; G], stack, t_max)
    }

    /// As [`RayPacket::closest_separately`], with an origin for each ray and a world for each group.
    #[inline(always)]
    pub(crate) fn closest_from(
        &self,
        origins: &[V3<F>; G],
        scene: &Scene,
        worlds: [&World; G],
        stack: &mut Stack,
        t_max: f32,
    ) -> Hits<F, G> {
        let mut hits = Hits::none(t_max);
        for (group, (directions, origins)) in self.directions.iter().zip(origins).enumerate() {
            let (origins, directions) = (*origins, *directions);
            let rays = RayGroup { origins, directions, active: F::Mask::from_bits(!0) };
            let own = rays.closest(scene, worlds[group], stack, t_max);
            hits.t[group] = own.t;
            hits.triangle[group] = own.triangle;
            hits.instance[group] = own.instance;
        }
        hits
    }

    /// Returns the rays in the space of an instance, with the same parameters.
    #[inline(always)]
    fn to_instance_space(&self, instance: &Instance) -> Self {
        let rows = instance.actor_from_world;
        let [x, y, z] = rows;
        let mut directions = self.directions;
        for direction in &mut directions {
            *direction = V3 {
                x: row(x).dot(*direction),
                y: row(y).dot(*direction),
                z: row(z).dot(*direction),
            };
        }
        RayPacket {
            origin: turned(rows, self.origin) + Vec3::new(x[3], y[3], z[3]),
            corners: [
                turned(rows, self.corners[0]),
                turned(rows, self.corners[1]),
                turned(rows, self.corners[2]),
                turned(rows, self.corners[3]),
            ],
            // Along the axis, distances in a larger piece are as many times shorter as the directions.
            axis: turned(rows, self.axis) * instance.size_squared,
            directions,
        }
    }
}

/// Returns a direction in the space of an instance.
#[inline(always)]
fn turned([x, y, z]: [[f32; 4]; 3], v: Vec3) -> Vec3 {
    Vec3::new(
        x[0] * v.x + x[1] * v.y + x[2] * v.z,
        y[0] * v.x + y[1] * v.y + y[2] * v.z,
        z[0] * v.x + z[1] * v.y + z[2] * v.z,
    )
}

/// Broadcasts a row of a rotation to all lanes.
#[inline(always)]
fn row<F: Float>(row: [f32; 4]) -> V3<F> {
    V3 { x: F::splat(row[0]), y: F::splat(row[1]), z: F::splat(row[2]) }
}

/// Intersects the triangles of one bottom-level hierarchy.
struct TriangleVisitor<'a, F: Float, const G: usize> {
    scene: &'a Scene,
    packet: &'a RayPacket<F, G>,
    slabs: &'a OriginSlabs<F, G>,
    instance: u32,
    hits: &'a mut Hits<F, G>,
    /// Largest distance of a hit.
    limit: f32,
    /// Groups with rays that meet the box of the leaf, one bit each.
    entered: u32,
}

impl<F: Float, const G: usize> Visitor for TriangleVisitor<'_, F, G> {
    #[inline(always)]
    fn visit(&mut self, _: &mut Stack, first: u32, count: u32) -> f32 {
        let mut is_nearer = false;
        for index in first..first + count {
            let triangle = &self.scene.triangles[index as usize];
            is_nearer |= self.meet(triangle, index);
        }
        if is_nearer {
            self.limit = self.hits.farthest();
        }
        self.limit
    }

    #[inline(always)]
    fn enters(&mut self, node: &WideNode, child: usize) -> bool {
        self.entered = self.slabs.meet(node, child, &self.hits.t);
        self.entered != 0
    }
}

impl<F: Float, const G: usize> TriangleVisitor<'_, F, G> {
    /// Möller and Trumbore 1997, rearranged for rays from one origin: everything but three dot
    /// products depends on the triangle alone, and the division is done only for hits. Returns whether any ray hits
    /// the triangle.
    #[inline(always)]
    fn meet(&mut self, triangle: &Triangle, index: u32) -> bool {
        let mut is_nearer = false;
        let [corner, edge1, edge2] =
            [triangle.corner, triangle.edge1, triangle.edge2].map(Vec3::from);
        let from_corner = self.packet.origin - corner;
        let along = from_corner.cross(edge1);
        let height = edge2.dot(along);
        // Signs are chosen by the side of the origin, so that the determinant is positive for a
        // hit.
        let side = if height < 0.0 { -1.0 } else { 1.0 };
        let for_det = V3::<F>::splat(edge2.cross(edge1) * side);
        let for_u = V3::<F>::splat(edge2.cross(from_corner) * side);
        let for_v = V3::<F>::splat(along * side);
        let height = F::splat(height * side);
        for group in 0..G {
            if self.entered >> group & 1 == 0 {
                continue;
            }
            let direction = self.packet.directions[group];
            let det = direction.dot(for_det);
            let u = direction.dot(for_u);
            let v = direction.dot(for_v);
            let least = u.min(v).min(det - u - v);
            let inside = det.mul_add(F::splat(EDGE_SLACK), least).ge(F::splat(0.0));
            let nearer = height.lt(self.hits.t[group] * det);
            let met = inside & nearer & (det * F::splat(T_MIN)).lt(height);
            if met.any() {
                is_nearer = true;
                self.hits.t[group] = (height / det).or(met, self.hits.t[group]);
                let index = F::Word::splat(index);
                self.hits.triangle[group] = index.or(met, self.hits.triangle[group]);
                let instance = F::Word::splat(self.instance);
                self.hits.instance[group] = instance.or(met, self.hits.instance[group]);
            }
        }
        is_nearer
    }
}

/// Visits the instances of the top-level hierarchy.
struct InstanceVisitor<'a, F: Float, const G: usize> {
    scene: &'a Scene,
    world: &'a World,
    packet: &'a RayPacket<F, G>,
    slabs: &'a OriginSlabs<F, G>,
    hits: &'a mut Hits<F, G>,
}

impl<F: Float, const G: usize> Visitor for InstanceVisitor<'_, F, G> {
    #[inline(always)]
    fn visit(&mut self, stack: &mut Stack, first: u32, count: u32) -> f32 {
        for index in first..first + count {
            let instance = &self.world.instances[index as usize];
            let root = self.scene.blases[instance.blas as usize].wide_root;
            let packet = self.packet.to_instance_space(instance);
            let beam =
                Beam::from_origin(packet.origin, &packet.corners, packet.axis, self.scene.reach);
            let slabs = OriginSlabs::new(packet.origin, &packet.directions, self.scene.reach);
            let limit = self.hits.farthest();
            let mut triangles = TriangleVisitor {
                scene: self.scene,
                packet: &packet,
                slabs: &slabs,
                instance: index,
                hits: self.hits,
                limit,
                entered: !0,
            };
            walk::<F::Float8, _, _>(&self.scene.wide, root, &beam, limit, stack, &mut triangles);
        }
        self.hits.farthest()
    }

    #[inline(always)]
    fn enters(&mut self, node: &WideNode, child: usize) -> bool {
        self.slabs.meet(node, child, &self.hits.t) != 0
    }
}
