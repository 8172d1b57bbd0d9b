//! How the world has moved since the frame before: what optical flow is made of.

use std::collections::BTreeMap;

use glam::{Affine3A, Vec3, Vec4};
use protocol::{ActorId, ActorState, WalkerLimbs, flag};

use crate::world::pieces;
use crate::{Scene, World};

/// `before_from_now` of all that has moved, in world space. Empty where nobody asked.
#[derive(Debug, Default)]
pub(crate) struct Motions {
    /// Of the world's instances, in their order.
    instances: Vec<Option<Affine3A>>,
    actors: BTreeMap<ActorId, Affine3A>,
}

impl Motions {
    /// Where a point of an instance, as it is now, was before; none if it has not moved.
    #[inline(always)]
    pub(crate) fn before(&self, instance: u32, now: Vec3) -> Option<Vec3> {
        let before_from_now = self.instances.get(instance as usize)?.as_ref()?;
        Some(before_from_now.transform_point3(now))
    }
}

impl World {
    /// After [`World::place`]: notes how `actors` have moved since they were as in `before`. Who
    /// was not there, or was teleported since, counts as not moved.
    pub fn follow(&mut self, scene: &Scene, before: &[ActorState], actors: &[ActorState]) {
        let mut stood = BTreeMap::new();
        self.motions.actors.clear();
        for actor in actors.iter().filter(|actor| !actor.has(flag::TELEPORTED)) {
            let Ok(at) = before.binary_search_by_key(&actor.actor_id, |a| a.actor_id) else {
                continue;
            };
            let was = &before[at];
            if was.blueprint != actor.blueprint || !was.pose.is_valid() || !actor.pose.is_valid() {
                continue;
            }
            let is_still = was.pose == actor.pose;
            if !is_still {
                let before_from_now = was.pose.affine() * actor.pose.affine().inverse();
                self.motions.actors.insert(actor.actor_id, before_from_now);
            }
            let poses = self.poses_before.as_ref().unwrap_or(&self.poses);
            let limbs = WalkerLimbs::find(&self.limbs_before, actor.actor_id);
            pieces(scene, was, (poses, limbs), false, |level, world_from_piece| {
                stood.insert((actor.actor_id.0, level), *world_from_piece);
            });
        }
        let of = |instance: &crate::world::Instance| {
            let world_from_piece = stood.get(&(instance.id, instance.level))?;
            let [x, y, z] = instance.actor_from_world.map(Vec4::from);
            let piece_from_world = glam::Mat4::from_cols(x, y, z, Vec4::W).transpose();
            Some(*world_from_piece * Affine3A::from_mat4(piece_from_world))
        };
        self.motions.instances = self.instances.iter().map(of).collect();
    }

    /// How a carrier has moved; none if it has not, or nobody asked.
    pub(crate) fn motion(&self, carrier: ActorId) -> Option<&Affine3A> {
        self.motions.actors.get(&carrier)
    }
}
