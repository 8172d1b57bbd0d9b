//! The constant parameters of a vehicle.
//!
//! Vehicle space: x forward, y left, z up, the origin on the ground below the middle of the
//! wheelbase.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::tyre::TyreModel;

/// Standard gravity. Metres per second squared.
pub const GRAVITY_MPS2: f32 = 9.81;

/// Largest number of wheels of a vehicle.
pub const WHEELS_MAX: usize = 8;

/// The vehicle class, which selects default parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Class {
    /// Passenger cars.
    Car,
    /// Vans and small trucks.
    Van,
    /// Trucks.
    Truck,
    /// Buses.
    Bus,
    /// Motorcycles and scooters.
    Motorcycle,
    /// Bicycles; the rider is the engine.
    Bicycle,
}

impl Class {
    /// Whether the vehicle has two wheels in line and is kept upright by its rider.
    pub fn leans(self) -> bool {
        matches!(self, Class::Motorcycle | Class::Bicycle)
    }
}

/// The position and function of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelPlace {
    /// Hub in vehicle space, at static load.
    pub hub_m: Vec3,
    /// Unloaded radius.
    pub radius_m: f32,
    /// Whether the steering turns the wheel.
    pub steered: bool,
    /// Whether the engine drives the wheel.
    pub driven: bool,
}

/// A wheel with its suspension, tyre and brake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelModel {
    /// Hub in vehicle space, at static load.
    pub hub_m: Vec3,
    /// Rolling radius.
    pub radius_m: f32,
    /// Moment of inertia about the axle.
    pub inertia_kgm2: f32,
    /// Whether the steering turns the wheel.
    pub steered: bool,
    /// Fraction of the drive torque; the fractions of all wheels sum to 1.
    pub drive_share: f32,
    /// Brake torque with the pedal fully pressed.
    pub brake_torque_nm: f32,
    /// Brake torque with the handbrake applied.
    pub handbrake_torque_nm: f32,
    /// Static wheel load.
    pub static_load_n: f32,
    /// Compression of the suspension at static load, against the hub's place: how the body stands
    /// over its wheels.
    pub stance_m: f32,
    /// Wheel rate of the spring. Newtons per metre.
    pub spring_npm: f32,
    /// Damping at the wheel in compression. Newton seconds per metre.
    pub bump_damping_nspm: f32,
    /// Damping at the wheel in rebound. Newton seconds per metre.
    pub rebound_damping_nspm: f32,
    /// Compression travel from static load to the bump stop.
    pub bump_travel_m: f32,
    /// Index of the wheel at the other end of the axle, if there is one.
    pub partner: Option<u8>,
    /// Rate of the anti-roll bar: force per metre of difference in compression between the wheel
    /// and its partner.
    pub anti_roll_npm: f32,
    /// Height of the roll centre above ground.
    pub roll_center_m: f32,
    /// Camber gain: inclination towards the vehicle per metre of compression. Radians per metre.
    pub camber_radpm: f32,
    /// Steering angle of the wheel as a fraction of the angle of Ackermann geometry.
    pub steer_share: f32,
    /// Viscous friction of the bearing. Newton metre seconds per radian.
    pub damping_nmsprad: f32,
    /// Factor on the friction of the tyre.
    pub grip: f32,
    /// Tyre of the wheel.
    pub tyre: TyreModel,
}

/// The engine, or the electric motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EngineModel {
    /// Full-throttle torque curve: pairs of engine speed in revolutions per minute, rising, and
    /// torque in newton metres.
    pub torque_curve: Vec<[f32; 2]>,
    /// Engine speed of the rev limiter. Revolutions per minute.
    pub max_rpm: f32,
    /// Idle speed; 0 for an electric motor, which stands with the wheels and needs no clutch.
    /// Revolutions per minute.
    pub idle_rpm: f32,
    /// Moment of inertia of flywheel and crankshaft.
    pub inertia_kgm2: f32,
    /// Drag torque with closed throttle near standstill. Newton metres.
    pub drag_nm: f32,
    /// Viscous drag at full throttle. Newton metre seconds per radian.
    pub damping_full_nmsprad: f32,
    /// Viscous drag with closed throttle and a gear engaged. Newton metre seconds per radian.
    pub damping_geared_nmsprad: f32,
    /// Viscous drag with closed throttle in neutral. Newton metre seconds per radian.
    pub damping_neutral_nmsprad: f32,
}

impl EngineModel {
    /// Returns the full-throttle torque at an engine speed. Newton metres.
    pub fn torque_nm(&self, rpm: f32) -> f32 {
        let curve = &self.torque_curve;
        let Some(first) = curve.first() else { return 0.0 };
        if rpm <= first[0] {
            return first[1];
        }
        for pair in curve.windows(2) {
            let [[from, low], [to, high]] = [pair[0], pair[1]];
            if rpm <= to {
                return low + (high - low) * (rpm - from) / (to - from).max(1e-3);
            }
        }
        curve[curve.len() - 1][1]
    }
}

/// One forward gear. The shift points are fractions of the rev limit at half throttle; they rise
/// with the throttle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearModel {
    /// Engine revolutions per revolution of the propeller shaft.
    pub ratio: f32,
    /// Shift-down point.
    pub down: f32,
    /// Shift-up point.
    pub up: f32,
}

/// The gearbox with its clutch and final drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearboxModel {
    /// Whether the gearbox shifts automatically unless the driver does.
    pub automatic: bool,
    /// Forward gears, first gear first.
    pub forward: Vec<GearModel>,
    /// Ratio of the reverse gear, positive.
    pub reverse: f32,
    /// Revolutions of the propeller shaft per wheel revolution.
    pub final_drive: f32,
    /// Time during which the clutch is open in a shift. Seconds.
    pub shift_s: f32,
    /// Torque capacity of the clutch, at the engine.
    pub clutch_nm: f32,
    /// Fraction of the engine torque that reaches the wheels.
    pub efficiency: f32,
}

/// The balance of a two-wheeler.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeanModel {
    /// Largest lean angle to either side.
    pub max_rad: f32,
    /// Natural frequency of the rider's response. Radians per second.
    pub frequency_radps: f32,
}

/// The constant parameters of a vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VehicleModel {
    /// Vehicle class.
    pub class: Class,
    /// Mass with driver.
    pub mass_kg: f32,
    /// Principal moments of inertia about the centre of mass, in vehicle axes.
    pub inertia_kgm2: Vec3,
    /// Centre of mass in vehicle space.
    pub com_m: Vec3,
    /// Centre of the collision box, which ends above the ground.
    pub box_center_m: Vec3,
    /// Half the edges of the collision box.
    pub box_half_m: Vec3,
    /// Wheels, at most [`WHEELS_MAX`].
    pub wheels: Vec<WheelModel>,
    /// Engine or electric motor.
    pub engine: EngineModel,
    /// Gearbox, clutch and final drive.
    pub gearbox: GearboxModel,
    /// Drag coefficient.
    pub drag_coefficient: f32,
    /// Frontal area.
    pub frontal_m2: f32,
    /// Downforce coefficient times frontal area.
    pub downforce_area_m2: f32,
    /// Largest steering angle in the middle of the front axle, positive to the left.
    pub steer_max_rad: f32,
    /// Steering rate. Radians per second.
    pub steer_rate_radps: f32,
    /// Available fraction of `steer_max_rad` by speed: pairs of metres per second and fraction.
    pub steer_curve: Vec<[f32; 2]>,
    /// Balance of a two-wheeler; `None` for other vehicles.
    pub lean: Option<LeanModel>,
    /// Whether anti-lock brakes are on.
    pub abs: bool,
    /// Whether electronic stability control is on.
    pub stability_control: bool,
}
