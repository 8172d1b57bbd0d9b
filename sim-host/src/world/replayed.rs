//! Actors that a replay shows.

use glam::Vec3;
use protocol::{ActorId, ActorState, Name, PLACE_MAX_M, Pose, Refusal, WalkerLimbs, flag, kind};

use super::{World, set};
use crate::models::doors_of;

/// Largest distance of a recorded traffic light from the map's own.
const LIGHT_WITHIN_M: f32 = 0.5;

impl World {
    /// Spawns a recorded actor, which only [`World::show`] moves. It keeps its id if the id is
    /// free; otherwise it gets an id after `beyond`.
    pub(crate) fn spawn_shown(
        &mut self,
        recorded: &ActorState,
        beyond: ActorId,
    ) -> Result<ActorId, Refusal> {
        let recorded_id = recorded.actor_id;
        let is_free = recorded_id != ActorId::NONE && self.actors.get(recorded_id).is_none();
        let id = if is_free { recorded_id } else { ActorId(self.last_actor.max(beyond.0) + 1) };
        let blueprint = town::catalogue().get(recorded.blueprint as usize).ok_or_else(|| {
            Refusal::unknown_blueprint(format!(
                "{recorded_id} has unknown blueprint {}",
                recorded.blueprint
            ))
        })?;
        recorded.pose.check(PLACE_MAX_M).map_err(Refusal::out_of_range)?;
        // High above the map, so that an actor at the recorded position does not block the spawn.
        let above = Vec3::Z * (5000.0 + 20.0 * (id.0 % 2000) as f32);
        let pose = Pose::new(recorded.pose.position() + above, recorded.pose.rotation());
        self.models.spawn(
            &mut self.physics,
            id,
            (recorded.blueprint, blueprint),
            &pose,
            flag::KINEMATIC,
        )?;
        self.last_actor = self.last_actor.max(id.0);
        // [`World::show`] opens the doors.
        let state = ActorState { actor_id: id, doors: 0, ..*recorded };
        self.actors.insert(state, Name::default());
        Ok(id)
    }

    /// Sets an actor and its body to a recorded state.
    pub(crate) fn show(&mut self, id: ActorId, recorded: &ActorState, limbs: Option<&WalkerLimbs>) {
        let limbs = limbs.map(|limbs| WalkerLimbs { actor_id: id, ..*limbs });
        let Some(actor) = self.actors.get_mut(id) else { return };
        if recorded.kind == kind::TRAFFIC_LIGHT {
            // Only the map's own traffic light at the recorded position follows the recording.
            let (here, there) = (actor.pose.position(), recorded.pose.position());
            if actor.kind == kind::TRAFFIC_LIGHT && here.distance(there) < LIGHT_WITHIN_M {
                (actor.phase, actor.flags) = (recorded.phase, recorded.flags);
            }
            return;
        }
        let moves_doors = actor.doors != recorded.doors;
        *actor = ActorState { actor_id: id, ..*recorded };
        if moves_doors && let Some(blueprint) = town::catalogue().get(recorded.blueprint as usize) {
            // Only vehicles have doors; for other actors this is refused and nothing changes.
            let _ = self.physics.set_doors(id, &doors_of(blueprint, recorded.doors), true);
        }
        self.actors.set_limbs(id, limbs);
        // Every shown actor has a body.
        let _ = self.physics.teleport(id, &recorded.pose);
    }

    /// Ends the replay of an actor: vehicles continue under traffic, walkers stop.
    pub(crate) fn release(&mut self, id: ActorId) {
        let Some(actor) = self.actors.get_mut(id) else { return };
        let (linear, turn) = (actor.velocity_mps, actor.angular_velocity_radps);
        actor.flags &= !flag::KINEMATIC;
        let is_vehicle = actor.kind == kind::VEHICLE;
        set(&mut actor.flags, flag::AUTOPILOT, is_vehicle);
        let [linear, turn] =
            [linear, turn].map(|v| if is_vehicle { Vec3::from_array(v) } else { Vec3::ZERO });
        // A client may have destroyed the actor; then there is nothing to release.
        let _ = self.physics.set_kinematic(id, false);
        let _ = self.physics.set_velocity(id, linear, turn);
    }
}
