use glam::Vec3;
use mesh::{ObjectId, Tag};

use crate::{
    hit::NONE,
    scene::Scene,
    simd::{Float, LANES, Mask, V3, Word},
    world::World,
};

/// Material code of the sky.
pub(crate) const NO_MATERIAL: u32 = 255;

/// Surfaces that sixteen rays hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceSample<F: Float> {
    /// Rays that hit a surface.
    pub(crate) hit: F::Mask,
    /// Ray parameters of the hits.
    pub(crate) t: F,
    /// Tag in bits 0 to 7, material in bits 8 to 15.
    pub(crate) face: F::Word,
    /// Instance ids.
    pub(crate) id: F::Word,
    /// Normals in world space, of unit length.
    pub(crate) normal: V3<F>,
    /// Colours of actors, in sRGB.
    pub(crate) color: F::Word,
    /// Light bits of actors.
    pub(crate) lights: F::Word,
}

impl<F: Float> SurfaceSample<F> {
    /// Looks up the triangles that were hit, each of them once, since neighbouring rays often hit
    /// the same.
    #[inline(always)]
    pub(crate) fn new(
        scene: &Scene,
        world: &World,
        t: F,
        triangle: F::Word,
        instance: F::Word,
    ) -> Self {
        let missed = triangle.eq(F::Word::splat(NONE));
        let zero = F::Word::splat(0);
        let sky = F::Word::splat(Tag::Sky as u32 | NO_MATERIAL << 8);
        let mut sample = SurfaceSample {
            hit: !missed,
            t,
            face: sky,
            id: zero,
            normal: V3::splat(Vec3::Z),
            color: zero,
            lights: zero,
        };
        let (triangles, instances) = (triangle.to_array(), instance.to_array());
        let mut left = sample.hit.bits();
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            let (index, of) = (triangles[lane], instances[lane]);
            let same = triangle.eq(F::Word::splat(index)) & instance.eq(F::Word::splat(of));
            left &= !same.bits();
            let triangle = &scene.triangles[index as usize];
            let mut normal = Vec3::from(triangle.edge1).cross(Vec3::from(triangle.edge2));
            let mut id = ObjectId::new(triangle.object).instance();
            if of != NONE {
                let actor = &world.instances[of as usize];
                let [x, y, z] = actor.actor_from_world.map(|r| Vec3::new(r[0], r[1], r[2]));
                normal = x * normal.x + y * normal.y + z * normal.z;
                id = actor.id;
                sample.color = F::Word::splat(actor.color).or(same, sample.color);
                sample.lights = F::Word::splat(actor.lights).or(same, sample.lights);
            }
            let normal = normal * (1.0 / normal.length_squared().max(1e-30).sqrt());
            sample.face = F::Word::splat(triangle.face).or(same, sample.face);
            sample.id = F::Word::splat(id).or(same, sample.id);
            sample.normal = V3::splat(normal).or(same, sample.normal);
        }
        sample
    }
}
