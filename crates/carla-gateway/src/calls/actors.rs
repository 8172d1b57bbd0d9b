//! Actors come and go.

use client_lib::{ActorId, Autopilot, Command, Pose, Spawn};

use super::Call;
use crate::{
    args::Refusal,
    blueprints,
    bridge::Bridge,
    cast::{Cast, SPECTATOR},
    sensor::Sensor,
    wire::{Description, transform},
};

pub(super) fn definitions(call: &mut Call) -> Result<(), Refusal> {
    let all = blueprints::definitions();
    call.out.list(all.len());
    all.iter().for_each(|definition| definition.write(call.out));
    Ok(())
}

pub(super) fn spectator(call: &mut Call) -> Result<(), Refusal> {
    let spectator = call.bridge.cast.known(SPECTATOR).ok_or("there is no spectator")?;
    spectator.write(call.out);
    Ok(())
}

/// Unknown ones are left out.
pub(super) fn by_id(call: &mut Call) -> Result<(), Refusal> {
    let mut list = call.args.list()?;
    let mut found = Vec::new();
    while list.len() > 0 {
        let id = list.u32()?;
        let Bridge { cast, client, .. } = &mut *call.bridge;
        found.extend(cast.actor(id, client.world(), client.blueprints()).cloned());
    }
    call.out.list(found.len());
    found.iter().for_each(|actor| actor.write(call.out));
    Ok(())
}

pub(super) fn bounding_box(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    let Bridge { cast, client, .. } = &mut *call.bridge;
    let actor = cast.actor(id, client.world(), client.blueprints());
    actor.ok_or_else(|| unknown("get_actor_bounding_box", id))?.bounds.write(call.out);
    Ok(())
}

/// CARLA's words for an id that names nobody.
pub(super) fn unknown(function: &str, id: u32) -> Refusal {
    Refusal(format!(
        "Responding error from function {function}: Actor could not be found in the registry.  Actor Id: {id}"
    ))
}

pub(super) fn spawn(call: &mut Call, with_parent: bool) -> Result<(), Refusal> {
    let description = Description::read(&mut call.args)?;
    let pose = transform(&mut call.args)?;
    let parent = if with_parent { call.args.u32()? } else { 0 };
    let id = call.bridge.spawn(description, pose, parent)?;
    call.bridge.cast.known(id).ok_or("it is gone already")?.write(call.out);
    Ok(())
}

pub(super) fn destroy(call: &mut Call) -> Result<(), Refusal> {
    let id = call.args.u32()?;
    call.bridge.destroy(id)?;
    call.out.bool(true);
    Ok(())
}

impl Bridge {
    /// Puts an actor into the world, or a sensor onto one.
    pub(crate) fn spawn(
        &mut self,
        description: Description,
        pose: Pose,
        parent: u32,
    ) -> Result<u32, Refusal> {
        if blueprints::definition(&description.id).is_none() {
            return Err("Spawn failed because of invalid actor description".into());
        }
        if parent != 0 && !self.cast.own.contains_key(&parent) && !self.is_there(parent) {
            return Err(unknown("spawn_actor_with_parent", parent));
        }
        if description.id.starts_with("sensor.") {
            let stream = self.cast.next_stream();
            let sensor = Sensor::new(description.clone(), stream)?;
            return Ok(self.cast.add_own(description, parent, pose, Some(Box::new(sensor))));
        }
        if description.id.starts_with("controller.") {
            return Ok(self.cast.add_own(description, parent, pose, None));
        }
        if parent != 0 {
            let id = &description.id;
            return Err(
                format!("{id} cannot be attached: only sensors can in this simulator").into()
            );
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
        }
        if description.get("is_invincible") == Some("false") {
            spawn = spawn.ragdoll_on_hit();
        }
        let id = self.request_one("spawn", spawn.command()).map_err(spawn_refusal)?;
        let infos = self.client.blueprints();
        if let Some(info) = infos.iter().find(|info| info.id == description.id) {
            self.cast.add(id, description, info);
        }
        self.note_spawned(id, pose);
        Ok(id)
    }

    /// Takes an actor out of the world, and what is mounted on it.
    pub(crate) fn destroy(&mut self, id: u32) -> Result<(), Refusal> {
        if id == SPECTATOR {
            return Err("the spectator cannot be destroyed".into());
        }
        if !Cast::is_own(id) {
            let not_found = |_| Refusal::from("unable to destroy actor: not found");
            self.request_one("destroy", Command::Destroy(ActorId(id))).map_err(not_found)?;
        } else if !self.cast.own.contains_key(&id) {
            return Err("unable to destroy actor: not found".into());
        }
        for own in self.cast.remove(id) {
            if let Some(bundle) = own.sensor.and_then(|sensor| sensor.bundle) {
                self.drop_rig(bundle);
            }
        }
        Ok(())
    }

    /// Lets traffic drive a vehicle, or its client.
    pub(crate) fn set_autopilot(&mut self, id: u32, on: bool) -> Result<(), Refusal> {
        let command = Command::Autopilot(Autopilot { actor_id: ActorId(id), on: on.into() });
        self.request_one("autopilot", command).map(drop)
    }
}

/// Scripts look for CARLA's words.
fn spawn_refusal(Refusal(why): Refusal) -> Refusal {
    if why.contains("would stand in") {
        return "Spawn failed because of collision at spawn position".into();
    }
    Refusal(why)
}

/// `r,g,b`.
fn color(text: &str) -> Option<[u8; 3]> {
    let numbers: Option<Vec<u8>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}
