//! Client poses of walkers: the commands, and the state that follows from them.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};

use crate::{ActorId, Command, Pose};

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

/// Parameters of [`Command::SetBones`]; also the response to [`crate::QueryKind::Bones`].
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

/// Parameters of [`Command::BlendPose`]; also the response to [`crate::QueryKind::Blend`].
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

/// The client pose of one walker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenPose {
    /// Weight of the pose, 0 to 1.
    pub weight: f32,
    /// `parent_from_bone` by bone number; `None` for bones in their rest pose.
    pub bones: Vec<Option<(Vec3, Quat)>>,
}

/// The client poses of all walkers, as the journal's commands set them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenPoses(BTreeMap<ActorId, GivenPose>);

impl GivenPoses {
    /// Sets the bones that a command names.
    pub fn set_bones(&mut self, set: &SetBones) {
        let bones = &mut self.0.entry(set.actor_id).or_default().bones;
        for (bone, pose) in set.bones() {
            let bone = bone as usize;
            if bone < BONES.len() {
                bones.resize(bones.len().max(bone + 1), None);
                bones[bone] = Some((pose.position(), pose.rotation()));
            }
        }
    }

    /// Sets how much of an actor's given pose shows.
    pub fn blend(&mut self, blend: &BlendPose) {
        self.0.entry(blend.actor_id).or_default().weight = blend.weight;
    }

    /// Forgets the pose of an actor that was destroyed.
    pub fn remove(&mut self, actor: ActorId) {
        self.0.remove(&actor);
    }

    /// Returns the pose that an actor was given.
    pub fn of(&self, actor: ActorId) -> Option<&GivenPose> {
        self.0.get(&actor)
    }

    /// Returns the commands that give the same poses.
    pub fn commands(&self) -> Vec<Command> {
        let mut commands = Vec::new();
        for (actor_id, given) in &self.0 {
            let set = |(bone, pose): (usize, &Option<(Vec3, Quat)>)| {
                pose.map(|(at, turn)| (bone as u32, Pose::new(at, turn)))
            };
            let bones: Vec<_> = given.bones.iter().enumerate().filter_map(set).collect();
            commands.extend(SetBones::of(*actor_id, &bones).into_iter().map(Command::SetBones));
            commands
                .push(Command::BlendPose(BlendPose { actor_id: *actor_id, weight: given.weight }));
        }
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_give_a_whole_pose_and_destroying_the_actor_ends_it() {
        let pose = |x: f32| Pose::new(Vec3::X * x, Quat::from_rotation_y(x));
        let actor_id = ActorId(7);
        let bones: Vec<_> = (0..9).chain([20, 65]).map(|bone| (bone, pose(bone as f32))).collect();
        let sets = SetBones::of(actor_id, &bones);
        assert_eq!(
            sets.iter().map(|s| (s.first, s.count)).collect::<Vec<_>>(),
            [(0, 6), (6, 3), (20, 1), (65, 1)]
        );
        let mut poses = GivenPoses::default();
        sets.iter().for_each(|set| poses.set_bones(set));
        poses.blend(&BlendPose { actor_id, weight: 0.5 });
        let given = poses.of(actor_id).unwrap();
        assert_eq!((given.weight, given.bones.len()), (0.5, 66));
        assert_eq!(given.bones[8].unwrap().0, Vec3::X * 8.0);
        assert_eq!(given.bones[9], None);

        let mut again = GivenPoses::default();
        for command in poses.commands() {
            match command {
                Command::SetBones(set) => again.set_bones(&set),
                Command::BlendPose(blend) => again.blend(&blend),
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(again, poses);
        again.remove(actor_id);
        assert_eq!(again, GivenPoses::default());
    }
}
