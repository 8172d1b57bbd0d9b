//! Poses that clients give walkers.

use protocol::{
    ActorId, BONES_PER_COMMAND, BlendPose, Command, GivenPoses, Outcome, Pose, SetBones, flag, kind,
};

use super::{World, set};

/// No bone is farther from its parent.
const REACH_M: f32 = 10.0;

impl World {
    /// The poses that clients gave walkers.
    pub(crate) fn poses(&self) -> &GivenPoses {
        &self.poses
    }

    /// See [`Command::SetBones`].
    pub(super) fn set_bones(&mut self, to: &SetBones) -> Result<u32, String> {
        let id = to.actor_id;
        let skeleton = self.standing_walker(id)?;
        let last = to.first.saturating_add(to.count);
        if !(1..=BONES_PER_COMMAND as u32).contains(&to.count)
            || last as usize > skeleton.bones.len()
        {
            return Err(format!(
                "bones {} to {last} of {id}: it has {}, and one command sets 1 to {BONES_PER_COMMAND}",
                to.first,
                skeleton.bones.len()
            ));
        }
        for (bone, pose) in to.bones() {
            if !pose.is_valid() || pose.position().length() > REACH_M {
                let name = &skeleton.bones[bone as usize].name;
                return Err(format!(
                    "{name} of {id} is at {:?}, turned {:?}: not finite, not of unit length, or \
                     beyond {REACH_M} m",
                    pose.position_m, pose.rotation
                ));
            }
        }
        self.poses.follow(&Command::SetBones(*to));
        Ok(id.0)
    }

    /// See [`Command::BlendPose`].
    pub(super) fn blend_pose(&mut self, to: &BlendPose) -> Result<u32, String> {
        let (id, share) = (to.actor_id, to.weight);
        self.standing_walker(id)?;
        if !(0.0..=1.0).contains(&share) {
            return Err(format!("the pose of {id} is to show by {share}, not 0 to 1"));
        }
        set(&mut self.movable(id)?.flags, flag::POSED, share > 0.0);
        self.poses.follow(&Command::BlendPose(*to));
        Ok(id.0)
    }

    /// Six bones of the pose that a walker was given.
    pub(super) fn tell_bones(&mut self, id: ActorId, first: u32) -> Result<Outcome, String> {
        let skeleton = self.walker(id)?;
        let bones = skeleton.bones.iter().enumerate().skip(first as usize).take(BONES_PER_COMMAND);
        let given = self.poses.of(id);
        let mut told = SetBones { actor_id: id, first, ..SetBones::default() };
        for (room, (index, bone)) in told.parent_from_bones.iter_mut().zip(bones) {
            let begins = skeleton.bones[bone.parent].at_m;
            let at_m = if index == bone.parent { bone.at_m } else { bone.at_m - begins };
            let set = given.and_then(|given| given.bones.get(index).copied().flatten());
            let (at, turn) = set.unwrap_or((at_m, glam::Quat::IDENTITY));
            *room = Pose::new(at, turn);
            told.count += 1;
        }
        if told.count == 0 {
            return Err(format!("{id} has {} bones; there is no {first}", skeleton.bones.len()));
        }
        Ok(Outcome::answer(id.0, &told))
    }

    /// How much of the pose shows that a walker was given.
    pub(super) fn tell_blend(&mut self, id: ActorId) -> Result<Outcome, String> {
        self.walker(id)?;
        let share = self.poses.of(id).map_or(0.0, |given| given.weight);
        Ok(Outcome::answer(id.0, &BlendPose { actor_id: id, weight: share }))
    }

    fn standing_walker(&mut self, id: ActorId) -> Result<&'static town::Skeleton, String> {
        let skeleton = self.walker(id)?;
        if self.movable(id)?.has(flag::FALLEN) {
            return Err(format!("{id} lies on the ground"));
        }
        Ok(skeleton)
    }

    fn walker(&mut self, id: ActorId) -> Result<&'static town::Skeleton, String> {
        let state = *self.movable(id)?;
        let skeleton = town::catalogue()[state.blueprint as usize].skeleton();
        skeleton
            .filter(|_| state.kind == kind::WALKER)
            .ok_or_else(|| format!("{id} is no walker; it has no bones to set"))
    }
}
