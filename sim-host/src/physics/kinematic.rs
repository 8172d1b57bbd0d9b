//! The constants of a vehicle whose tyres do not slip and whose suspension does not move.

use glam::Vec3;

use super::{
    aerodynamics::AIR_DENSITY_KGPM3,
    ground::Ground,
    model::{VehicleModel, WheelModel},
};

/// Height above the origin at which the search for the ground below an axle begins.
const STEP_MAX_M: f32 = 0.9;

/// What the kinematic model needs to know of a vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct KinematicModel {
    /// Radius of the driven wheels.
    pub radius_m: f32,
    /// Mass equivalent of the rotating wheels.
    pub rotating_kg: f32,
    /// Forces of the brake with the pedal fully pressed, and of the handbrake.
    pub brake_n: f32,
    pub handbrake_n: f32,
    /// Rolling resistance on level ground.
    pub rolling_n: f32,
    /// Peak longitudinal friction of all tyres at static load.
    pub grip_n: f32,
    /// Drag force per squared speed.
    pub drag_nspm2: f32,
    /// The x of the last and of the first axle.
    axles_m: [f32; 2],
}

impl KinematicModel {
    pub(super) fn new(model: &VehicleModel) -> KinematicModel {
        let sum =
            |value: &dyn Fn(&WheelModel) -> f32| -> f32 { model.wheels.iter().map(value).sum() };
        let radius_m = sum(&|wheel| wheel.drive_share * wheel.radius_m);
        let drag_area_m2 = model.drag_coefficient * model.frontal_m2;
        KinematicModel {
            radius_m: if radius_m > 0.0 { radius_m } else { 0.3 },
            rotating_kg: sum(&|w| w.inertia_kgm2 / (w.radius_m * w.radius_m)),
            brake_n: sum(&|w| w.brake_torque_nm / w.radius_m),
            handbrake_n: sum(&|w| w.handbrake_torque_nm / w.radius_m),
            rolling_n: sum(&|w| w.tyre.rolling_resistance * w.static_load_n),
            grip_n: sum(&|w| w.tyre.grip_x * w.static_load_n),
            drag_nspm2: 0.5 * AIR_DENSITY_KGPM3 * drag_area_m2,
            axles_m: [
                model.wheels.iter().map(|w| w.hub_m.x).fold(f32::INFINITY, f32::min).min(-0.1),
                model.wheels.iter().map(|w| w.hub_m.x).fold(f32::NEG_INFINITY, f32::max).max(0.1),
            ],
        }
    }

    /// Returns the height of the origin and the upward axis of a vehicle that stands on the ground
    /// below `origin`, from the ground below its first and its last axle.
    pub(super) fn plane_below(&self, ground: &Ground, origin: Vec3, heading: Vec3) -> (f32, Vec3) {
        let ahead = heading.with_z(0.0).normalize_or(Vec3::X);
        let hits = self.axles_m.map(|along| {
            let from = origin.z + heading.z * along + STEP_MAX_M;
            ground.below(origin.x + ahead.x * along, origin.y + ahead.y * along, from)
        });
        let [rear, front] = self.axles_m;
        let slope = (hits[1].height_m - hits[0].height_m) / (front - rear);
        let x = ahead + Vec3::Z * slope;
        let normal = hits[0].normal + hits[1].normal;
        // The part of the normal across the heading is the bank of the road.
        let up = (normal - x * (normal.dot(x) / x.length_squared())).normalize_or(Vec3::Z);
        (hits[0].height_m - slope * rear, up)
    }
}
