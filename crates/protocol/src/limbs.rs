//! How the body of a fallen walker lies.

use bytemuck::{Pod, Zeroable};
use glam::Quat;

use crate::ActorId;

/// How many limbs of a fallen walker have a rotation of their own: chest, head, left upper arm and
/// forearm, right upper arm and forearm, left thigh and shin, right thigh and shin, in this order.
/// The hips carry the chest and the thighs, the chest carries the head and the arms.
pub const LIMBS: usize = 10;

/// The rotations of the limbs of one walker that has [`crate::flag::FALLEN`]. A snapshot holds one
/// of these for each such walker, sorted by id, after its actors. The walker's own pose is that of
/// its hips, with the origin between the feet of the standing body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct WalkerLimbs {
    /// The walker.
    pub actor_id: ActorId,
    /// `parent_from_limb` of each limb as a unit quaternion x, y, z, w; the identity for the
    /// standing body.
    pub rotations: [[f32; 4]; LIMBS],
}

const _: () = assert!(size_of::<WalkerLimbs>() == 164);

impl WalkerLimbs {
    /// Limbs of `actor_id` with these rotations.
    pub fn new(actor_id: ActorId, rotations: &[Quat; LIMBS]) -> WalkerLimbs {
        WalkerLimbs { actor_id, rotations: rotations.map(|rotation| rotation.to_array()) }
    }

    /// `parent_from_limb` of each limb.
    pub fn rotations(&self) -> [Quat; LIMBS] {
        self.rotations.map(Quat::from_array)
    }

    /// The limbs of `actor_id` in a list that is sorted by id, if it has fallen.
    pub fn find(limbs: &[WalkerLimbs], actor_id: ActorId) -> Option<&WalkerLimbs> {
        let index = limbs.binary_search_by_key(&actor_id, |walker| walker.actor_id).ok()?;
        limbs.get(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limbs_are_found_by_the_id_of_their_walker() {
        let bent = [Quat::from_rotation_y(0.5); LIMBS];
        let limbs = [2, 5, 9].map(|id| WalkerLimbs::new(ActorId(id), &bent));
        let found = WalkerLimbs::find(&limbs, ActorId(5)).map(WalkerLimbs::rotations);
        assert_eq!(found, Some(bent));
        assert_eq!(WalkerLimbs::find(&limbs, ActorId(4)), None);
    }
}
