//! Vehicle models of blueprints.

use town::Blueprint;

use super::model::{Class, VehicleModel, WheelPlace};

impl VehicleModel {
    /// Returns the model of a blueprint of kind [`town::Kind::Vehicle`].
    pub fn of(blueprint: &Blueprint) -> VehicleModel {
        let class = match blueprint.base_type {
            "van" => Class::Van,
            "truck" => Class::Truck,
            "bus" => Class::Bus,
            "motorcycle" => Class::Motorcycle,
            "bicycle" => Class::Bicycle,
            _ => Class::Car,
        };
        let places: Vec<WheelPlace> = blueprint
            .wheels
            .iter()
            .map(|wheel| WheelPlace {
                hub_m: wheel.position_m,
                radius_m: wheel.radius_m,
                steered: wheel.steered,
                driven: wheel.driven,
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
}
