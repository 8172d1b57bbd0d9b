//! Bones of walkers, and the parameters of the commands that pose them.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Pose};

/// The most bones that one command sets.
pub const BONES_PER_COMMAND: usize = 6;

/// Names of a walker's bones, the same as CARLA's; the index is the bone's number.
#[rustfmt::skip]
pub const BONES: [&str; 66] = [
    "crl_root", "crl_hips__C", "crl_spine__C", "crl_spine01__C",
    "crl_shoulder__L", "crl_arm__L", "crl_foreArm__L", "crl_hand__L",
    "crl_shoulder__R", "crl_arm__R", "crl_foreArm__R", "crl_hand__R",
    "crl_neck__C", "crl_Head__C", "crl_eye__L", "crl_eye__R",
    "crl_thigh__L", "crl_leg__L", "crl_foot__L", "crl_toe__L", "crl_toeEnd__L",
    "crl_thigh__R", "crl_leg__R", "crl_foot__R", "crl_toe__R", "crl_toeEnd__R",
    "crl_handThumb__L", "crl_handThumb01__L", "crl_handThumb02__L", "crl_handThumbEnd__L",
    "crl_handIndex__L", "crl_handIndex01__L", "crl_handIndex02__L", "crl_handIndexEnd__L",
    "crl_handMiddle__L", "crl_handMiddle01__L", "crl_handMiddle02__L", "crl_handMiddleEnd__L",
    "crl_handRing__L", "crl_handRing01__L", "crl_handRing02__L", "crl_handRingEnd__L",
    "crl_handPinky__L", "crl_handPinky01__L", "crl_handPinky02__L", "crl_handPinkyEnd__L",
    "crl_handThumb__R", "crl_handThumb01__R", "crl_handThumb02__R", "crl_handThumbEnd__R",
    "crl_handIndex__R", "crl_handIndex01__R", "crl_handIndex02__R", "crl_handIndexEnd__R",
    "crl_handMiddle__R", "crl_handMiddle01__R", "crl_handMiddle02__R", "crl_handMiddleEnd__R",
    "crl_handRing__R", "crl_handRing01__R", "crl_handRing02__R", "crl_handRingEnd__R",
    "crl_handPinky__R", "crl_handPinky01__R", "crl_handPinky02__R", "crl_handPinkyEnd__R",
];

/// Parameters of [`crate::Command::SetBones`]; also the response to [`crate::QueryKind::Bones`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SetBones {
    /// The actor.
    pub actor_id: ActorId,
    /// Number of the first bone.
    pub first: u32,
    /// Number of bones from the first one on: 1 to [`BONES_PER_COMMAND`].
    pub count: u32,
    /// Reserved; 0.
    pub reserved: u32,
    /// `parent_from_bone`; the parent of the root is the actor. In the rest pose the axes of every bone
    /// are those of the actor.
    pub parent_from_bones: [Pose; BONES_PER_COMMAND],
}

const _: () = assert!(size_of::<SetBones>() == 184);

/// Parameters of [`crate::Command::BlendPose`]; also the response to [`crate::QueryKind::Blend`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BlendPose {
    /// The actor.
    pub actor_id: ActorId,
    /// Weight of the client pose: 0 shows the animation alone, 1 the client pose alone.
    pub weight: f32,
}

impl SetBones {
    /// The bones that the command sets: number and `parent_from_bone`.
    pub fn bones(&self) -> impl Iterator<Item = (u32, &Pose)> {
        let count = (self.count as usize).min(BONES_PER_COMMAND);
        self.parent_from_bones[..count]
            .iter()
            .enumerate()
            .map(|(i, pose)| (self.first + i as u32, pose))
    }

    /// The commands that set these bones, given as number and `parent_from_bone` and sorted by number.
    pub fn of(actor_id: ActorId, bones: &[(u32, Pose)]) -> Vec<SetBones> {
        let mut sets: Vec<SetBones> = Vec::new();
        for (bone, pose) in bones {
            let room = sets.last_mut().filter(|set| {
                (set.count as usize) < BONES_PER_COMMAND && set.first + set.count == *bone
            });
            match room {
                Some(set) => {
                    set.parent_from_bones[set.count as usize] = *pose;
                    set.count += 1;
                }
                None => {
                    let mut set =
                        SetBones { actor_id, first: *bone, count: 1, ..SetBones::default() };
                    set.parent_from_bones[0] = *pose;
                    sets.push(set);
                }
            }
        }
        sets
    }
}
