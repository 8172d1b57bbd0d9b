//! What a vehicle is built like, as clients read and change it, and what its wheels feel.
//!
//! Each part is a command of its own and fits into one outcome, so that it is also what
//! [`crate::Command::Ask`] answers. `check` says what is wrong with a part's numbers; the host asks it
//! too.

use bytemuck::{Pod, Zeroable};

use crate::{ActorId, Command};

/// The most points of a [`Curve`].
pub const CURVE_POINTS_MAX: usize = 16;
/// The most forward gears.
pub const GEARS_MAX: usize = 12;

/// Pairs, rising in their first number; linear between them, constant beyond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Curve {
    /// How many of `points` there are.
    pub count: u32,
    /// The others are zero.
    pub points: [[f32; 2]; CURVE_POINTS_MAX],
}

impl Curve {
    /// From pairs; `None` if they are more than [`CURVE_POINTS_MAX`].
    pub fn new(pairs: &[[f32; 2]]) -> Option<Curve> {
        let mut points = [[0.0; 2]; CURVE_POINTS_MAX];
        points.get_mut(..pairs.len())?.copy_from_slice(pairs);
        Some(Curve { count: pairs.len() as u32, points })
    }

    /// The pairs.
    pub fn pairs(&self) -> &[[f32; 2]] {
        &self.points[..(self.count as usize).min(CURVE_POINTS_MAX)]
    }

    fn check(&self, what: &str, most: [f32; 2]) -> Result<(), String> {
        let pairs = self.pairs();
        if pairs.is_empty() || self.count as usize > CURVE_POINTS_MAX {
            return Err(format!("{what} has {} points, not 1 to {CURVE_POINTS_MAX}", self.count));
        }
        for [at, value] in pairs {
            within(&format!("{what}'s place"), *at, 0.0, most[0])?;
            within(&format!("{what}'s value"), *value, 0.0, most[1])?;
        }
        if let Some(pair) = pairs.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
            return Err(format!("{what} goes from {} to {}, not up", pair[0][0], pair[1][0]));
        }
        Ok(())
    }
}

/// See [`Command::SetBody`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleBody {
    /// Whose.
    pub actor_id: ActorId,
    /// How many wheels it has: what cannot be changed.
    pub wheels: u32,
    /// With its driver; inertia and suspension follow.
    pub mass_kg: f32,
    /// Of the air, about its frontal area.
    pub drag_coefficient: f32,
    /// From the blueprint's own centre of mass, in vehicle space.
    pub center_of_mass_m: [f32; 3],
    /// CARLA's `use_sweep_wheel_collision`: kept, and without effect; wheels are discs anyway.
    pub sweep: u32,
}

impl VehicleBody {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        within("mass_kg", self.mass_kg, 1.0, 200_000.0)?;
        within("drag_coefficient", self.drag_coefficient, 0.0, 10.0)?;
        each("center_of_mass_m", &self.center_of_mass_m, -5.0, 5.0)
    }
}

/// See [`Command::SetEngine`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleEngine {
    /// Whose.
    pub actor_id: ActorId,
    /// The rev limiter.
    pub max_rpm: f32,
    /// Flywheel and crankshaft.
    pub inertia_kgm2: f32,
    /// Drag with the throttle open. Newton metre seconds per radian.
    pub damping_full_nmsprad: f32,
    /// The same with the throttle shut and a gear in.
    pub damping_geared_nmsprad: f32,
    /// The same with the throttle shut, in neutral.
    pub damping_neutral_nmsprad: f32,
    /// Full-throttle torque in newton metres over revolutions per minute.
    pub torque: Curve,
}

impl VehicleEngine {
    /// What is wrong with it.
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
    /// Engine turns per turn of the propeller shaft.
    pub ratio: f32,
    /// Below this share of `max_rpm` the gearbox shifts down, at half throttle.
    pub down: f32,
    /// Above this share it shifts up, at half throttle.
    pub up: f32,
}

/// See [`Command::SetGearbox`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleGearbox {
    /// Whose.
    pub actor_id: ActorId,
    /// 1: it shifts by itself; 0: the driver alone shifts.
    pub automatic: u32,
    /// How long the clutch stays open at a shift.
    pub shift_s: f32,
    /// The most torque that the clutch carries, at the engine.
    pub clutch_nm: f32,
    /// Turns of the propeller shaft per turn of the wheel.
    pub final_drive: f32,
    /// How many of `forward` there are.
    pub count: u32,
    /// First gear first; the others are zero.
    pub forward: [Gear; GEARS_MAX],
}

impl VehicleGearbox {
    /// Takes these gears; `None` if they are more than [`GEARS_MAX`].
    pub fn with_gears(mut self, gears: &[Gear]) -> Option<VehicleGearbox> {
        self.forward = [Gear::default(); GEARS_MAX];
        self.forward.get_mut(..gears.len())?.copy_from_slice(gears);
        self.count = gears.len() as u32;
        Some(self)
    }

    /// The gears.
    pub fn gears(&self) -> &[Gear] {
        &self.forward[..(self.count as usize).min(GEARS_MAX)]
    }

    /// What is wrong with it.
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

/// See [`Command::SetSteering`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleSteering {
    /// Whose.
    pub actor_id: ActorId,
    /// Share of the wheels' largest angle that is available, over metres per second.
    pub share: Curve,
}

impl VehicleSteering {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        self.share.check("the steering curve", [1000.0, 1.0])
    }
}

/// See [`Command::SetWheel`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VehicleWheel {
    /// Whose.
    pub actor_id: ActorId,
    /// Which, in the blueprint's order.
    pub index: u32,
    /// Hub in vehicle space: what cannot be changed.
    pub hub_m: [f32; 3],
    /// Grip, as a multiple of the blueprint's own tyre's.
    pub grip: f32,
    /// Drag of the bearing. Newton metre seconds per radian.
    pub damping_nmsprad: f32,
    /// The furthest that the steering turns it, or would in the middle of its axle; 0: it is not
    /// steered.
    pub steer_max_rad: f32,
    /// Rolling radius.
    pub radius_m: f32,
    /// With the brake pedal fully down.
    pub brake_torque_nm: f32,
    /// With the handbrake on.
    pub handbrake_torque_nm: f32,
    /// Above this multiple of the load at rest, the force across per slip grows no more.
    pub stiff_load: f32,
    /// Force across for small slip: per radian of slip angle and newton of load.
    pub stiffness_y: f32,
    /// Force along for small slip: per unit of slip and newton of load.
    pub stiffness_x: f32,
}

impl VehicleWheel {
    /// What is wrong with it.
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

/// All that can be read and changed of how a vehicle is built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VehiclePhysics {
    /// Mass, air, centre of mass.
    pub body: VehicleBody,
    /// What turns the wheels.
    pub engine: VehicleEngine,
    /// What stands in between.
    pub gearbox: VehicleGearbox,
    /// How far the wheel turns at speed.
    pub steering: VehicleSteering,
    /// In the blueprint's order.
    pub wheels: Vec<VehicleWheel>,
}

impl VehiclePhysics {
    /// What is wrong with it.
    pub fn check(&self) -> Result<(), String> {
        self.body.check()?;
        self.engine.check()?;
        self.gearbox.check()?;
        self.steering.check()?;
        if self.wheels.len() != self.body.wheels as usize {
            return Err(format!(
                "there are {} wheels; the vehicle has {}",
                self.wheels.len(),
                self.body.wheels
            ));
        }
        for wheel in &self.wheels {
            wheel.check().map_err(|why| format!("wheel {}: {why}", wheel.index))?;
        }
        Ok(())
    }

    /// The commands that make a vehicle so.
    pub fn commands(&self, actor_id: ActorId) -> Vec<Command> {
        let mut commands = vec![
            Command::SetBody(VehicleBody { actor_id, ..self.body }),
            Command::SetEngine(VehicleEngine { actor_id, ..self.engine }),
            Command::SetGearbox(VehicleGearbox { actor_id, ..self.gearbox }),
            Command::SetSteering(VehicleSteering { actor_id, ..self.steering }),
        ];
        for (index, wheel) in (0..).zip(&self.wheels) {
            commands.push(Command::SetWheel(VehicleWheel { actor_id, index, ..*wheel }));
        }
        commands
    }
}

/// That a number lies in its range, or which, what, and what it should be.
pub(crate) fn within(what: &str, value: f32, low: f32, high: f32) -> Result<(), String> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(format!("{what} is {value}, not {low} to {high}"))
}

fn each(what: &str, values: &[f32], low: f32, high: f32) -> Result<(), String> {
    values.iter().try_for_each(|value| within(what, *value, low, high))
}
