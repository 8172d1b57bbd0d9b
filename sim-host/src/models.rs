//! From blueprints to bodies.

use std::{collections::BTreeMap, sync::Arc};

use bus::{ActorId, Pose};
use town::{Blueprint, Kind};

use crate::physics::{Physics, PhysicsError, PropModel, VehicleModel, WalkerModel};

/// The vehicle models of the blueprints that were spawned so far.
#[derive(Default)]
pub(crate) struct Models {
    vehicles: BTreeMap<u32, Arc<VehicleModel>>,
}

impl Models {
    /// Puts a blueprint's body into the world; says where it stands.
    pub(crate) fn spawn(
        &mut self,
        physics: &mut Physics,
        id: ActorId,
        (index, blueprint): (u32, &Blueprint),
        pose: &Pose,
        (is_kinematic, is_frail): (bool, bool),
    ) -> Result<Pose, PhysicsError> {
        let half = blueprint.half_extents_m;
        match blueprint.kind {
            Kind::Vehicle => {
                let model = self
                    .vehicles
                    .entry(index)
                    .or_insert_with(|| Arc::new(VehicleModel::of(blueprint)));
                physics.spawn_vehicle(id, model, pose, is_kinematic)
            }
            Kind::Walker => {
                let model = WalkerModel {
                    radius_m: half.y.min(0.4 * half.z),
                    height_m: 2.0 * half.z,
                    mass_kg: blueprint.mass_kg.max(1.0),
                    is_frail,
                };
                physics.spawn_walker(id, model, pose)
            }
            Kind::Prop | Kind::TrafficLight => {
                let mass_kg = blueprint.mass_kg.max(1.0);
                physics.spawn_prop(
                    id,
                    PropModel { half_extents_m: half, mass_kg },
                    pose,
                    is_kinematic,
                )
            }
        }
    }
}
