use glam::Vec3;
use mesh::Tag;

use crate::hit::NONE;
use crate::simd::{Float, LANES, Mask, V3, Word};
use crate::scene::STATIC;
use crate::{Scene, World};

/// The material code of no surface.
pub(crate) const NO_MATERIAL: u32 = 255;

/// What sixteen rays see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<F: Float> {
    /// Which of them see a surface.
    pub(crate) hit: F::Mask,
    /// Along the ray.
    pub(crate) t: F,
    /// Tag in bits 0 to 7, material in bits 8 to 15.
    pub(crate) face: F::Word,
    /// The instance id.
    pub(crate) id: F::Word,
    /// In world space, of unit length.
    pub(crate) normal: V3<F>,
    /// Of an actor, in sRGB.
    pub(crate) color: F::Word,
    /// Of an actor.
    pub(crate) lights: F::Word,
}

impl<F: Float> Seen<F> {
    /// Looks up what was hit, once for each triangle that any of the rays met: there are few.
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
        let mut seen = Seen {
            hit: !missed,
            t,
            face: sky,
            id: zero,
            normal: V3::splat(Vec3::Z),
            color: zero,
            lights: zero,
        };
        let (triangles, instances) = (triangle.to_array(), instance.to_array());
        let mut left = seen.hit.bits();
        while left != 0 {
            let lane = left.trailing_zeros() as usize % LANES;
            let (index, of) = (triangles[lane], instances[lane]);
            let same = triangle.eq(F::Word::splat(index)) & instance.eq(F::Word::splat(of));
            left &= !same.bits();
            let triangle = &scene.triangles[index as usize];
            let mut normal = Vec3::from(triangle.edge1).cross(Vec3::from(triangle.edge2));
            let mut id = STATIC | triangle.object;
            if of != NONE {
                let actor = &world.instances[of as usize];
                let [x, y, z] = actor.actor_from_world.map(|r| Vec3::new(r[0], r[1], r[2]));
                normal = x * normal.x + y * normal.y + z * normal.z;
                id = actor.id;
                seen.color = F::Word::splat(actor.color).or(same, seen.color);
                seen.lights = F::Word::splat(actor.lights).or(same, seen.lights);
            }
            let normal = normal * (1.0 / normal.length_squared().max(1e-30).sqrt());
            seen.face = F::Word::splat(triangle.face).or(same, seen.face);
            seen.id = F::Word::splat(id).or(same, seen.id);
            seen.normal = V3::splat(normal).or(same, seen.normal);
        }
        seen
    }

    /// `self` where the mask is set, else `other`.
    #[inline(always)]
    pub(crate) fn or(&self, mask: F::Mask, other: &Self) -> Self {
        Seen {
            hit: self.hit & mask | other.hit & !mask,
            t: self.t.or(mask, other.t),
            face: self.face.or(mask, other.face),
            id: self.id.or(mask, other.id),
            normal: self.normal.or(mask, other.normal),
            color: self.color.or(mask, other.color),
            lights: self.lights.or(mask, other.lights),
        }
    }
}
