//! Poses that clients set on walkers.

use protocol::{ActorId, BONES_PER_COMMAND, BlendPose, Refusal, SetBones, flag, kind};

use super::{World, set};

impl World {
    /// Checks that a walker has these bones.
    pub(crate) fn check_bones(&self, to: &SetBones) -> Result<(), Refusal> {
        let id = to.actor_id;
        let skeleton = self.standing_walker(id)?;
        let last = to.first.saturating_add(to.count);
        if !(1..=BONES_PER_COMMAND as u32).contains(&to.count)
            || last as usize > skeleton.bones.len()
        {
            return Err(Refusal::not_found(format!(
                "bones {} to {last} of {id}: it has {}, and one command sets 1 to {BONES_PER_COMMAND}",
                to.first,
                skeleton.bones.len()
            )));
        }
        Ok(())
    }

    /// Checks that a walker can show a set pose.
    pub(crate) fn check_blend(&self, to: &BlendPose) -> Result<(), Refusal> {
        self.standing_walker(to.actor_id).map(drop)
    }

    /// Marks a walker as showing its set pose.
    pub(crate) fn set_posed(&mut self, id: ActorId, on: bool) {
        if let Some(actor) = self.actors.get_mut(id) {
            set(&mut actor.flags, flag::POSED, on);
        }
    }

    fn standing_walker(&self, id: ActorId) -> Result<&'static town::Skeleton, Refusal> {
        let skeleton = self.walker(id)?;
        if self.actor(id)?.has(flag::FALLEN) {
            return Err(Refusal::wrong_state(format!("{id} has fallen and lies on the ground")));
        }
        Ok(skeleton)
    }

    /// Returns the skeleton of a walker.
    pub(super) fn walker(&self, id: ActorId) -> Result<&'static town::Skeleton, Refusal> {
        let state = self.actor(id)?;
        let skeleton = town::catalogue()[state.blueprint as usize].skeleton();
        skeleton.filter(|_| state.kind == kind::WALKER).ok_or_else(|| {
            Refusal::wrong_kind(format!("{id} is not a walker; it has no bones to set"))
        })
    }
}
