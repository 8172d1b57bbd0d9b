//! Vehicle models of blueprints.

use town::Blueprint;

use super::{
    fleet::{self, Aids, Fittings, Power},
    model::{Class, EngineModel, GearModel, GearboxModel, VehicleModel, WheelPlace},
    powertrain,
};

/// The tyres of a vehicle have so many times the grip of its full braking: with anti-lock brakes, a
/// full brake uses nearly all of it.
const GRIP_WITH_ABS: f32 = 0.98;
/// Without anti-lock brakes, the brakes do not lock the wheels of an evenly loaded vehicle.
const GRIP_WITHOUT: f32 = 1.12;
/// Brake torque beyond that of the published deceleration, which anti-lock brakes do not use.
const SPARE_TORQUE: f32 = 1.12;
/// Gearboxes with more gears shift without opening their clutch for long.
const SLOW_GEARS_MAX: usize = 6;
const FAST_SHIFT_S: f32 = 0.1;
/// Highest speed of electric motors.
const MOTOR_RPM: f32 = 16_000.0;

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
        let model = VehicleModel::new(
            class,
            blueprint.half_extents_m,
            blueprint.center_m,
            blueprint.mass_kg,
            &places,
        );
        match fleet::of(blueprint.id) {
            Some(fittings) => model.fitted(fittings),
            None => model,
        }
    }

    /// Replaces what a row of the fleet describes.
    pub(super) fn fitted(mut self, fittings: &Fittings) -> VehicleModel {
        let radius_m = self.wheels.iter().map(|w| w.radius_m).sum::<f32>();
        let radius_m = radius_m / self.wheels.len().max(1) as f32;
        let top_radps = fittings.top_kmh / 3.6 / radius_m;
        match fittings.power {
            Power::Combustion { power_kw, max_rpm, gears } => {
                let idle = self.engine.idle_rpm;
                let last = gears.last().copied().unwrap_or(1.0);
                self.engine = powertrain::combustion_of_power(1e3 * power_kw, max_rpm, idle);
                let final_drive = max_rpm / powertrain::RPM_PER_RADPS / (1.02 * top_radps * last);
                let peak_nm = self.engine.peak_nm();
                let many = gears.len() > SLOW_GEARS_MAX;
                let shift_s = if many { FAST_SHIFT_S } else { self.gearbox.shift_s };
                let reverse = gears[0];
                self.gearbox = powertrain::gearbox(gears, reverse, final_drive, shift_s, peak_nm);
            }
            Power::Electric { power_kw, base_mps } => {
                let ratio = MOTOR_RPM / powertrain::RPM_PER_RADPS / (1.02 * top_radps);
                let base_rpm = base_mps / radius_m * ratio * powertrain::RPM_PER_RADPS;
                self.engine = powertrain::electric(1e3 * power_kw, base_rpm, MOTOR_RPM);
                self.gearbox = GearboxModel {
                    forward: vec![GearModel { ratio: 1.0, down: 0.0, up: 2.0 }],
                    ..powertrain::gearbox(&[1.0], 1.0, ratio, 0.0, self.engine.peak_nm())
                };
            }
            Power::Rider => {}
        }
        self.drag_coefficient = fittings.drag_coefficient;
        self.frontal_m2 = fittings.frontal_m2;
        self.abs = fittings.aids != Aids::None;
        self.stability_control = fittings.aids == Aids::Esc;
        if self.class.leans() || matches!(self.class, Class::Truck | Class::Bus) {
            // Their brakes are weaker than their tyres: two-wheelers would lift the rear wheel.
            self.brake_with(fittings.braking_g, 1.0);
            return self;
        }
        let grip = fittings.braking_g * if self.abs { GRIP_WITH_ABS } else { GRIP_WITHOUT };
        let torque = if self.abs { SPARE_TORQUE } else { 1.0 };
        self.brake_with(fittings.braking_g, torque);
        for wheel in &mut self.wheels {
            wheel.tyre.grip_x = 1.04 * grip;
            wheel.tyre.grip_y = grip;
        }
        self
    }
}

impl EngineModel {
    /// The largest torque.
    fn peak_nm(&self) -> f32 {
        self.torque_curve.iter().map(|point| point[1]).fold(0.0, f32::max)
    }
}
