//! From blueprints to bodies.

use std::{collections::BTreeMap, sync::Arc};

use bus::{ActorId, Pose};
use town::{Blueprint, Kind};

use crate::physics::{
    Class, Physics, PhysicsError, PropModel, VehicleModel, WalkerModel, WheelPlace,
};

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
        is_kinematic: bool,
    ) -> Result<Pose, PhysicsError> {
        let half = blueprint.half_extents_m;
        match blueprint.kind {
            Kind::Vehicle => {
                let model =
                    self.vehicles.entry(index).or_insert_with(|| Arc::new(vehicle(blueprint)));
                physics.spawn_vehicle(id, model, pose, is_kinematic)
            }
            Kind::Walker => {
                let model = WalkerModel {
                    radius_m: half.y.min(0.4 * half.z),
                    height_m: 2.0 * half.z,
                    mass_kg: blueprint.mass_kg.max(1.0),
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

fn vehicle(blueprint: &Blueprint) -> VehicleModel {
    let class = match blueprint.base_type {
        "van" => Class::Van,
        "truck" => Class::Truck,
        "bus" => Class::Bus,
        "motorcycle" => Class::Motorcycle,
        "bicycle" => Class::Bicycle,
        _ => Class::Car,
    };
    let places: Vec<_> = blueprint
        .wheels
        .iter()
        .map(|w| WheelPlace {
            hub_m: w.position_m,
            radius_m: w.radius_m,
            steered: w.steered,
            driven: w.driven,
        })
        .collect();
    VehicleModel::new(
        class,
        blueprint.half_extents_m,
        blueprint.center_m,
        blueprint.mass_kg,
        &places,
    )
}
