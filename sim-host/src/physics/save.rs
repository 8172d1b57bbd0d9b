//! The physics state as bytes. A restored state continues bit for bit.

use std::{collections::BTreeSet, sync::Arc};

use glam::Vec3;
use rapier3d::prelude::{ColliderHandle, PhysicsWorld, RigidBodyHandle};
use serde::{Deserialize, Serialize};

use super::{
    actor::{Actor, Kind, Teleport},
    actor_list::ActorList,
    collision::Pair,
    digest::digest,
    error::PhysicsError,
    mark,
    model::VehicleModel,
    motion::{Twist, Wrench},
    prop::Prop,
    tuning,
    vehicle::{Prepared, Vehicle, VehicleState},
    walker::Walker,
    world::Physics,
};

/// Version of the layout and meaning of the bytes.
const VERSION: u32 = 8;

#[derive(Serialize, Deserialize)]
struct SavedActor {
    id: u32,
    body: RigidBodyHandle,
    collider: ColliderHandle,
    kinematic: bool,
    kinematic_velocity: Twist,
    acceleration_mps2: Vec3,
    gravity_disabled: bool,
    collisions_disabled: bool,
    external_force: Wrench,
    teleport: Teleport,
    kind: SavedKind,
}

#[derive(Serialize, Deserialize)]
enum SavedKind {
    /// Index of the blueprint's model, changed parameters, state.
    Vehicle(u32, Option<Vec<u8>>, VehicleState),
    Walker(Walker),
    Prop(Prop),
}

#[derive(Serialize, Deserialize)]
struct SavedActors {
    models: Vec<VehicleModel>,
    actors: Vec<SavedActor>,
    touching: BTreeSet<Pair>,
    grip: f32,
}

impl Physics {
    /// Returns everything that decides the future, except the ground and the static boxes: a state
    /// is restored into a world of the same map. The collisions of the last frame are not kept.
    pub fn save(&self) -> Vec<u8> {
        let mut models: Vec<Arc<VehicleModel>> = Vec::new();
        let mut actors = Vec::with_capacity(self.actors.len());
        for actor in self.actors.iter() {
            let kind = match &actor.kind {
                Kind::Vehicle(vehicle) => {
                    let model = &vehicle.own;
                    let known = models.iter().position(|m| Arc::ptr_eq(m, model));
                    let index = known.unwrap_or_else(|| {
                        models.push(Arc::clone(model));
                        models.len() - 1
                    });
                    let tuning = vehicle.tuning.as_ref().map(|tuning| tuning::to_bytes(tuning));
                    SavedKind::Vehicle(index as u32, tuning, vehicle.state.clone())
                }
                Kind::Walker(walker) => SavedKind::Walker(*walker),
                Kind::Prop(prop) => SavedKind::Prop(*prop),
            };
            actors.push(SavedActor {
                id: actor.id,
                body: actor.body,
                collider: actor.collider,
                kinematic: actor.kinematic,
                kinematic_velocity: actor.kinematic_velocity,
                acceleration_mps2: actor.acceleration_mps2,
                gravity_disabled: actor.gravity_disabled,
                collisions_disabled: actor.collisions_disabled,
                external_force: actor.external_force,
                teleport: actor.teleport,
                kind,
            });
        }
        let models = models.iter().map(|m| VehicleModel::clone(m)).collect();
        let rest = SavedActors { models, actors, touching: self.touching.clone(), grip: self.grip };
        let mut bytes = VERSION.to_le_bytes().to_vec();
        bytes =
            postcard::to_extend(&self.world, bytes).expect("the rigid-body world is plain data");
        bytes = postcard::to_extend(&rest, bytes).expect("actors are plain data");
        let sum = digest(&bytes);
        bytes.extend_from_slice(&sum.to_le_bytes());
        bytes
    }

    /// Makes the checksum of saved bytes right.
    pub(crate) fn seal(bytes: &mut [u8]) {
        if let Some((bytes, sum)) = bytes.split_last_chunk_mut::<8>() {
            *sum = digest(bytes).to_le_bytes();
        }
    }

    /// Restores saved bytes.
    ///
    /// # Errors
    ///
    /// The bytes are damaged or of another version; the world is unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), PhysicsError> {
        let damaged = |e: postcard::Error| PhysicsError::Damaged(e.to_string());
        let whole = bytes.split_last_chunk::<8>().filter(|(bytes, _)| bytes.len() >= 4);
        let Some((bytes, sum)) = whole else {
            return Err(PhysicsError::Damaged(format!("only {} bytes", bytes.len())));
        };
        let (version, body) = bytes.split_at(4);
        if version != VERSION.to_le_bytes() {
            return Err(PhysicsError::Damaged(format!("bad version, expected {VERSION}")));
        }
        if digest(bytes).to_le_bytes() != *sum {
            return Err(PhysicsError::Damaged("bad checksum".to_string()));
        }
        let bytes = body;
        let (world, bytes) = postcard::take_from_bytes::<PhysicsWorld>(bytes).map_err(damaged)?;
        let rest: SavedActors = postcard::from_bytes(bytes).map_err(damaged)?;
        rest.models.iter().try_for_each(check_model)?;
        let models: Vec<_> =
            rest.models.into_iter().map(|m| Arc::new(Prepared::new(Arc::new(m)))).collect();
        let mut actors = Vec::with_capacity(rest.actors.len());
        for saved in rest.actors {
            check_body(&world, &saved)?;
            let kind = match saved.kind {
                SavedKind::Vehicle(index, tuning, state) => {
                    let lacks =
                        |what| PhysicsError::Damaged(format!("actor {} has no {what}", saved.id));
                    let prepared = models.get(index as usize).ok_or_else(|| lacks("model"))?;
                    let mut vehicle = Vehicle::new(Arc::clone(prepared));
                    if let Some(bytes) = tuning {
                        let tuning =
                            tuning::from_bytes(&bytes).ok_or_else(|| lacks("valid parameters"))?;
                        vehicle.tune(&tuning);
                    }
                    if !vehicle.takes(&state) {
                        return Err(lacks("valid wheels"));
                    }
                    vehicle.state = state;
                    Kind::Vehicle(vehicle)
                }
                SavedKind::Walker(walker) => Kind::Walker(walker),
                SavedKind::Prop(prop) => Kind::Prop(prop),
            };
            actors.push(Actor {
                id: saved.id,
                body: saved.body,
                collider: saved.collider,
                kinematic: saved.kinematic,
                kind,
                kinematic_velocity: saved.kinematic_velocity,
                acceleration_mps2: saved.acceleration_mps2,
                gravity_disabled: saved.gravity_disabled,
                collisions_disabled: saved.collisions_disabled,
                external_force: saved.external_force,
                teleport: saved.teleport,
                far: None,
                solo: false,
                dormant: world.bodies[saved.body].user_data & mark::DORMANT != 0,
                path: Vec::new(),
            });
        }
        self.world = world;
        self.refresh_statics();
        self.actors = ActorList::new(actors);
        self.active.clear();
        self.touching = rest.touching;
        self.grip = rest.grip;
        self.collisions.clear();
        self.colliding.clear();
        Ok(())
    }
}

/// Checks that the partner of each wheel is a wheel.
fn check_model(model: &VehicleModel) -> Result<(), PhysicsError> {
    let count = model.wheels.len();
    let mut partners = model.wheels.iter().filter_map(|wheel| wheel.partner);
    match partners.find(|partner| usize::from(*partner) >= count) {
        None => Ok(()),
        Some(partner) => Err(PhysicsError::Damaged(format!(
            "a wheel's partner is wheel {partner} of {count} wheels"
        ))),
    }
}

/// Checks that an actor has a body and a collider, and that what moves it is finite.
fn check_body(world: &PhysicsWorld, saved: &SavedActor) -> Result<(), PhysicsError> {
    let damaged = |what: &str| PhysicsError::Damaged(format!("actor {} has {what}", saved.id));
    let body = world.bodies.get(saved.body).ok_or_else(|| damaged("no body"))?;
    world.colliders.get(saved.collider).ok_or_else(|| damaged("no collider"))?;
    let Twist { linear_mps, angular_radps } = saved.kinematic_velocity;
    let Wrench { force_n, torque_nm } = saved.external_force;
    let place = body.translation();
    let moved = [place, body.linvel(), body.angvel(), linear_mps, angular_radps];
    let pushed = [force_n, torque_nm, saved.acceleration_mps2];
    let is_finite = moved.iter().chain(&pushed).all(|vector| vector.is_finite());
    if is_finite && (body.rotation().length_squared() - 1.0).abs() < 1e-2 {
        return Ok(());
    }
    Err(damaged("a body whose pose or motion is not finite"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_s_partner_has_to_be_a_wheel() {
        let mut model = VehicleModel::sedan();
        assert!(check_model(&model).is_ok());
        model.wheels[1].partner = Some(9);
        let told = check_model(&model).unwrap_err().to_string();
        assert!(told.contains("partner is wheel 9 of 4 wheels"), "{told}");
    }
}
