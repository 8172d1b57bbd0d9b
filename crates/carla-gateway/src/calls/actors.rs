//! Spawns, destroys and describes actors.

use client_lib::{
    ActorId, Pose, Refusal, RefusalCode, Spawn,
    wire::{Autopilot, Command, SetDead, kind},
};

use crate::{
    args::RpcError,
    blueprints,
    bridge::Bridge,
    calls::call::Call,
    friction::Trigger,
    proxy_actors::{PROXIES_MAX, PROXY_MAX_M, ProxyActors, SPECTATOR},
    sensor::Sensor,
    shared_bridge::LockedBridge,
    wire::{Description, transform},
};

/// Most actors of one question: more than there can be.
const IDS_MAX: usize = 1 << 16;

pub(super) fn spectator(call: &mut Call) -> Result<(), RpcError> {
    let spectator = call.bridge.episode.actors.known(SPECTATOR).ok_or("there is no spectator")?;
    spectator.write(call.out);
    Ok(())
}

/// Returns the actors with these ids; unknown ids are skipped.
pub(super) fn by_id(call: &mut Call) -> Result<(), RpcError> {
    let mut list = call.args.list()?;
    if list.len() > IDS_MAX {
        return Err(format!("{} ids; the most are {IDS_MAX}", list.len()).into());
    }
    let mut found = Vec::new();
    while list.len() > 0 {
        let id = list.u32()?;
        let Bridge { episode, client, .. } = &mut *call.bridge;
        found.extend(episode.actors.actor(id, client.world(), client.blueprints()).cloned());
    }
    call.out.list(found.len());
    found.iter().for_each(|actor| actor.write(call.out));
    Ok(())
}

pub(super) fn bounding_box(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    let Bridge { episode, client, .. } = &mut *call.bridge;
    let actor = episode.actors.actor(id, client.world(), client.blueprints());
    actor.ok_or_else(|| unknown("get_actor_bounding_box", id))?.bounds.write(call.out);
    Ok(())
}

/// Returns CARLA's error for an unknown id.
pub(super) fn unknown(function: &str, id: u32) -> RpcError {
    RpcError(format!(
        "Responding error from function {function}: Actor could not be found in the registry.  Actor Id: {id}"
    ))
}

pub(super) fn spawn(call: &mut Call, with_parent: bool) -> Result<(), RpcError> {
    let description = Description::read(&mut call.args)?;
    let pose = transform(&mut call.args)?;
    let parent = if with_parent { call.args.u32()? } else { 0 };
    let id = call.bridge.spawn(description, pose, parent)?;
    call.bridge
        .episode
        .actors
        .known(id)
        .ok_or("the actor was destroyed before the call returned")?
        .write(call.out);
    Ok(())
}

pub(super) fn destroy(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    call.bridge.destroy(id)?;
    call.out.bool(true);
    Ok(())
}

/// Lets a walker fall and removes its body later, or stops the engine of a vehicle. CARLA's client
/// sends it for a walker that died, and waits for no response.
pub(super) fn set_dead(call: &mut Call) -> Result<(), RpcError> {
    let id = call.args.u32()?;
    if !call.bridge.exists(id) {
        return Err(unknown("set_actor_dead", id));
    }
    let dead = SetDead { actor_id: ActorId(id), removes_body: 1 };
    call.bridge.request_one("set_actor_dead", Command::SetDead(dead)).map(drop)
}

impl LockedBridge<'_> {
    /// Spawns an actor, or creates a sensor on one, and returns its id.
    ///
    /// # Errors
    ///
    /// Returns an error if the blueprint is unknown, an attribute is invalid, or the host refuses
    /// the actor.
    pub(crate) fn spawn(
        &mut self,
        description: Description,
        pose: Pose,
        parent: u32,
    ) -> Result<u32, RpcError> {
        if blueprints::definition(&description.id).is_none() {
            return Err("Spawn failed because of invalid actor description".into());
        }
        if parent != 0 && !self.episode.actors.proxies.contains_key(&parent) && !self.exists(parent)
        {
            return Err(unknown("spawn_actor_with_parent", parent));
        }
        // Clients give the pose in the space of CARLA's actor, which is not the one on the bus.
        let light =
            self.client.world().state(ActorId(parent)).filter(|a| a.kind == kind::TRAFFIC_LIGHT);
        let pose = light.map_or(pose, |light| {
            let in_world = self.episode.actors.light_pose(light).then(&pose);
            let turn = light.pose.rotation().inverse();
            Pose::new(
                turn * (in_world.position() - light.pose.position()),
                turn * in_world.rotation(),
            )
        });
        let is_proxy = ["sensor.", "controller."].iter().any(|of| description.id.starts_with(of))
            || [blueprints::EMPTY, blueprints::FRICTION_TRIGGER].contains(&&*description.id);
        if is_proxy && self.episode.actors.proxies.len() >= PROXIES_MAX {
            return Err(format!(
                "Spawn failed because of too many sensors, controllers and triggers: the most are \
                 {PROXIES_MAX}"
            )
            .into());
        }
        pose.check(PROXY_MAX_M).map_err(|why| format!("{}: {why}", description.id))?;
        if description.id.starts_with("sensor.") {
            let stream = self.streams.next_number();
            let sensor = Sensor::new(description.clone(), stream)?;
            return Ok(self.episode.actors.add_proxy(
                description,
                parent,
                pose,
                Some(Box::new(sensor)),
            ));
        }
        if description.id.starts_with("controller.") || description.id == blueprints::EMPTY {
            return Ok(self.episode.actors.add_proxy(description, parent, pose, None));
        }
        if description.id == blueprints::FRICTION_TRIGGER {
            let trigger = Trigger::new(pose, &description)?;
            let id = self.episode.actors.add_proxy(description, parent, pose, None);
            self.episode.friction.add(id, trigger);
            return Ok(id);
        }
        if parent != 0 {
            let id = &description.id;
            return Err(format!(
                "{id} cannot be attached to a parent: only sensors can in this simulator"
            )
            .into());
        }
        let mut spawn = Spawn::new(&description.id, pose);
        if let Some(color) = description.get("color").and_then(color) {
            spawn = spawn.color(color);
        }
        if let Some(role) = description.get("role_name") {
            spawn = spawn.role(role);
        }
        if description.id.starts_with("static.") {
            spawn = spawn.kinematic();
            if town::blueprint(&description.id).is_some_and(|(_, prop)| prop.is_light()) {
                spawn = spawn.released_on_hit();
            }
        }
        if description.id.starts_with("walker.") {
            let is_invincible = description.get("is_invincible") == Some("true");
            spawn = spawn.ragdoll_on_hit();
            spawn =
                if is_invincible { spawn.gets_up_after_fall() } else { spawn.removed_after_fall() };
        }
        // No snapshot is published before the attributes of its actors are known.
        let _spawn = self.begin_spawn();
        let outcomes = self.request("spawn", &[spawn.wire()])?;
        let outcome = outcomes.first().ok_or("the host returned no outcome")?.outcome;
        let id = outcome.result().map_err(spawn_error)?;
        let Bridge { client, episode, .. } = &mut **self;
        let infos = client.blueprints();
        if let Some(info) = infos.iter().find(|info| info.id == description.id) {
            episode.actors.add(id, description, info);
        }
        self.add_spawned(id, pose);
        Ok(id)
    }

    /// Destroys an actor and the proxies that are attached to it.
    ///
    /// # Errors
    ///
    /// Returns an error if the actor does not exist or is the spectator.
    pub(crate) fn destroy(&mut self, id: u32) -> Result<(), RpcError> {
        self.destroy_all(&[id]).pop().unwrap_or(Ok(()))
    }

    /// Destroys actors as [`LockedBridge::destroy`] does, those of the bus by one request, and
    /// returns the outcome of each.
    pub(crate) fn destroy_all(&mut self, ids: &[u32]) -> Vec<Result<(), RpcError>> {
        let not_found = || Err(RpcError::from("unable to destroy actor: not found"));
        // Those that no snapshot shows are not there, so the host need not be asked.
        let is_asked = |id: &u32| !ProxyActors::is_proxy(*id) && self.exists(*id);
        let asked: Vec<u32> = ids.iter().copied().filter(is_asked).collect();
        let commands: Vec<Command> =
            asked.iter().map(|id| Command::Destroy(ActorId(*id))).collect();
        let answered = self.request("destroy", &commands).unwrap_or_default();
        let mut answered = asked.into_iter().zip(answered).peekable();
        let mut outcomes = Vec::with_capacity(ids.len());
        for id in ids {
            let outcome = match answered.next_if(|(asked, _)| asked == id) {
                _ if *id == SPECTATOR => Err("the spectator cannot be destroyed".into()),
                Some((_, entry)) if entry.outcome.result().is_ok() => Ok(()),
                None if self.episode.actors.proxies.contains_key(id) => Ok(()),
                _ => not_found(),
            };
            if outcome.is_ok() {
                self.episode.vehicles.remove(*id);
                self.episode.friction.remove(*id);
                // Dropped, a sensor's bundle is destroyed.
                drop(self.episode.actors.remove(*id));
            }
            outcomes.push(outcome);
        }
        outcomes
    }

    /// Sets whether traffic or its client drives a vehicle.
    pub(crate) fn set_autopilot(&mut self, id: u32, on: bool) -> Result<(), RpcError> {
        let command = Command::Autopilot(Autopilot { actor_id: ActorId(id), on: on.into() });
        self.request_one("autopilot", command).map(drop)
    }
}

/// Returns a spawn error in CARLA's words, which scripts look for.
fn spawn_error(refusal: Refusal) -> RpcError {
    match refusal.code {
        RefusalCode::SpawnCollision => "Spawn failed because of collision at spawn position".into(),
        _ => refusal.into(),
    }
}

/// Parses a color `r,g,b`.
fn color(text: &str) -> Option<[u8; 3]> {
    let numbers: Option<Vec<u8>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}
