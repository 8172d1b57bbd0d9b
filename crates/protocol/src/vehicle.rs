//! The physics parameters of a vehicle, as clients read and change them.
//!
//! Each part is set by a command of its own and is also the response to a [`crate::Query`]. The
//! host and the clients both validate the numbers with `check`.

use bytemuck::{Pod, Zeroable};

use crate::{
    ActorId,
    range::{each, within},
};

/// The most points of a [`Curve`].
pub const CURVE_POINTS_MAX: usize = 16;
/// The most forward gears.
pub const GEARS_MAX: usize = 12;

/// A piecewise linear function: points with increasing first coordinates; constant beyond its ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Curve {
    /// Number of valid `points`.
    pub count: u32,
    /// The points; the rest are zero.
    pub points: [[f32; 2]; CURVE_POINTS_MAX],
}

impl Curve {
    /// A curve through these points; `None` for more than [`CURVE_POINTS_MAX`].
    pub fn new(pairs: &[[f32; 2]]) -> Option<Curve> {
        let mut points = [[0.0; 2]; CURVE_POINTS_MAX];
        points.get_mut(..pairs.len())?.copy_from_slice(pairs);
        Some(Curve { count: pairs.len() as u32, points })
    }

    /// The points.
    pub fn pairs(&self) -> &[[f32; 2]] {
        &self.points[..(self.count as usize).min(CURVE_POINTS_MAX)]
    }

    fn check(&self, what: &str, most: [f32; 2]) -> Result<(), String> {
        let pairs = self.pairs();
        if pairs.is_empty() || self.count as usize > CURVE_POINTS_MAX {
            return Err(format!("{what} has {} points, not 1 to {CURVE_POINTS_MAX}", self.count));
        }
        for [at, value] in pairs {
            within(&format!("{what}'s argument"), *at, 0.0, most[0])?;
            within(&format!("{what}'s value"), *value, 0.0, most[1])?;
        }
        if let Some(pair) = pairs.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return Err(format!(
                "{what} has arguments {} and {}, which do not increase",
                pair[0][0], pair[1][0]
            ));
        }
        Ok(())
    }
}

/// Parameters of [`crate::Command::SetBody`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleBody {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Number of wheels; read-only.
    pub wheels: u32,
    /// Mass including the driver; inertia and suspension scale with it.
    pub mass_kg: f32,
    /// Drag coefficient, relative to the frontal area.
    pub drag_coefficient: f32,
    /// Offset from the blueprint's centre of mass in vehicle space.
    pub center_of_mass_m: [f32; 3],
    /// CARLA's `use_sweep_wheel_collision`: stored without effect, because wheels are always discs.
    pub sweep: u32,
    /// 1: anti-lock brakes are on; 0: off.
    pub abs: u32,
    /// 1: electronic stability control is on; 0: off.
    pub stability_control: u32,
}

impl VehicleBody {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        within("mass_kg", self.mass_kg, 1.0, 200_000.0)?;
        within("drag_coefficient", self.drag_coefficient, 0.0, 10.0)?;
        each("center_of_mass_m", &self.center_of_mass_m, -5.0, 5.0)
    }
}

/// Parameters of [`crate::Command::SetEngine`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleEngine {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Speed of the rev limiter.
    pub max_rpm: f32,
    /// Moment of inertia of flywheel and crankshaft.
    pub inertia_kgm2: f32,
    /// Damping with the throttle open, N m s/rad.
    pub damping_full_nmsprad: f32,
    /// Damping with the throttle closed and a gear engaged, N m s/rad.
    pub damping_geared_nmsprad: f32,
    /// Damping with the throttle closed in neutral, N m s/rad.
    pub damping_neutral_nmsprad: f32,
    /// Torque at full throttle in N m over revolutions per minute.
    pub torque: Curve,
}

impl VehicleEngine {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        within("max_rpm", self.max_rpm, 10.0, 100_000.0)?;
        within("inertia_kgm2", self.inertia_kgm2, 1e-4, 1e3)?;
        let damping =
            [self.damping_full_nmsprad, self.damping_geared_nmsprad, self.damping_neutral_nmsprad];
        each("damping_nmsprad", &damping, 0.0, 100.0)?;
        self.torque.check("the torque curve", [100_000.0, 100_000.0])
    }
}

/// One forward gear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Gear {
    /// Revolutions of the engine per revolution of the propeller shaft.
    pub ratio: f32,
    /// Fraction of `max_rpm` below which the gearbox shifts down at half throttle.
    pub down: f32,
    /// Fraction of `max_rpm` above which the gearbox shifts up at half throttle.
    pub up: f32,
}

/// Parameters of [`crate::Command::SetGearbox`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleGearbox {
    /// The vehicle.
    pub actor_id: ActorId,
    /// 1: automatic; 0: manual.
    pub automatic: u32,
    /// Time for which the clutch is open during a shift.
    pub shift_s: f32,
    /// Largest torque of the clutch, at the engine.
    pub clutch_nm: f32,
    /// Revolutions of the propeller shaft per revolution of the wheel.
    pub final_drive: f32,
    /// Number of valid entries of `forward`.
    pub count: u32,
    /// Forward gears, first gear first; the rest are zero.
    pub forward: [Gear; GEARS_MAX],
}

impl VehicleGearbox {
    /// Replaces the forward gears; `None` for more than [`GEARS_MAX`].
    pub fn with_gears(mut self, gears: &[Gear]) -> Option<VehicleGearbox> {
        self.forward = [Gear::default(); GEARS_MAX];
        self.forward.get_mut(..gears.len())?.copy_from_slice(gears);
        self.count = gears.len() as u32;
        Some(self)
    }

    /// The forward gears.
    pub fn gears(&self) -> &[Gear] {
        &self.forward[..(self.count as usize).min(GEARS_MAX)]
    }

    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        within("shift_s", self.shift_s, 0.0, 60.0)?;
        within("clutch_nm", self.clutch_nm, 1.0, 1e6)?;
        within("final_drive", self.final_drive, 0.01, 200.0)?;
        if self.gears().is_empty() || self.count as usize > GEARS_MAX {
            return Err(format!("there are {} gears, not 1 to {GEARS_MAX}", self.count));
        }
        for gear in self.gears() {
            within("a gear's ratio", gear.ratio, 0.01, 100.0)?;
            within("a gear's down", gear.down, 0.0, 2.0)?;
            within("a gear's up", gear.up, 0.0, 2.0)?;
        }
        Ok(())
    }
}

/// Parameters of [`crate::Command::SetSteering`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleSteering {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Available fraction of the largest steering angle over the speed in m/s.
    pub share: Curve,
}

impl VehicleSteering {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        self.share.check("the steering curve", [1000.0, 1.0])
    }
}

/// Parameters of [`crate::Command::SetWheel`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleWheel {
    /// The vehicle.
    pub actor_id: ActorId,
    /// Index of the wheel in the blueprint's order.
    pub index: u32,
    /// Position of the hub in vehicle space; read-only.
    pub hub_m: [f32; 3],
    /// Friction relative to the blueprint's tyre.
    pub grip: f32,
    /// Damping of the bearing, N m s/rad.
    pub damping_nmsprad: f32,
    /// Largest steering angle, at the centre of the axle; 0: not steered.
    pub steer_max_rad: f32,
    /// Rolling radius.
    pub radius_m: f32,
    /// Brake torque with the pedal fully pressed.
    pub brake_torque_nm: f32,
    /// Brake torque of the handbrake.
    pub handbrake_torque_nm: f32,
    /// Multiple of the load at rest above which the lateral stiffness no longer grows.
    pub stiff_load: f32,
    /// Lateral stiffness: force per radian of slip angle and newton of load, for small slip.
    pub stiffness_y: f32,
    /// Longitudinal stiffness: force per unit of slip and newton of load, for small slip.
    pub stiffness_x: f32,
}

impl VehicleWheel {
    /// Checks that every number is in its range; the error names the first that is not.
    pub fn check(&self) -> Result<(), String> {
        within("grip", self.grip, 0.0, 100.0)?;
        within("damping_nmsprad", self.damping_nmsprad, 0.0, 1000.0)?;
        within("steer_max_rad", self.steer_max_rad, 0.0, 1.5)?;
        within("radius_m", self.radius_m, 0.05, 3.0)?;
        within("brake_torque_nm", self.brake_torque_nm, 0.0, 1e6)?;
        within("handbrake_torque_nm", self.handbrake_torque_nm, 0.0, 1e6)?;
        within("stiff_load", self.stiff_load, 0.01, 1000.0)?;
        within("stiffness_y", self.stiffness_y, 0.01, 1000.0)?;
        within("stiffness_x", self.stiffness_x, 0.01, 1000.0)
    }
}
