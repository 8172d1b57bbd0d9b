//! Motion of the world since the previous frame, from which optical flow is computed.

use std::collections::BTreeMap;

use bytemuck::Zeroable;
use glam::{Affine3A, Vec3, Vec4};
use protocol::{ActorId, ActorState, GivenPoses, WalkerLimbs, flag};

use crate::{
    instance::{Instance, rows},
    pieces::pieces,
    scene::Scene,
};

/// `before_from_now` of everything that has moved, in world space. Empty unless a sensor measures
/// optical flow.
#[derive(Debug, Default)]
pub(crate) struct Motions {
    /// Motions of the instances of the world, in their order.
    instances: Vec<Option<Affine3A>>,
    actors: BTreeMap<ActorId, Affine3A>,
}

impl Motions {
    /// Returns the previous position of a point of an instance; `None` if the instance has not
    /// moved.
    #[inline(always)]
    pub(crate) fn before(&self, instance: u32, now: Vec3) -> Option<Vec3> {
        let before_from_now = self.instances.get(instance as usize)?.as_ref()?;
        Some(before_from_now.transform_point3(now))
    }

    /// Returns the motions of the instances as the shaders read them: rows of `before_from_now`, and an id of
    /// 1 for what has moved. Empty if none has.
    pub(crate) fn rows(&self) -> Vec<Instance> {
        if self.instances.iter().all(Option::is_none) {
            return Vec::new();
        }
        let of = |motion: &Option<Affine3A>| match motion {
            Some(motion) => {
                Instance { actor_from_world: rows(motion), id: 1, ..Zeroable::zeroed() }
            }
            None => Instance::zeroed(),
        };
        self.instances.iter().map(of).collect()
    }

    /// Computes the motion of `actors` since `before`; see [`crate::World::track_motion`]. `poses`
    /// and `limbs` are those of the previous frame; `instances` are those of this frame.
    pub(crate) fn between(
        scene: &Scene,
        (poses, limbs): (&GivenPoses, &[WalkerLimbs]),
        before: &[ActorState],
        actors: &[ActorState],
        instances: &[Instance],
    ) -> Motions {
        let mut moved = BTreeMap::new();
        let mut stood = BTreeMap::new();
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
                moved.insert(actor.actor_id, before_from_now);
            }
            let limbs = WalkerLimbs::find(limbs, actor.actor_id);
            pieces(scene, was, (poses, limbs), false, |blas, world_from_piece| {
                stood.insert((actor.actor_id.0, blas), *world_from_piece);
            });
        }
        let of = |instance: &Instance| {
            let world_from_piece = stood.get(&(instance.id, instance.blas))?;
            let [x, y, z] = instance.actor_from_world.map(Vec4::from);
            let piece_from_world = glam::Mat4::from_cols(x, y, z, Vec4::W).transpose();
            Some(*world_from_piece * Affine3A::from_mat4(piece_from_world))
        };
        Motions { instances: instances.iter().map(of).collect(), actors: moved }
    }

    /// Returns `before_from_now` of an actor; `None` if it has not moved.
    pub(crate) fn of_actor(&self, carrier: ActorId) -> Option<&Affine3A> {
        self.actors.get(&carrier)
    }
}
