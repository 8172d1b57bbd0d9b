//! Poses that a client gives walkers.

use protocol::{ActorId, Ask, BONES, BONES_PER_COMMAND, BlendPose, Command, Pose, SetBones, part};

use crate::{Client, ClientError};

/// The number of a walker's bone by CARLA's name, as `crl_arm__L`.
pub fn bone(name: &str) -> Option<u32> {
    BONES.iter().position(|one| *one == name).map(|index| index as u32)
}

impl Client {
    /// Sets bones of the pose that a walker is given: each a number (see [`bone`]) and
    /// `parent_from_bone`. Those that nobody sets are as at rest, where a bone's axes are the
    /// actor's. What shows of the pose is said by [`Client::blend_pose`]. One who lies, or is no
    /// walker, is refused, and so is a bone that is not there.
    pub fn set_bones(
        &mut self,
        actor_id: ActorId,
        bones: &[(u32, Pose)],
    ) -> Result<(), ClientError> {
        let commands = bone_commands(actor_id, bones);
        if commands.is_empty() {
            return Ok(());
        }
        self.request("set_bones", &commands).map(drop)
    }

    /// How much of its given pose a walker shows: 0 its walk alone, 1 the pose alone.
    pub fn blend_pose(&mut self, actor_id: ActorId, share: f32) -> Result<(), ClientError> {
        let command = Command::BlendPose(BlendPose { actor_id, weight: share });
        self.request("blend_pose", &[command]).map(drop)
    }

    /// The pose that a walker was given, `parent_from_bone` of every bone, and how much of it
    /// shows.
    pub fn given_pose(&mut self, actor_id: ActorId) -> Result<(Vec<Pose>, f32), ClientError> {
        let ask = |part, index| Command::Ask(Ask { actor_id, part, index, reserved: 0 });
        let blocks = (0..BONES.len()).step_by(BONES_PER_COMMAND);
        let mut asks = vec![ask(part::BLEND, 0)];
        asks.extend(blocks.map(|first| ask(part::BONES, first as u32)));
        let told = self.try_request("given_pose", &asks)?;
        let refused = |why: &str| ClientError::refused("given_pose", why);
        let blend: BlendPose = told[0].outcome.answered().map_err(refused)?;
        let mut bones = Vec::with_capacity(BONES.len());
        for entry in &told[1..] {
            let set: SetBones = entry.outcome.answered().map_err(refused)?;
            bones.extend(set.bones().map(|(_, pose)| *pose));
        }
        Ok((bones, blend.weight))
    }
}

/// The commands that set bones; see [`Client::set_bones`].
pub fn bone_commands(actor_id: ActorId, bones: &[(u32, Pose)]) -> Vec<Command> {
    let mut bones = bones.to_vec();
    // Of one that is named twice the last holds.
    bones.reverse();
    bones.sort_by_key(|(bone, _)| *bone);
    bones.dedup_by_key(|(bone, _)| *bone);
    SetBones::of(actor_id, &bones).into_iter().map(Command::SetBones).collect()
}
