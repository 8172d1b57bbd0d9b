//! CARLA's `VehiclePhysicsControl`: its numbers, and what they are for a vehicle of ours.
//!
//! Numbers are CARLA's where their meaning is the same: degrees, centimetres, newton metres,
//! kilometres per hour. CARLA's default friction, 3.5, is the friction of the blueprint's tyre.
//! Clutch strength is the torque of the clutch at a slip of 50 rad/s. Longitudinal stiffness is per
//! unit of gravity.
//!
//! A two-wheeler has four wheels here, as in CARLA: each of its wheels is reported as a left and a
//! right one with half of its torques.

use client_lib::{Curve, Gear, Pose, VehiclePhysics, VehicleWheel};
use glam::Vec3;

use crate::{
    args::{Args, RpcError},
    msgpack::Pack,
    wire::flip,
};

/// CARLA's default friction.
pub(crate) const FRICTION: f32 = 3.5;
/// The slip at which clutch strength is measured. Radians per second.
const CLUTCH_SLIP_RADPS: f64 = 50.0;
const KMH_PER_MPS: f64 = 3.6;
const CM_PER_M: f64 = 100.0;

/// The number of wheels that CARLA reports for a vehicle with `wheels`.
pub(crate) fn reported(wheels: usize) -> usize {
    if wheels == 2 { 4 } else { wheels }
}

/// The index of the wheel that CARLA's wheel `index` of a vehicle with `wheels` is.
pub(crate) fn wheel_of(index: usize, wheels: usize) -> usize {
    index * wheels / reported(wheels)
}

/// A `VehiclePhysicsControl` with the numbers that a client sends and reads, without the positions
/// of wheels, which no client sets.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PhysicsControl {
    torque_curve: Vec<[f32; 2]>,
    /// Highest speed, moment of inertia, damping at full throttle, and without throttle with the
    /// clutch engaged and disengaged.
    engine: [f32; 5],
    is_automatic: bool,
    /// Duration of a shift, clutch strength, final ratio.
    gearbox: [f32; 3],
    forward_gears: Vec<Gear>,
    /// Mass and drag coefficient.
    body: [f32; 2],
    center_of_mass: [f32; 3],
    steering_curve: Vec<[f32; 2]>,
    /// For each wheel: friction, damping, steering angle, radius, torques of brake and handbrake,
    /// load of the largest lateral stiffness, lateral and longitudinal stiffness.
    wheels: Vec<[f32; 9]>,
    has_sweep: bool,
}

/// CARLA's names of the numbers of the engine.
const ENGINE_FIELDS: [&str; 5] = [
    "max_rpm",
    "moi",
    "damping_rate_full_throttle",
    "damping_rate_zero_throttle_clutch_engaged",
    "damping_rate_zero_throttle_clutch_disengaged",
];
/// CARLA's names of the numbers of a wheel.
const WHEEL_FIELDS: [&str; 9] = [
    "tire_friction",
    "damping_rate",
    "max_steer_angle",
    "radius",
    "max_brake_torque",
    "max_handbrake_torque",
    "lat_stiff_max_load",
    "lat_stiff_value",
    "long_stiff_value",
];

/// Reads one finite number for each name; the error names the one that is not.
fn numbers<const N: usize>(from: &mut Args, names: [&str; N]) -> Result<[f32; N], RpcError> {
    let mut numbers = [0.0; N];
    for (number, name) in numbers.iter_mut().zip(names) {
        *number = from.f32().map_err(|why| RpcError(format!("{name}: {}", why.0)))?;
    }
    Ok(numbers)
}

fn scaled(value: f32, factor: f64) -> f32 {
    (f64::from(value) * factor) as f32
}

fn with_arguments(curve: &[[f32; 2]], factor: f64) -> Vec<[f32; 2]> {
    curve.iter().map(|[at, value]| [scaled(*at, factor), *value]).collect()
}

/// The mass that each reported wheel carries.
fn carried_kg(mass_kg: f32, wheels: usize) -> f64 {
    f64::from(mass_kg) / reported(wheels).max(1) as f64
}

impl PhysicsControl {
    /// Reads the argument of `apply_physics_control`.
    pub(crate) fn read(args: &mut Args) -> Result<PhysicsControl, RpcError> {
        let mut f = args.list()?;
        let torque_curve = pairs(&mut f)?;
        let engine = numbers(&mut f, ENGINE_FIELDS)?;
        let is_automatic = f.bool()?;
        let gearbox = numbers(&mut f, ["gear_switch_time", "clutch_strength", "final_ratio"])?;
        let mut list = f.list()?;
        let mut forward_gears = Vec::new();
        while list.len() > 0 {
            let mut gear = list.list()?;
            let [ratio, down, up] = numbers(&mut gear, ["ratio", "down_ratio", "up_ratio"])?;
            forward_gears.push(Gear { ratio, down, up });
        }
        let body = numbers(&mut f, ["mass", "drag_coefficient"])?;
        let center_of_mass = f.vector()?;
        let steering_curve = pairs(&mut f)?;
        let mut list = f.list()?;
        let mut wheels = Vec::new();
        while list.len() > 0 {
            wheels.push(numbers(&mut list.list()?, WHEEL_FIELDS)?);
        }
        Ok(PhysicsControl {
            torque_curve,
            engine,
            is_automatic,
            gearbox,
            forward_gears,
            body,
            center_of_mass,
            steering_curve,
            wheels,
            has_sweep: f.bool()?,
        })
    }

    /// Returns the control that describes these parameters.
    pub(crate) fn of(physics: &VehiclePhysics) -> PhysicsControl {
        let VehiclePhysics { body, engine, gearbox, steering, wheels } = physics;
        let carried_kg = carried_kg(body.mass_kg, wheels.len());
        let count = reported(wheels.len());
        let part = wheels.len() as f64 / count.max(1) as f64;
        let wheel = |index| {
            let wheel = &wheels[wheel_of(index, wheels.len())];
            [
                wheel.grip * FRICTION,
                scaled(wheel.damping_nmsprad, part),
                f64::from(wheel.steer_max_rad).to_degrees() as f32,
                scaled(wheel.radius_m, CM_PER_M),
                scaled(wheel.brake_torque_nm, part),
                scaled(wheel.handbrake_torque_nm, part),
                wheel.stiff_load,
                wheel.stiffness_y,
                scaled(wheel.stiffness_x, carried_kg),
            ]
        };
        PhysicsControl {
            torque_curve: engine.torque.pairs().to_vec(),
            engine: [
                engine.max_rpm,
                engine.inertia_kgm2,
                engine.damping_full_nmsprad,
                engine.damping_geared_nmsprad,
                engine.damping_neutral_nmsprad,
            ],
            is_automatic: gearbox.automatic != 0,
            gearbox: [
                gearbox.shift_s,
                scaled(gearbox.clutch_nm, 1.0 / CLUTCH_SLIP_RADPS),
                gearbox.final_drive,
            ],
            forward_gears: gearbox.gears().to_vec(),
            body: [body.mass_kg, body.drag_coefficient],
            center_of_mass: flip(body.center_of_mass_m),
            steering_curve: with_arguments(steering.share.pairs(), KMH_PER_MPS),
            wheels: (0..count).map(wheel).collect(),
            has_sweep: body.sweep != 0,
        }
    }

    /// Returns the parameters that this control gives to a vehicle.
    ///
    /// # Errors
    ///
    /// A list is too long, or the number of wheels differs from the vehicle's.
    pub(crate) fn applied_to(&self, before: &VehiclePhysics) -> Result<VehiclePhysics, RpcError> {
        let mut physics = before.clone();
        let engine = &mut physics.engine;
        engine.torque = curve("torque_curve", &self.torque_curve)?;
        [
            engine.max_rpm,
            engine.inertia_kgm2,
            engine.damping_full_nmsprad,
            engine.damping_geared_nmsprad,
            engine.damping_neutral_nmsprad,
        ] = self.engine;
        let gearbox = &mut physics.gearbox;
        gearbox.automatic = self.is_automatic.into();
        let [shift_s, clutch, final_drive] = self.gearbox;
        (gearbox.shift_s, gearbox.final_drive) = (shift_s, final_drive);
        gearbox.clutch_nm = scaled(clutch, CLUTCH_SLIP_RADPS);
        let gears = &self.forward_gears;
        let many = || format!("there are {} forward_gears; the limit is 12", gears.len());
        *gearbox = gearbox.with_gears(gears).ok_or_else(many)?;
        [physics.body.mass_kg, physics.body.drag_coefficient] = self.body;
        physics.body.center_of_mass_m = flip(self.center_of_mass);
        physics.body.sweep = self.has_sweep.into();
        let shares = with_arguments(&self.steering_curve, 1.0 / KMH_PER_MPS);
        physics.steering.share = curve("steering_curve", &shares)?;
        let has = physics.wheels.len();
        let (given, wanted) = (self.wheels.len(), reported(has));
        if given != wanted {
            return Err(format!(
                "there are {given} wheels in the physics control, but the vehicle has {wanted}"
            )
            .into());
        }
        let carried_kg = carried_kg(physics.body.mass_kg, has).max(1e-3);
        let share = has as f64 / wanted.max(1) as f64;
        for (index, wheel) in physics.wheels.iter_mut().enumerate() {
            // The sums of the wheels that are one of ours.
            let mut sums = [0.0; 9];
            for (_, one) in (0..).zip(&self.wheels).filter(|(at, _)| wheel_of(*at, has) == index) {
                for (sum, number) in sums.iter_mut().zip(one) {
                    *sum += f64::from(*number);
                }
            }
            let mean = sums.map(|sum| sum * share);
            *wheel = VehicleWheel {
                grip: (mean[0] / f64::from(FRICTION)) as f32,
                damping_nmsprad: sums[1] as f32,
                steer_max_rad: mean[2].to_radians() as f32,
                radius_m: (mean[3] / CM_PER_M) as f32,
                brake_torque_nm: sums[4] as f32,
                handbrake_torque_nm: sums[5] as f32,
                stiff_load: mean[6] as f32,
                stiffness_y: mean[7] as f32,
                stiffness_x: (mean[8] / carried_kg) as f32,
                // The position of the wheel is that of the blueprint.
                ..*wheel
            };
        }
        Ok(physics)
    }

    /// Writes the control. The wheels of `physics` have the places that `pose` gives them.
    pub(crate) fn write(&self, physics: &VehiclePhysics, pose: &Pose, out: &mut Pack) {
        out.list(17);
        write_pairs(out, &self.torque_curve);
        let write_all = |out: &mut Pack, numbers: &[f32]| {
            for number in numbers {
                out.f32(*number);
            }
        };
        write_all(out, &self.engine);
        out.bool(self.is_automatic);
        write_all(out, &self.gearbox);
        out.list(self.forward_gears.len());
        for gear in &self.forward_gears {
            out.list(3).f32(gear.ratio).f32(gear.down).f32(gear.up);
        }
        write_all(out, &self.body);
        out.vector(self.center_of_mass);
        write_pairs(out, &self.steering_curve);
        out.list(self.wheels.len());
        for (index, numbers) in self.wheels.iter().enumerate() {
            let wheel = &physics.wheels[wheel_of(index, physics.wheels.len())];
            let at = pose.affine().transform_point3(Vec3::from_array(wheel.hub_m));
            write_all(out.list(10), numbers);
            // Centimetres, unlike all other positions of this struct.
            out.vector(flip((at * CM_PER_M as f32).to_array()));
        }
        out.bool(self.has_sweep);
    }
}

fn pairs(args: &mut Args) -> Result<Vec<[f32; 2]>, RpcError> {
    let mut list = args.list()?;
    let mut pairs = Vec::new();
    while list.len() > 0 {
        let mut pair = list.list()?;
        pairs.push([pair.f32()?, pair.f32()?]);
    }
    Ok(pairs)
}

fn curve(what: &str, pairs: &[[f32; 2]]) -> Result<Curve, RpcError> {
    let many = || format!("{what} has {} points; the limit is 16", pairs.len());
    Ok(Curve::new(pairs).ok_or_else(many)?)
}

fn write_pairs(out: &mut Pack, pairs: &[[f32; 2]]) {
    out.list(pairs.len());
    for [x, y] in pairs {
        out.list(2).f32(*x).f32(*y);
    }
}
