//! The client poses of walkers, as the journal's commands set them.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};

use crate::{ActorId, BONES, BlendPose, Command, Pose, SetBones};

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
