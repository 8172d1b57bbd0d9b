//! What a vehicle is made of: every number that the vehicle's motion depends on and that does not
//! change while it drives, with defaults for each class.
//!
//! Vehicle space: x forward, y left, z up, the origin on the ground below the middle of the
//! wheelbase.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::tyre::TyreModel;

/// Standard gravity. Metres per second squared.
pub const GRAVITY_MPS2: f32 = 9.81;

/// The most wheels that a vehicle may have.
pub const WHEELS_MAX: usize = 8;

/// What kind of vehicle, for the defaults.
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
    /// Bicycles, with their rider as the engine.
    Bicycle,
}

impl Class {
    /// Two wheels in line, kept upright by their rider.
    pub fn leans(self) -> bool {
        matches!(self, Class::Motorcycle | Class::Bicycle)
    }
}

/// Where a wheel sits and what it is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelPlace {
    /// Hub in vehicle space, the vehicle standing at rest.
    pub hub_m: Vec3,
    /// Unloaded radius.
    pub radius_m: f32,
    /// Turned by the steering wheel.
    pub steered: bool,
    /// Turned by the engine.
    pub driven: bool,
}

/// One wheel with its suspension, tyre and brake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WheelModel {
    /// Hub in vehicle space, the vehicle standing at rest.
    pub hub_m: Vec3,
    /// Rolling radius.
    pub radius_m: f32,
    /// About the axle.
    pub inertia_kgm2: f32,
    /// Turned by the steering wheel.
    pub steered: bool,
    /// Share of the engine's torque; all wheels' shares sum to 1.
    pub drive_share: f32,
    /// With the brake pedal fully down.
    pub brake_torque_nm: f32,
    /// With the handbrake on.
    pub handbrake_torque_nm: f32,
    /// Force on the ground at rest.
    pub static_load_n: f32,
    /// Spring rate at the wheel. Newtons per metre.
    pub spring_npm: f32,
    /// Damper at the wheel when it moves up into the body. Newton seconds per metre.
    pub bump_damping_nspm: f32,
    /// Damper at the wheel when it moves out.
    pub rebound_damping_nspm: f32,
    /// How far up from rest until the bump stop.
    pub bump_travel_m: f32,
    /// The wheel at the other end of the axle, if there is one.
    pub partner: Option<u8>,
    /// Anti-roll bar: force per metre by which this wheel is higher in the body than its partner.
    pub anti_roll_npm: f32,
    /// Height of the axle's roll centre above ground.
    pub roll_center_m: f32,
    /// How much a wheel leans in at its top, for each metre that it moves up into the body.
    pub camber_radpm: f32,
    /// Of a steered wheel: how far it turns, as a share of what Ackermann's law asks for.
    pub steer_share: f32,
    /// Drag of the bearing. Newton metre seconds per radian.
    pub damping_nmsprad: f32,
    /// Grip, as a multiple of the tyre's.
    pub grip: f32,
    /// The tyre.
    pub tyre: TyreModel,
}

/// What turns the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EngineModel {
    /// Full-throttle torque: pairs of revolutions per minute and newton metres, rising in rpm.
    pub torque_curve: Vec<[f32; 2]>,
    /// The rev limiter.
    pub max_rpm: f32,
    /// Where it idles; 0: it stands when the wheels stand (an electric motor), and needs no clutch.
    pub idle_rpm: f32,
    /// Flywheel and crankshaft.
    pub inertia_kgm2: f32,
    /// Drag with the throttle closed, near standstill. Newton metres.
    pub drag_nm: f32,
    /// Drag that grows with speed, the throttle open. Newton metre seconds per radian.
    pub damping_full_nmsprad: f32,
    /// The same with the throttle closed and a gear in.
    pub damping_geared_nmsprad: f32,
    /// The same with the throttle closed, in neutral.
    pub damping_neutral_nmsprad: f32,
}

impl EngineModel {
    /// Full-throttle torque at an engine speed.
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

/// One forward gear. The gearbox shifts at these shares of the rev limit at half throttle, later
/// with more of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearModel {
    /// Engine turns per turn of the propeller shaft.
    pub ratio: f32,
    /// Below this it shifts down.
    pub down: f32,
    /// Above this it shifts up.
    pub up: f32,
}

/// What stands between the engine and the wheels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GearboxModel {
    /// It shifts by itself unless the driver does.
    pub automatic: bool,
    /// First gear first.
    pub forward: Vec<GearModel>,
    /// The same for reverse; positive.
    pub reverse: f32,
    /// Turns of the propeller shaft per turn of the wheel.
    pub final_drive: f32,
    /// How long the clutch stays open at a shift.
    pub shift_s: f32,
    /// The most torque that the clutch carries, at the engine.
    pub clutch_nm: f32,
    /// Share of the engine's torque that reaches the wheels.
    pub efficiency: f32,
}

/// How a two-wheeler is kept upright.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeanModel {
    /// The most lean to either side.
    pub max_rad: f32,
    /// How fast the rider answers. Radians per second.
    pub frequency_radps: f32,
}

/// Everything about a vehicle that does not change while it drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VehicleModel {
    /// What kind.
    pub class: Class,
    /// With its driver.
    pub mass_kg: f32,
    /// About the centre of mass, about the axes of vehicle space.
    pub inertia_kgm2: Vec3,
    /// Centre of mass in vehicle space.
    pub com_m: Vec3,
    /// Middle of the body's collision box, which ends above the ground.
    pub box_center_m: Vec3,
    /// Half the edges of that box.
    pub box_half_m: Vec3,
    /// Up to [`WHEELS_MAX`].
    pub wheels: Vec<WheelModel>,
    /// What turns the wheels.
    pub engine: EngineModel,
    /// What stands between the engine and the wheels.
    pub gearbox: GearboxModel,
    /// Drag coefficient.
    pub drag_coefficient: f32,
    /// What the air meets.
    pub frontal_m2: f32,
    /// Lift coefficient times frontal area, positive downwards.
    pub downforce_area_m2: f32,
    /// How far the steering wheel turns a wheel in the middle of the front axle.
    pub steer_max_rad: f32,
    /// How fast.
    pub steer_rate_radps: f32,
    /// Share of `steer_max_rad` that is available: pairs of metres per second and share.
    pub steer_curve: Vec<[f32; 2]>,
    /// For two-wheelers.
    pub lean: Option<LeanModel>,
}
